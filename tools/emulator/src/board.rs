//! Runs core, chip and line together as a board. `controls.rs` changes the board and its surroundings;
//! `inspection.rs` reads its state.

mod controls;
mod inspection;

use std::cell::OnceCell;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

use defmt_decoder::Table;
use rsemu::core::space::AddressSpace;
use rsemu::cpu::arm::v7m::{ArmV7m, Config, xpsr};

use crate::assumptions::Assumptions;
use crate::bus::{Shared, address_space};
use crate::chip::Chip;
use crate::image::Image;
use crate::memory::{FLASH_SIZE, Memory};
use crate::trace::{Activation, Change, ResetCause, Trace};
use crate::{Error, Result};

/// The pin to which the line is wired: P0.08, to which the nRF52840-DK's USB serial port sends.
const LINE_PIN: u32 = 8;
/// The address of flash's last halfword, and the instruction `b .`, which [`Board::stick_main_loop`] writes there.
const STUCK: (u32, [u8; 2]) = (FLASH_SIZE - 2, [0xFE, 0xE7]);
/// The program counter during lockup: Armv7-M Architecture Reference Manual, "Lockup".
const LOCKED_UP: u32 = 0xFFFF_FFFE;
/// The number of steps of the core between two checks for a soft reset. A check takes longer than a step, so the board
/// does not check after every step.
const RESET_WITHIN: u32 = 32;
/// The fewest cycles that a tail chain takes. A tail chain leads from one handler directly into the next. A branch to a
/// handler's first instruction takes fewer cycles, so the cycles of a step distinguish a tail chain from such a branch.
const CHAIN: u64 = 7;

/// A watched word in RAM.
#[derive(Clone, Copy, Debug)]
struct Watch {
    address: u32,
    value: u32,
}

/// An emulated board with the firmware's image in its flash.
pub struct Board {
    core: ArmV7m,
    space: Arc<AddressSpace>,
    shared: Arc<Shared>,
    pub(crate) memory: Memory,
    pub(crate) image: Image,
    now: u64,
    /// The next instant at which a peripheral acts. Before this instant, only the core acts.
    quiet_until: u64,
    lines: u64,
    /// `pc`, `exception` and `it_state` are copies of the core's registers after its last step. The copies save time,
    /// because reading a register from the core takes a lock.
    pc: u32,
    exception: u16,
    /// The IT state, which is not 0 inside an IT block.
    it_state: u32,
    asleep: bool,
    booted: bool,
    steps: u32,
    instructions: u64,
    slept: u64,
    /// The active handlers: the running one last, after those that it preempted.
    handlers: Vec<Activation>,
    /// The future interruptions of the firmware: the instant and the duration of each, in cycles.
    hold_offs: VecDeque<(u64, u64)>,
    watches: Vec<Watch>,
    /// The log's texts, which are read from the ELF when they are first needed.
    pub(crate) log_table: OnceCell<Option<Table>>,
    /// The bytes of an incomplete log frame.
    pub(crate) log_bytes: Vec<u8>,
    trace: Trace,
    faults_stop: bool,
    /// The value of [`Assumptions::slowness`].
    slowness: u32,
    /// The fraction of a cycle that is carried over to the next step, in hundredths.
    owed: u64,
}

impl Board {
    /// Creates a board at power-on, before its first instruction.
    ///
    /// # Errors
    /// Returns an error if a segment of the image is neither in flash nor in RAM.
    pub fn new(image: Image) -> Result<Self> {
        let memory = Memory::new();
        image.load(&memory)?;
        let shared = Shared::new(Chip::new(memory.clone(), LINE_PIN));
        let space = Arc::new(address_space(&shared, &memory));
        Ok(Self {
            core: core(&space),
            space,
            shared,
            memory,
            image,
            now: 0,
            quiet_until: 0,
            lines: 0,
            pc: 0,
            exception: 0,
            it_state: 0,
            asleep: false,
            booted: false,
            steps: 0,
            instructions: 0,
            slept: 0,
            handlers: Vec::new(),
            hold_offs: VecDeque::new(),
            watches: Vec::new(),
            log_table: OnceCell::new(),
            log_bytes: Vec::new(),
            trace: Trace::default(),
            faults_stop: true,
            slowness: Assumptions::default().slowness,
            owed: 0,
        })
    }

    /// Returns the cycles since power-on.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Returns the number of instructions executed since power-on.
    #[must_use]
    pub fn instructions(&self) -> u64 {
        self.instructions
    }

