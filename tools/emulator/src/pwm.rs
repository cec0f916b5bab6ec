//! PWM0: nRF52840 Product Specification, section "PWM".
//!
//! Modelled: up counter; sequence 0 of one step, which has a value for each channel (individual load); SEQSTARTED,
//! PWMPERIODEND, STOPPED. Not modelled, and rejected: longer sequences, sequence 1, REFRESH, ENDDELAY, LOOP, the other
//! loads, NEXTSTEP, up-and-down counter.
//!
//! The specification leaves two points open. In the model, EasyDMA fetches the step at SEQSTART. If SEQSTART is
//! triggered while the PWM runs, the new sequence begins at the end of the period, or immediately with
//! [`start_cuts_period`](crate::Assumptions::start_cuts_period).

use crate::MICROSECOND;
use crate::line::SerialLine;
use crate::peripheral::{ANY, Access, Common, Context, Peripheral};
use crate::trace::Period;

const STOP: u32 = 0x004;
const SEQSTART0: u32 = 0x008;
const STOPPED: u32 = 0x104;
const SEQSTARTED0: u32 = 0x108;
const PWMPERIODEND: u32 = 0x118;

const ENABLE: u32 = 0x500;
const COUNTERTOP: u32 = 0x508;
const PRESCALER: u32 = 0x50C;
const DECODER: u32 = 0x510;
/// Sequence 0: its address, and its number of values.
const PTR: u32 = 0x520;
const CNT: u32 = 0x524;
/// The pin of each channel.
const PSEL: [u32; 4] = [0x560, 0x564, 0x568, 0x56C];

const DISCONNECTED: u32 = 1 << 31;
/// The value of DECODER for individual load: a step has one value for each channel.
const INDIVIDUAL: u32 = 2;
/// The number of values in a step.
const STEP: u32 = 4;

#[derive(Debug)]
pub(crate) struct Pwm {
    common: Common,
    values: [u16; 4],
    /// The step that begins with the next period. A SEQSTART while the PWM runs sets this field.
    queued: Option<[u16; 4]>,
    period_ends_at: Option<u64>,
    stopping: bool,
}

impl Pwm {
    pub(crate) fn new() -> Self {
        let registers = [
            // Disabling the PWM is not modelled.
            (ENABLE, 0, Access::Plain(1..=1)),
            (COUNTERTOP, 0x3FF, Access::Plain(3..=0x7FFF)),
            (PRESCALER, 0, Access::Plain(0..=7)),
            (DECODER, 0, Access::Plain(INDIVIDUAL..=INDIVIDUAL)),
            (PTR, 0, ANY),
            (CNT, 0, Access::Plain(STEP..=STEP)),
        ];
        let registers = registers
            .into_iter()
            .chain(PSEL.map(|offset| (offset, u32::MAX, ANY)));
        let events = [SEQSTARTED0, PWMPERIODEND, STOPPED];
        Self {
            common: Common::new("PWM0", 0x4001_C000, &events, registers),
            values: [0; 4],
            queued: None,
            period_ends_at: None,
            stopping: false,
        }
    }

    fn start(&mut self, context: &mut Context) -> Result<(), String> {
        if [ENABLE, DECODER, CNT].map(|offset| self.common[offset]) != [1, INDIVIDUAL, STEP] {
            let how = "started while not enabled, or without individual load in DECODER, or without SEQ.CNT";
            return Err(format!("PWM0: {how}"));
        }
        let mut bytes = [0; 8];
        context.memory.dma_read(self.common[PTR], &mut bytes)?;
        let [a, b, c, d, e, f, g, h] = bytes;
        let values = [[a, b], [c, d], [e, f], [g, h]].map(u16::from_le_bytes);
        self.stopping = false;
        if self.period_ends_at.is_some()
            && !context.deviates("start_cuts_period", context.assumptions.start_cuts_period)
        {
            self.queued = Some(values);
        } else {
            self.cut_period(context);
            self.play(values, context);
            self.begin_period(context);
        }
        Ok(())
    }

    /// Ends the current period now, if there is one.
    fn cut_period(&self, context: &mut Context) {
        if self.period_ends_at.is_some()
            && let Some(last) = context.pwm_periods.last_mut()
        {
            last.length = context.now - last.at;
            last.high = last.high.map(|high| high.map(|high| high.min(last.length)));
        }
    }

    fn play(&mut self, values: [u16; 4], context: &mut Context) {
        self.values = values;
        self.common.raise(SEQSTARTED0, context);
    }

    fn begin_period(&mut self, context: &mut Context) {
        let top = u64::from(self.common[COUNTERTOP]);
        let count = (MICROSECOND / 16) << self.common[PRESCALER];
        let mut high = [None; 4];
        for ((high, value), pin) in high.iter_mut().zip(self.values).zip(PSEL) {
            if self.common[pin] & DISCONNECTED == 0 {
                let compare = u64::from(value & 0x7FFF).min(top);
                // Polarity 1: the period begins high and falls at the compare value.
                let counts = if value & 0x8000 == 0 {
                    top - compare
                } else {
                    compare
                };
                *high = Some(counts * count);
            }
        }
        let length = top * count;
        context.pwm_periods.push(Period {
            at: context.now,
            length,
            high,
        });
        self.period_ends_at = Some(context.now + length);
    }
}

impl Peripheral for Pwm {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            // "Stops PWM pulse generation on all channels at the end of current PWM period."
            STOP => {
                self.queued = None;
                self.stopping = self.period_ends_at.is_some();
                if !self.stopping {
                    self.common.raise(STOPPED, context);
                }
                Some(())
            }
            SEQSTART0 => {
                let started = self.start(context);
                context.check(started)
            }
            _ => None,
        }
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        self.period_ends_at
    }

    /// Ends a period. The PWM repeats its step until another sequence starts or STOP is triggered.
    fn advance(&mut self, context: &mut Context) {
        self.common.raise(PWMPERIODEND, context);
        if std::mem::take(&mut self.stopping) {
            self.period_ends_at = None;
            self.common.raise(STOPPED, context);
            return;
        }
        if let Some(queued) = self.queued.take() {
            self.play(queued, context);
        }
        self.begin_period(context);
    }
}
