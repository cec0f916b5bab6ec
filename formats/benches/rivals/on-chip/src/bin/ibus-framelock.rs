//! framelock's receiver.
#![no_std]
#![no_main]

use framelock::BufferedReceiver;
use framelock_formats::Ibus;
use framelock_rivals_on_chip::receiver;

receiver!(BufferedReceiver::<Ibus, 64>::new(Ibus));
