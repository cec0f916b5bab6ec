//! Everything that one would set for another machine, in one place. What contradicts itself does
//! not compile.

use core::num::NonZeroU32;

use framelock::motion::FailsafeParameters;
use framelock_reception::ERRORS_A_TICK;
use nrf52840_hal::gpio::{Disconnected, Input, Level, Output, Pin, PullUp, PushPull, p0, p1};
use nrf52840_hal::pac::uarte0::baudrate::BAUDRATE_A;

/// Bits a second on the line, 8N1. The chip has only certain rates: see [`baud_register`].
pub(crate) const BAUD: u32 = if cfg!(feature = "megabaud") {
    1_000_000
} else {
    115_200
};

/// What finds the frames. The receiver searches the bytes of a broken frame again.
#[cfg(not(any(feature = "lecture", feature = "bin-crc8")))]
pub(crate) type Parser = framelock::Receiver<framelock::motion::Bin>;
/// What finds the frames, which have a checksum.
#[cfg(feature = "bin-crc8")]
pub(crate) type Parser = framelock::Receiver<framelock::motion::BinCrc8>;
/// What finds the frames. The lecture's machine throws a broken frame away.
#[cfg(feature = "lecture")]
pub(crate) type Parser = framelock::lecture::Lecture;

/// The receiver, and the counters of what came over the line.
pub(crate) type Line = framelock::Line<Parser>;

/// In this time, in microseconds, the UARTE stores a byte that waits, once it may. Under half a byte
/// time, so that after a line error it is over before the next byte comes.
pub(crate) const NONE_WAITS_AFTER: u32 = BYTE_TIME * 2 / 5;

/// Silence that ends a frame, in microseconds (L1). More than a USB serial adapter leaves inside a
/// frame, less than the sender leaves between frames.
pub(crate) const GAP_AFTER: u32 = 5_000;

/// How the outputs behave when frames stop, and come again. Ticks are microseconds.
pub(crate) const FAILSAFE: FailsafeParameters<u8, 3> = FailsafeParameters {
    hold_after: 100_000,
    ramp_after: 500_000,
    park: [128; 3],
    // The full travel in one second.
    ticks_per_unit: [NonZeroU32::new(3_922).unwrap(); 3],
};

/// The main loop runs at least this often, in microseconds, also in silence.
pub(crate) const TICK: u32 = 2_000;

/// The watchdog resets the chip if it was not fed for this long, in milliseconds. A change counts
/// from the first reset that ends the watchdog: power-on, pin, or its own.
pub(crate) const WATCHDOG: u32 = 250;

/// Width of a servo's pulse at demand 0 and at 255, in microseconds.
pub(crate) const PULSE: [u16; 2] = [1_000, 2_000];

/// From one pulse to the next, in microseconds: 50 Hz.
pub(crate) const PULSE_PERIOD: u16 = 20_000;

/// Whether the debug port and the reset button are kept working, for which UICR is written: see
/// `debug_port.rs`.
pub(crate) const KEEP_DEBUGGABLE: bool = !cfg!(feature = "leave-debug-port");

/// The reset button's pin, P0.18: the number is written to UICR as it is.
pub(crate) const RESET_PIN: u32 = 18;

/// Pulled up: nothing connected reads as a quiet line.
pub(crate) type InputPin = Pin<Input<PullUp>>;

/// The pins in use. Each can be given away only once.
pub(crate) struct Pins {
    /// Serial data in.
    pub(crate) receive: InputPin,
    /// Where the kit's probe has RTS. It leaves flow control off if this is high before the first byte.
    _flow_control: p0::P0_05<Input<PullUp>>,
    /// Pulses for pitch, roll, yaw.
    pub(crate) servos: [Pin<Output<PushPull>>; 3],
    /// In lock, line error, failsafe. They light when low.
    pub(crate) leds: [Pin<Output<PushPull>>; 3],
}

/// The nRF52840-DK's pins: its USB serial port, D3 to D5 of the Arduino header, LED1 to LED3.
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

/// One byte on the line, in microseconds, rounded up: start bit, eight bits, stop bit.
pub(crate) const BYTE_TIME: u32 = 10_000_000_u32.div_ceil(BAUD);

/// The value for the UARTE's register. Any other rate does not compile.
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
        921_600 => BAUDRATE_A::BAUD921600,
        1_000_000 => BAUDRATE_A::BAUD1M,
        _ => panic!("the UARTE has no such baud rate"),
    }
}

const _: BAUDRATE_A = baud_register();
const _: () = {
    assert!(GAP_AFTER > BYTE_TIME && NONE_WAITS_AFTER > 1);
    assert!(
        ERRORS_A_TICK as u32 >= TICK / (8 * BYTE_TIME),
        "errors that a frame lies between must all interrupt"
    );
    assert!(FAILSAFE.hold_after >= 1 && FAILSAFE.hold_after <= FAILSAFE.ramp_after);
    assert!(
        TICK <= FAILSAFE.hold_after,
        "the failsafe must be asked more often"
    );
    assert!(WATCHDOG * 1_000 > 4 * TICK && WATCHDOG <= 60_000);
    assert!(PULSE[0] < PULSE[1] && PULSE[1] < PULSE_PERIOD && PULSE_PERIOD < 1 << 15);
    assert!(
        PULSE_PERIOD as u32 >= PULSE[1] as u32 + 4 * TICK,
        "new pulses are handed over behind a period's pulses, before its end"
    );
};
