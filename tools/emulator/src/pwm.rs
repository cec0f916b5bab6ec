//! PWM0: nRF52840 Product Specification, section "PWM".
//!
//! Modelled: up counter; sequence 0 with CNT and REFRESH, a value for each channel (individual load);
//! SEQSTARTED, SEQEND, PWMPERIODEND, STOPPED. Not modelled, and refused: sequence 1, ENDDELAY, LOOP,
//! the other loads, NEXTSTEP, up-and-down.
//!
//! The specification leaves open what the model does as follows: SEQSTART while it runs takes effect
//! at the end of the period; EasyDMA fetches a step when it is loaded, which for the first is the
//! instant of SEQSTART.

use crate::error::Refusal;
use crate::peripheral::{Common, Context, Peripheral};
use crate::time::MICROSECOND;

const STOP: u32 = 0x004;
const SEQSTART0: u32 = 0x008;
const STOPPED: u32 = 0x104;
const SEQSTARTED0: u32 = 0x108;
const SEQEND0: u32 = 0x110;
const PWMPERIODEND: u32 = 0x118;
const ENABLE: u32 = 0x500;
const MODE: u32 = 0x504;
const COUNTERTOP: u32 = 0x508;
const PRESCALER: u32 = 0x50C;
const DECODER: u32 = 0x510;
const LOOP: u32 = 0x514;
const SEQ0_PTR: u32 = 0x520;
const SEQ0_CNT: u32 = 0x524;
const SEQ0_REFRESH: u32 = 0x528;
const PSEL_OUT: u32 = 0x560;
const DISCONNECTED: u32 = 1 << 31;
/// DECODER: a value for each channel, the next step after REFRESH periods.
const INDIVIDUAL: u32 = 2;
const SHORT_SEQEND0_STOP: u32 = 1;
/// Values that make a step.
const STEP: u32 = 4;

/// One period as it came out of the pins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Period {
    /// When it began, in cycles.
    pub at: u64,
    /// How long it is, in cycles.
    pub length: u64,
    /// For each channel: for how many cycles it is high; nothing if it goes to no pin.
    pub high: [Option<u64>; 4],
}

impl Period {
    /// Widths of the pulses in microseconds, rounded down; nothing for a channel without a pin.
    #[must_use]
    pub fn pulses(&self) -> [Option<u64>; 4] {
        self.high
            .map(|high| high.map(|cycles| cycles / MICROSECOND))
    }
}

/// The sequence that is played.
#[derive(Clone, Copy, Debug)]
struct Played {
    /// Values (of 16 bits) loaded so far.
    loaded: u32,
    /// Periods for which the step that is loaded goes on.
    more_periods: u32,
}

#[derive(Clone, Debug)]
pub(crate) struct Pwm {
    enabled: bool,
    top: u32,
    prescaler: u32,
    decoder: u32,
    pointer: u32,
    values_count: u32,
    refresh: u32,
    outputs: [u32; 4],
    values: [u16; 4],
    /// Until its last step is loaded and over.
    played: Option<Played>,
    /// SEQSTART while running: what is played from the next period on, and its first step.
    queued: Option<(Played, [u16; 4])>,
    period_ends_at: Option<u64>,
    stopping: bool,
    /// SEQSTART begins a period at once: `Assumptions::start_cuts_period`.
    pub(crate) start_cuts_period: bool,
    /// All periods so far.
    pub(crate) periods: Vec<Period>,
}

impl Pwm {
    pub(crate) fn new() -> Self {
        Self {
            enabled: false,
            top: 0x3FF,
            prescaler: 0,
            decoder: 0,
            pointer: 0,
            values_count: 0,
            refresh: 0,
            outputs: [u32::MAX; 4],
            values: [0; 4],
            played: None,
            queued: None,
            period_ends_at: None,
            stopping: false,
            start_cuts_period: false,
            periods: Vec::new(),
        }
    }

    fn start(&mut self, context: &mut Context) -> Option<()> {
        if !self.enabled {
            return context.check(Err(Refusal::Pwm("not enabled")));
        }
        if self.decoder != INDIVIDUAL {
            return context.check(Err(Refusal::Pwm("DECODER is not individual load")));
        }
        if self.values_count == 0 || !self.values_count.is_multiple_of(STEP) {
            return context.check(Err(Refusal::Pwm("SEQ.CNT is no multiple of a step")));
        }
        let first = self.fetch(0, context)?;
        self.stopping = false;
        if self.period_ends_at.is_some() && !self.start_cuts_period {
            self.queued = Some(first);
        } else {
            self.cut_period(context.now);
            self.play(first, context);
            self.begin_period(context.now);
        }
        Some(())
    }

