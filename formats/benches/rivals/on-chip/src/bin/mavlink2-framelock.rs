//! framelock's receiver.
#![no_std]
#![no_main]

use framelock::BufferedReceiver;
use framelock_formats::Mavlink2;
use framelock_rivals_on_chip::{MESSAGES, receiver};

receiver!(BufferedReceiver::<_, 560>::new(Mavlink2(MESSAGES)));
