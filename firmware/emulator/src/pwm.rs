//! PWM0: nRF52840 Product Specification, section "PWM".
//!
//! Modelled: up counter; individual, common and grouped load; refresh count; sequences 0 and 1, each
//! with CNT, REFRESH and ENDDELAY; SEQEND, PWMPERIODEND, STOPPED. Not modelled, and refused: LOOP,
//! waveform load, NEXTSTEP, up-and-down.
//!
//! The specification leaves open what the model does as follows: SEQSTART while it runs takes effect
//! at the end of the period; EasyDMA fetches a step when it is loaded, which for the first is the
//! instant of SEQSTART.

use crate::MICROSECOND;
use crate::error::Misuse;
use crate::peripheral::{Common, Context, Peripheral};

const STOP: u32 = 0x004;
const SEQSTART0: u32 = 0x008;
const SEQSTART1: u32 = 0x00C;
const STOPPED: u32 = 0x104;
const SEQSTARTED0: u32 = 0x108;
const SEQSTARTED1: u32 = 0x10C;
const SEQEND0: u32 = 0x110;
const SEQEND1: u32 = 0x114;
const PWMPERIODEND: u32 = 0x118;
const ENABLE: u32 = 0x500;
const MODE: u32 = 0x504;
const COUNTERTOP: u32 = 0x508;
const PRESCALER: u32 = 0x50C;
const DECODER: u32 = 0x510;
const LOOP: u32 = 0x514;
const SEQ0: u32 = 0x520;
const SEQ1: u32 = 0x540;
const PSEL_OUT: u32 = 0x560;
const DISCONNECTED: u32 = 1 << 31;

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

#[derive(Clone, Copy, Debug, Default)]
struct Sequence {
    pointer: u32,
    count: u32,
    refresh: u32,
    end_delay: u32,
}

/// A sequence that is played.
#[derive(Clone, Copy, Debug)]
struct Played {
    number: usize,
    /// Values (of 16 bits) loaded so far.
    loaded: u32,
    /// Periods for which the step that is loaded goes on.
    more_periods: u32,
    ended: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct Pwm {
    common: Common,
    enabled: bool,
    top: u32,
    prescaler: u32,
    decoder: u32,
    sequences: [Sequence; 2],
    outputs: [u32; 4],
    values: [u16; 4],
    played: Option<Played>,
    /// SEQSTART while running: what is played from the next period on, and its first step.
    queued: Option<(Played, [u16; 4])>,
    period_ends_at: Option<u64>,
    stopping: bool,
    /// All periods so far.
    pub(crate) periods: Vec<Period>,
}

impl Pwm {
    pub(crate) fn new() -> Self {
        Self {
            common: Common::new(
                &[
                    STOPPED,
                    SEQSTARTED0,
                    SEQSTARTED1,
                    SEQEND0,
                    SEQEND1,
                    PWMPERIODEND,
                ],
                3,
            ),
            enabled: false,
            top: 0x3FF,
            prescaler: 0,
            decoder: 0,
            sequences: [Sequence::default(); 2],
            outputs: [u32::MAX; 4],
            values: [0; 4],
            played: None,
            queued: None,
            period_ends_at: None,
            stopping: false,
            periods: Vec::new(),
        }
    }

    /// As after a reset; the periods that were are kept.
    pub(crate) fn reset(&mut self) {
        let periods = std::mem::take(&mut self.periods);
        *self = Self::new();
        self.periods = periods;
    }

    fn count(&self) -> u64 {
        (MICROSECOND / 16) << self.prescaler
    }

    /// How many values make a step.
    fn step(&self) -> u32 {
        match self.decoder & 3 {
            0 => 1,
            1 => 2,
            _ => 4,
        }
    }

    fn start(&mut self, number: usize, context: &mut Context) -> Option<()> {
        if !self.enabled {
            return context.check(Err(Misuse::Pwm("not enabled")));
        }
        if self.top < 3 {
            return context.check(Err(Misuse::Pwm("COUNTERTOP is below 3")));
        }
        let mut played = Played {
            number,
            loaded: 0,
            more_periods: 0,
            ended: false,
        };
        let values = self.fetch(&mut played, context)?;
        self.stopping = false;
        if self.period_ends_at.is_some() {
            self.queued = Some((played, values));
        } else {
            self.play(played, values, context);
            self.begin_period(context.now);
        }
        Some(())
    }