    /// Returns the cycles that the core has slept since power-on.
    #[must_use]
    pub fn slept(&self) -> u64 {
        self.slept
    }

    /// Runs for `cycles`, and then to the end of the current instruction or exception entry. If a [`Board::hold_off`]
    /// begins during this time, runs at least to the end of the hold-off.
    ///
    /// # Errors
    /// Returns an error if the firmware faults, locks up, or does something that is not modelled.
    pub fn run_for(&mut self, cycles: u64) -> Result<()> {
        self.run_until(self.now + cycles)
    }

    /// Runs until the instant `at`, in cycles since power-on.
    ///
    /// # Errors
    /// Returns the same errors as [`Board::run_for`].
    pub fn run_until(&mut self, at: u64) -> Result<()> {
        self.run(at, |_| false).map(|_| ())
    }

    /// Runs until `stop` returns true, but at most until the instant `until`. Calls `stop` after every instruction,
    /// exception entry and sleep. Returns whether `stop` has returned true.
    ///
    /// # Errors
    /// Returns the same errors as [`Board::run_for`].
    pub fn run(&mut self, until: u64, mut stop: impl FnMut(&Self) -> bool) -> Result<bool> {
        while self.now < until {
            self.step(until)?;
            if stop(self) {
                return Ok(true);
            }
        }
        // Handle the events that are due now.
        self.settle()?;
        Ok(false)
    }

    /// Executes a reset sequence, an instruction, an exception entry, or the sleep up to the next event.
    fn step(&mut self, until: u64) -> Result<()> {
        if let Some((at, cycles)) = self.hold_offs.front().copied()
            && at <= self.now
        {
            self.hold_offs.pop_front();
            self.now += cycles;
        }
        if self.now >= self.quiet_until || self.shared.touched.load(Relaxed) {
            self.settle()?;
        }
        let (pc, before) = (self.pc, self.exception);
        self.shared.now.store(self.now, Relaxed);
        let cycles = self.core.step();
        let after = self.see_core();
        let slept_on = std::mem::replace(&mut self.asleep, self.core.is_asleep()) && self.asleep;
        let entered_again = before == after && self.entered_again(after, cycles);
        let cycles = if slept_on { cycles } else { self.slow(cycles) };
        if slept_on {
            self.slept += cycles;
        } else if std::mem::replace(&mut self.booted, true) {
            self.account(before, after, entered_again, cycles);
        }
        self.now += cycles;
        self.look(pc, before, after)?;
        // Skip time only if the core already slept before this step. A core that has just gone to sleep may wake
        // immediately, because masked interrupts also wake the core.
        if slept_on && !self.shared.touched.load(Relaxed) {
            let hold_off = self.hold_offs.front().map_or(u64::MAX, |(at, _)| *at);
            let wake = self.quiet_until.min(until).min(hold_off);
            if wake > self.now {
                self.slept += wake - self.now;
                self.now = wake;
            }
        }
        Ok(())
    }

    /// Accounts for a step that took these cycles: counts an instruction, adds the cycles to the running handler, and
    /// records a handler that has returned. The exceptions `before` and `after` the step are 0 if none is active.
    fn account(&mut self, before: u16, after: u16, entered_again: bool, cycles: u64) {
        let returned = entered_again || before != after && before != 0 && !self.is_active(before);
        let is_active = self.handlers.iter().any(|open| open.exception == after);
        let enters = after != 0 && (entered_again || !is_active);
        let mut handler = Activation {
            exception: after,
            at: self.now,
            cycles,
        };
        // A step that only enters an exception executes no instruction.
        if returned || !enters {
            self.instructions += 1;
            // In a tail chain, a handler returns, and the next one is entered without unstacking in between.
            (handler.at, handler.cycles) = (self.now + cycles, 0);
            if let Some(running) = self.handlers.last_mut() {
                running.cycles += cycles;
            }
        }
        if returned {
            self.trace.activations.extend(self.handlers.pop());
        }
        if enters {
            self.handlers.push(handler);
        }
    }

    /// Returns the cycles that a step takes with [`Assumptions::slowness`].
    fn slow(&mut self, cycles: u64) -> u64 {
        self.owed += cycles * u64::from(self.slowness.saturating_sub(100));
        let more = self.owed / 100;
        self.owed %= 100;
        if more > 0 {
            self.core.with_sys(|sys| sys.tick_cyccnt(more));
        }
        cycles + more
    }