    /// The period under way, if any, is over now.
    fn cut_period(&mut self, now: u64) {
        if self.period_ends_at.is_some()
            && let Some(last) = self.periods.last_mut()
        {
            last.length = now - last.at;
            last.high = last.high.map(|high| high.map(|high| high.min(last.length)));
        }
    }

    /// Fetches the step that begins with that value.
    fn fetch(&self, from: u32, context: &mut Context) -> Option<(Played, [u16; 4])> {
        let mut bytes = [0; 8];
        context.check(context.memory.dma_read(self.pointer + 2 * from, &mut bytes))?;
        let [a, b, c, d, e, f, g, h] = bytes;
        let values = [[a, b], [c, d], [e, f], [g, h]].map(u16::from_le_bytes);
        let played = Played {
            loaded: from + STEP,
            more_periods: self.refresh,
        };
        Some((played, values))
    }

    fn play(&mut self, (played, values): (Played, [u16; 4]), context: &mut Context) {
        self.played = Some(played);
        self.values = values;
        context.raise(SEQSTARTED0);
    }

    fn begin_period(&mut self, now: u64) {
        let (top, count) = (u64::from(self.top), (MICROSECOND / 16) << self.prescaler);
        let mut high = [None; 4];
        for ((high, value), output) in high.iter_mut().zip(self.values).zip(self.outputs) {
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
        self.periods.push(Period {
            at: now,
            length,
            high,
        });
        self.period_ends_at = Some(now + length);
    }

    /// What is played in the period that begins now.
    fn next_step(&mut self, context: &mut Context) {
        if let Some(queued) = self.queued.take() {
            return self.play(queued, context);
        }
        let Some(played) = &mut self.played else {
            return;
        };
        if played.more_periods > 0 {
            played.more_periods -= 1;
        } else if played.loaded < self.values_count {
            let from = played.loaded;
            if let Some((played, values)) = self.fetch(from, context) {
                self.played = Some(played);
                self.values = values;
            }
        } else {
            // The last step goes on until something else is started.
            self.played = None;
            context.raise(SEQEND0);
        }
    }
}

impl Peripheral for Pwm {
    fn common(&self) -> Common {
        let events = [SEQSTARTED0, SEQEND0, PWMPERIODEND, STOPPED];
        Common::new("PWM0", &events, SHORT_SEQEND0_STOP)
    }

    fn read(&self, offset: u32, _: u64) -> Option<u32> {
        Some(match offset {
            ENABLE => u32::from(self.enabled),
            MODE | LOOP => 0,
            COUNTERTOP => self.top,
            PRESCALER => self.prescaler,
            DECODER => self.decoder,
            SEQ0_PTR => self.pointer,
            SEQ0_CNT => self.values_count,
            SEQ0_REFRESH => self.refresh,
            PSEL_OUT.. => *self.outputs.get(((offset - PSEL_OUT) / 4) as usize)?,
            _ => return None,
        })
    }

    fn write(&mut self, offset: u32, value: u32, _: &mut Context) -> Option<()> {
        match offset {
            ENABLE if value <= 1 => {
                self.enabled = value == 1;
                if !self.enabled {
                    self.played = None;
                    self.queued = None;
                    self.period_ends_at = None;
                }
            }
            // Up counter, no loop: see above.
            MODE | LOOP if value == 0 => {}
            COUNTERTOP if (3..=0x7FFF).contains(&value) => self.top = value,
            PRESCALER if value <= 7 => self.prescaler = value,
            DECODER if value <= 2 => self.decoder = value,
            SEQ0_PTR => self.pointer = value,
            SEQ0_CNT if value <= 0x7FFF => self.values_count = value,
            SEQ0_REFRESH if value <= 0xFF_FFFF => self.refresh = value,
            PSEL_OUT.. => *self.outputs.get_mut(((offset - PSEL_OUT) / 4) as usize)? = value,
            _ => return None,
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

    fn shorted(&self, event: u32, shorts: u32) -> [Option<u32>; 2] {
        let stops = event == SEQEND0 && shorts & SHORT_SEQEND0_STOP != 0;
        [stops.then_some(STOP), None]
    }

    fn next(&self) -> Option<u64> {
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
        self.begin_period(context.now);
    }
}