    /// Fetches a step.
    fn fetch(&self, played: &mut Played, context: &mut Context) -> Option<[u16; 4]> {
        let sequence = self.sequences.get(played.number).copied()?;
        let step = self.step();
        if sequence.count == 0 || sequence.count % step != 0 {
            return context.check(Err(Misuse::Pwm("SEQ.CNT is no multiple of a step")));
        }
        let mut bytes = [0; 8];
        let wanted = bytes.get_mut(..2 * step as usize)?;
        let address = sequence.pointer + 2 * played.loaded;
        context.check(context.memory.dma_read(address, wanted))?;
        played.loaded += step;
        played.more_periods = sequence.refresh;
        let [a0, a1, b0, b1, c0, c1, d0, d1] = bytes;
        let value = |low, high| u16::from_le_bytes([low, high]);
        let [a, b, c, d] = [value(a0, a1), value(b0, b1), value(c0, c1), value(d0, d1)];
        Some(match step {
            1 => [a; 4],
            2 => [a, a, b, b],
            _ => [a, b, c, d],
        })
    }

    fn play(&mut self, played: Played, values: [u16; 4], context: &mut Context) {
        let event = [SEQSTARTED0, SEQSTARTED1].get(played.number).copied();
        self.played = Some(played);
        self.values = values;
        if let Some(event) = event {
            self.common.raise(event, context);
        }
    }

    fn begin_period(&mut self, now: u64) {
        let (top, count) = (u64::from(self.top), self.count());
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
        if let Some((played, values)) = self.queued.take() {
            self.play(played, values, context);
            return;
        }
        let Some(mut played) = self.played else {
            return;
        };
        if played.ended {
            return;
        }
        if played.more_periods > 0 {
            played.more_periods -= 1;
            self.played = Some(played);
            return;
        }
        let Some(sequence) = self.sequences.get(played.number).copied() else {
            return;
        };
        if played.loaded < sequence.count {
            if let Some(values) = self.fetch(&mut played, context) {
                self.values = values;
            }
        } else if sequence.end_delay > 0 && played.loaded == sequence.count {
            // The last step goes on for so many periods more, and then for ever.
            played.more_periods = sequence.end_delay - 1;
            played.loaded += 1;
        } else {
            played.ended = true;
            let event = if played.number == 0 { SEQEND0 } else { SEQEND1 };
            self.common.raise(event, context);
        }
        self.played = Some(played);
    }
}

impl Peripheral for Pwm {
    fn name(&self) -> &'static str {
        "PWM0"
    }

    fn common(&self) -> &Common {
        &self.common
    }

    fn common_mut(&mut self) -> &mut Common {
        &mut self.common
    }

    fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            ENABLE => u32::from(self.enabled),
            MODE | LOOP => 0,
            COUNTERTOP => self.top,
            PRESCALER => self.prescaler,
            DECODER => self.decoder,
            SEQ0..PSEL_OUT => {
                let sequence = self.sequences.get(usize::from(offset >= SEQ1))?;
                match offset & 0x1F {
                    0x00 => sequence.pointer,
                    0x04 => sequence.count,
                    0x08 => sequence.refresh,
                    0x0C => sequence.end_delay,
                    _ => return None,
                }
            }
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
            SEQ0..PSEL_OUT => {
                let sequence = self.sequences.get_mut(usize::from(offset >= SEQ1))?;
                match offset & 0x1F {
                    0x00 => sequence.pointer = value,
                    0x04 if value <= 0x7FFF => sequence.count = value,
                    0x08 if value <= 0xFF_FFFF => sequence.refresh = value,
                    0x0C if value <= 0xFF_FFFF => sequence.end_delay = value,
                    _ => return None,
                }
            }
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
                    self.common.raise(STOPPED, context);
                }
                Some(())
            }
            SEQSTART0 => self.start(0, context),
            SEQSTART1 => self.start(1, context),
            _ => None,
        }
    }

    fn shorted(&self, event: u32) -> [Option<u32>; 2] {
        let stops = match event {
            SEQEND0 => self.common.shorts & 1 != 0,
            SEQEND1 => self.common.shorts & 2 != 0,
            _ => false,
        };
        [stops.then_some(STOP), None]
    }

    fn next(&self) -> Option<u64> {
        self.period_ends_at
    }

    fn advance(&mut self, context: &mut Context) {
        self.common.raise(PWMPERIODEND, context);
        if std::mem::take(&mut self.stopping) {
            self.period_ends_at = None;
            self.played = None;
            self.common.raise(STOPPED, context);
            return;
        }
        self.next_step(context);
        self.begin_period(context.now);
    }
}