    /// Copies the core's state, and returns the active exception.
    fn see_core(&mut self) -> u16 {
        let registers = self.core.regs();
        let [.., pc] = registers.r;
        self.pc = pc;
        self.it_state = registers.xpsr & xpsr::IT_MASK;
        let exception = u16::try_from(registers.xpsr & xpsr::EXCEPTION);
        self.exception = exception.expect("the mask leaves nine bits");
        self.exception
    }

    fn is_active(&self, exception: u16) -> bool {
        use rsemu::cpu::arm::v7m::sys::Exception;
        exception != 0
            && self
                .core
                .with_sys(|sys| sys.is_active(Exception(exception)))
    }

    /// Returns whether a handler returned and was entered again in the same step.
    fn entered_again(&self, exception: u16, cycles: u64) -> bool {
        if exception == 0 || cycles < CHAIN {
            return false;
        }
        let entry = self
            .memory
            .word(self.core.vtor() + 4 * u32::from(exception));
        entry.is_some_and(|entry| entry & !1 == self.pc)
    }

    /// Handles the effects of a step: rejected accesses, faults, lockup, changes of watched words, soft resets.
    fn look(&mut self, pc: u32, before: u16, after: u16) -> Result<()> {
        if self.shared.touched.load(Relaxed)
            && let Some(refusal) = self.shared.chip().context.refusal.clone()
        {
            return Err(self.stopped(&refusal, pc));
        }
        if self.faults_stop && before != after && (3..=6).contains(&after) {
            return Err(self.fault(pc));
        }
        if self.pc == LOCKED_UP {
            if self.faults_stop {
                return Err(self.stopped("the core locked up", pc));
            }
            self.reset_for(ResetCause::Lockup);
        }
        for (number, watch) in self.watches.iter_mut().enumerate() {
            let value = self.memory.word(watch.address).expect("in memory");
            if std::mem::replace(&mut watch.value, value) != value {
                self.trace.changes.push(Change {
                    watch: number,
                    at: self.now,
                    value,
                });
            }
        }
        self.steps = (self.steps + 1) % RESET_WITHIN;
        if self.steps == 0 && self.core.reset_requested() {
            self.reset_for(ResetCause::Soft);
        }
        Ok(())
    }

    /// Returns an error with the program counter and the name of the function at this address.
    fn stopped(&self, what: &str, pc: u32) -> Error {
        let function = self.image.function_at(pc);
        let function = function.map_or("unknown function", |function| &function.name);
        Error(format!("{what} (pc {pc:#010x}, {function})"))
    }

    fn fault(&self, pc: u32) -> Error {
        let exception = self.core.current_exception().name();
        let (cfsr, hfsr, bfar) = self.core.with_sys(|sys| (sys.cfsr, sys.hfsr, sys.bfar));
        let status = format!("CFSR {cfsr:#010x}, HFSR {hfsr:#010x}, address {bfar:#010x}");
        self.stopped(&format!("{exception}: {status}"), pc)
    }

    /// Lets the chip act up to now, and updates the core's interrupt lines.
    fn settle(&mut self) -> Result<()> {
        self.shared.touched.store(false, Relaxed);
        let mut chip = self.shared.chip();
        self.quiet_until = chip.advance(self.now);
        if let Some(refusal) = chip.context.refusal.clone() {
            drop(chip);
            return Err(self.stopped(&refusal, self.pc));
        }
        let bites = std::mem::take(&mut chip.context.bites);
        let lines = chip.interrupts();
        drop(chip);
        if bites {
            self.reset_for(ResetCause::Watchdog);
            return Ok(());
        }
        if self.it_state != 0 {
            // Let the interrupt wait until the IT block ends, because rsemu would otherwise forget the block's
            // condition.
            self.quiet_until = self.now;
            return Ok(());
        }
        let changed = lines ^ self.lines;
        self.lines = lines;
        for line in 0..48 {
            if changed >> line & 1 == 1 {
                self.core.set_irq(line, lines >> line & 1 == 1);
            }
        }
        Ok(())
    }
}

/// Creates a core as it is after a reset. On the nRF52840, an interrupt's priority has three bits.
fn core(space: &Arc<AddressSpace>) -> ArmV7m {
    let core = ArmV7m::new(Config::CORTEX_M4F.with_priority_bits(3));
    core.attach_space(Arc::clone(space));
    core
}
