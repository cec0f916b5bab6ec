//! PWM0: nRF52840 Product Specification, section "PWM".
//!
//! Modelled: up counter; sequence 0 with CNT and REFRESH, a value for each channel (individual load);
//! SEQSTARTED, SEQEND, PWMPERIODEND, STOPPED. Not modelled, and rejected: sequence 1, ENDDELAY, LOOP,
//! the other loads, NEXTSTEP, up-and-down counter.
//!
//! The specification leaves two points open. The model assumes the following. If SEQSTART is triggered while the PWM
//! runs, the new sequence begins at the end of the period. EasyDMA fetches a step when the step is loaded; the first
//! step is loaded at SEQSTART.

use crate::MICROSECOND;
use crate::error::Refusal;
use crate::line::SerialLine;
use crate::peripheral::{Common, Context, Peripheral, RegisterFile as _, registers};
use crate::trace::Period;

const STOP: u32 = 0x004;
const SEQSTART0: u32 = 0x008;
const STOPPED: u32 = 0x104;
const SEQSTARTED0: u32 = 0x108;
const SEQEND0: u32 = 0x110;
const PWMPERIODEND: u32 = 0x118;
const ENABLE: u32 = 0x500;
const DISCONNECTED: u32 = 1 << 31;
/// The value of DECODER for individual load: a step has one value for each channel, and lasts
/// REFRESH + 1 periods.
const INDIVIDUAL: u32 = 2;
/// The number of values in a step.
const STEP: u32 = 4;

registers! {
    0x500 enable: u32 = 0, 0..=1;
    /// Up counter only.
    0x504 mode: u32 = 0, 0..=0;
    0x508 top: u32 = 0x3FF, 3..=0x7FFF;
    0x50C prescaler: u32 = 0, 0..=7;
    0x510 decoder: u32 = 0, 0..=2;
    /// No loop.
    0x514 loops: u32 = 0, 0..=0;
    /// Sequence 0: its address, its number of values, and the number of additional periods for each
    /// step.
    0x520 pointer: u32 = 0, 0..;
    0x524 values_count: u32 = 0, 0..=0x7FFF;
    0x528 refresh: u32 = 0, 0..=0xFF_FFFF;
    /// The pin of each channel.
    0x560 outputs: [u32; 4] = [u32::MAX; 4], 0..;
}

/// The progress of a sequence.
#[derive(Clone, Copy, Debug)]
struct Played {
    /// The number of 16-bit values loaded so far.
    loaded: u32,
    /// The number of additional periods for which the current step lasts.
    more_periods: u32,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Pwm {
    registers: Registers,
    values: [u16; 4],
    /// The current sequence, until its last step is over.
    played: Option<Played>,
    /// The sequence that begins with the next period, and its first step. A SEQSTART while the PWM runs sets this
    /// field.
    queued: Option<(Played, [u16; 4])>,
    period_ends_at: Option<u64>,
    stopping: bool,
}

impl Pwm {
    fn start(&mut self, context: &mut Context) -> Option<()> {
        let misused = if self.registers.enable == 0 {
            Some("started while not enabled")
        } else if self.registers.decoder != INDIVIDUAL {
            Some("started without individual load in DECODER")
        } else if self.registers.values_count == 0
            || !self.registers.values_count.is_multiple_of(STEP)
        {
            Some("started with a SEQ.CNT that is no multiple of a step")
        } else {
            None
        };
        if let Some(how) = misused {
            return context.check(Err(Refusal::misused("PWM0", how)));
        }
        let first = self.fetch(0, context)?;
        self.stopping = false;
        if self.period_ends_at.is_some() && !context.assumptions.start_cuts_period {
            self.queued = Some(first);
        } else {
            self.cut_period(context);
            self.play(first, context);
            self.begin_period(context);
        }
        Some(())
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

    /// Fetches the step that begins with value number `from`.
    fn fetch(&self, from: u32, context: &mut Context) -> Option<(Played, [u16; 4])> {
        let mut bytes = [0; 8];
        let address = self.registers.pointer + 2 * from;
        context.check(context.memory.dma_read(address, &mut bytes))?;
        let [a, b, c, d, e, f, g, h] = bytes;
        let values = [[a, b], [c, d], [e, f], [g, h]].map(u16::from_le_bytes);
        let played = Played {
            loaded: from + STEP,
            more_periods: self.registers.refresh,
        };
        Some((played, values))
    }

    fn play(&mut self, (played, values): (Played, [u16; 4]), context: &mut Context) {
        self.played = Some(played);
        self.values = values;
        context.raise(SEQSTARTED0);
    }

    fn begin_period(&mut self, context: &mut Context) {
        let top = u64::from(self.registers.top);
        let count = (MICROSECOND / 16) << self.registers.prescaler;
        let mut high = [None; 4];
        for ((high, value), output) in high.iter_mut().zip(self.values).zip(self.registers.outputs)
        {
            if output & DISCONNECTED == 0 {
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

    /// Loads the step for the period that begins now.
    fn next_step(&mut self, context: &mut Context) {
        if let Some(queued) = self.queued.take() {
            return self.play(queued, context);
        }
        let Some(played) = &mut self.played else {
            return;
        };
        if played.more_periods > 0 {
            played.more_periods -= 1;
        } else if played.loaded < self.registers.values_count {
            let from = played.loaded;
            if let Some((played, values)) = self.fetch(from, context) {
                self.played = Some(played);
                self.values = values;
            }
        } else {
            // After the last step, the PWM repeats this step until another sequence starts.
            self.played = None;
            context.raise(SEQEND0);
        }
    }
}

impl Peripheral for Pwm {
    fn common(&self) -> Common {
        let events = [SEQSTARTED0, SEQEND0, PWMPERIODEND, STOPPED];
        Common::new("PWM0", &events, &[(1, SEQEND0, STOP)])
    }

    fn read(&mut self, offset: u32, _: &Context) -> Option<u32> {
        self.registers.read(offset)
    }

    fn write(&mut self, offset: u32, value: u32, _: &mut Context) -> Option<()> {
        self.registers.write(offset, value)?;
        if offset == ENABLE && value == 0 {
            self.played = None;
            self.queued = None;
            self.period_ends_at = None;
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            // "Stops PWM pulse generation on all channels at the end of current PWM period."
            STOP => {
                self.queued = None;
                self.stopping = self.period_ends_at.is_some();
                if !self.stopping {
                    context.raise(STOPPED);
                }
                Some(())
            }
            SEQSTART0 => self.start(context),
            _ => None,
        }
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        self.period_ends_at
    }

    fn advance(&mut self, context: &mut Context) {
        context.raise(PWMPERIODEND);
        if std::mem::take(&mut self.stopping) {
            self.period_ends_at = None;
            self.played = None;
            context.raise(STOPPED);
            return;
        }
        self.next_step(context);
        self.begin_period(context);
    }
}
