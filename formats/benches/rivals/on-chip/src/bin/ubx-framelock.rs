//! framelock's receiver.
#![no_std]
#![no_main]

use framelock::BufferedReceiver;
use framelock_formats::Ubx;
use framelock_rivals_on_chip::receiver;

receiver!(BufferedReceiver::<Ubx<106>, 212>::new(Ubx));
