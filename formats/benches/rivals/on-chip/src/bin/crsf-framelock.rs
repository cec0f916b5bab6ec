//! framelock's receiver.
#![no_std]
#![no_main]

use framelock::BufferedReceiver;
use framelock_formats::Crsf;
use framelock_rivals_on_chip::receiver;

receiver!(BufferedReceiver::<Crsf, 128>::new(Crsf));
