//! All settings that you may need to change for another machine. Contradictory settings do not compile.

use framelock::motion::FailsafeParameters;
use framelock_reception::ERRORS_A_TICK;
use nrf52840_hal::gpio::{Disconnected, Input, Level, Output, Pin, PullUp, PushPull, p0, p1};
use nrf52840_hal::pac::uarte0::baudrate::BAUDRATE_A;

/// Baud rate of the line, 8N1. Only certain rates compile: see [`baud_register`].
pub(crate) const BAUD: u32 = if cfg!(feature = "megabaud") {
    1_000_000
} else {
    115_200
};

/// The parser, for frames without a checksum. It searches the bytes of a broken frame again.
#[cfg(not(any(feature = "lecture", feature = "bin-crc8")))]
pub(crate) type Parser = framelock::Receiver<framelock::motion::Bin>;
/// The parser, for frames with a checksum.
#[cfg(feature = "bin-crc8")]
pub(crate) type Parser = framelock::Receiver<framelock::motion::BinCrc8>;
/// The parser: the lecture's machine, which discards a broken frame.
#[cfg(feature = "lecture")]
pub(crate) type Parser = framelock::lecture::Lecture;

/// The receiver, with counters of its bytes, frames and line events.
pub(crate) type Line = framelock::Line<Parser>;

/// A time in microseconds, less than half a byte time. If a byte waits in the FIFO when a transfer is opened, the UARTE
/// stores the byte within this time. After a line error, this time elapses before the next byte if no handler is late.
pub(crate) const NONE_WAITS_AFTER: u32 = BYTE_TIME * 2 / 5;

/// The length of a silence that ends a frame, in microseconds (L1 of theorem 12). It is longer than the pauses that a
/// USB serial adapter inserts into a frame, and shorter than the sender's pauses between frames. A handler that is late
/// makes the silence look longer by its delay: a handler that is 5 ms late reports a gap even on a line without pauses.
pub(crate) const GAP_AFTER: u32 = 5_000;

/// How fast the outputs move, and their behaviour when frames stop and when they resume. Times are in microseconds.
pub(crate) const FAILSAFE: FailsafeParameters<u8, 3> = FailsafeParameters {
    park: [128; 3],
    longest_step: 2 * TICK,
    hold_after: 100_000,
    ramp_after: 500_000,
    frames_to_start: 3,
    approach_for: 1_000_000,
    // The outputs cover their full travel in one second, and in a fifth of a second when they are live.
    approach_travel: 1_000_000,
    live_travel: 200_000,
};

/// Period of the main loop, in microseconds. The main loop also runs while the line is silent.
pub(crate) const TICK: u32 = 2_000;

/// The watchdog's timeout, in milliseconds. A changed value takes effect after the first reset that stops the watchdog:
/// power-on, the reset pin, or the watchdog's own reset.
pub(crate) const WATCHDOG: u32 = 250;

/// Widths of a servo's pulse at demand 0 and at demand 255, in microseconds.
pub(crate) const PULSE: [u16; 2] = [1_000, 2_000];

/// Period of the servo pulses, in microseconds: 50 Hz.
pub(crate) const PULSE_PERIOD: u16 = 20_000;

/// Whether the firmware writes to UICR, so that the debug port and the reset button keep working: see `debug_port.rs`.
/// Only erasing the whole chip undoes this.
pub(crate) const WRITE_UICR: bool = cfg!(feature = "write-uicr");

/// The reset button's pin, P0.18. With [`WRITE_UICR`], the firmware writes this number to UICR.
pub(crate) const RESET_PIN: u32 = 18;

/// An input with a pull-up resistor, so that an unconnected pin reads as an idle line.
pub(crate) type InputPin = Pin<Input<PullUp>>;

/// The pins in use.
pub(crate) struct Pins {
    /// Serial data in.
    pub(crate) receive: InputPin,
    /// The pin that is connected to RTS of the kit's probe. The probe leaves flow control off if this pin is high
    /// before the first byte.
    _flow_control: p0::P0_05<Input<PullUp>>,
    /// The servo pulses for pitch, roll and yaw.
    pub(crate) servos: [Pin<Output<PushPull>>; 3],
    /// The LEDs for lock, line error and failsafe. They are lit when the pin is low.
    pub(crate) leds: [Pin<Output<PushPull>>; 3],
}

/// Returns the nRF52840-DK's pins: its USB serial port, D3 to D5 of the Arduino header, LED1 to LED3.
pub(crate) fn pins(p0: p0::Parts, p1: p1::Parts) -> Pins {
    Pins {
        receive: p0.p0_08.into_pullup_input().degrade(),
        _flow_control: p0.p0_05.into_pullup_input(),
        servos: [
            low(p1.p1_04.degrade()),
            low(p1.p1_05.degrade()),
            low(p1.p1_06.degrade()),
        ],
        leds: [
            high(p0.p0_13.degrade()),
            high(p0.p0_14.degrade()),
            high(p0.p0_15.degrade()),
        ],
    }
}

fn low(pin: Pin<Disconnected>) -> Pin<Output<PushPull>> {
    pin.into_push_pull_output(Level::Low)
}

fn high(pin: Pin<Disconnected>) -> Pin<Output<PushPull>> {
    pin.into_push_pull_output(Level::High)
}

/// Duration of one byte on the line, in microseconds, rounded up: start bit, eight data bits, stop bit.
pub(crate) const BYTE_TIME: u32 = 10_000_000_u32.div_ceil(BAUD);

/// Returns the value of the UARTE's BAUDRATE register. Only the rates below compile, except 921 600 baud, which the
/// UARTE misses by more than 2 %. `FIGURES.txt` has measurements at each rate that compiles.
pub(crate) const fn baud_register() -> BAUDRATE_A {
    match BAUD {
        9_600 => BAUDRATE_A::BAUD9600,
        19_200 => BAUDRATE_A::BAUD19200,
        38_400 => BAUDRATE_A::BAUD38400,
        57_600 => BAUDRATE_A::BAUD57600,
        115_200 => BAUDRATE_A::BAUD115200,
        230_400 => BAUDRATE_A::BAUD230400,
        250_000 => BAUDRATE_A::BAUD250000,
        460_800 => BAUDRATE_A::BAUD460800,
        921_600 => panic!("the UARTE makes 941 176 baud of 921 600, which is 2.1 % too fast"),
        1_000_000 => BAUDRATE_A::BAUD1M,
        _ => panic!("the UARTE has no such baud rate"),
    }
}

const _: BAUDRATE_A = baud_register();
const _: () = {
    assert!(NONE_WAITS_AFTER > 1);
    assert!(
        2 * GAP_AFTER > 6 * BYTE_TIME,
        "after a stop, the UARTE still receives for five byte times, so it must not be switched off earlier"
    );
    assert!(
        ERRORS_A_TICK as u32 >= TICK / (8 * BYTE_TIME),
        "errors with a whole frame between them must all interrupt"
    );
    if let Err(contradiction) = FAILSAFE.check() {
        panic!("{}", contradiction.message());
    }
    assert!(
        TICK <= FAILSAFE.longest_step,
        "the failsafe must be polled more often"
    );
    assert!(WATCHDOG * 1_000 > 4 * TICK && WATCHDOG <= 60_000);
    assert!(PULSE[0] < PULSE[1] && PULSE[1] < PULSE_PERIOD && PULSE_PERIOD < 1 << 15);
    assert!(
        PULSE_PERIOD as u32 >= PULSE[1] as u32 + 4 * TICK,
        "new pulses are handed over after a period's pulses and before its end"
    );
};
