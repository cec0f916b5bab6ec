//! framelock's receiver.
#![no_std]
#![no_main]

use framelock::BufferedReceiver;
use framelock_formats::Sbus;
use framelock_rivals_on_chip::receiver;

receiver!(BufferedReceiver::<Sbus, 50>::new(Sbus));
