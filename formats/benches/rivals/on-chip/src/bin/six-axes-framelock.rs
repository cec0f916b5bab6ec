//! framelock's receiver.
#![no_std]
#![no_main]

use framelock::Receiver;
use framelock_formats::SixAxes;
use framelock_rivals_on_chip::receiver;

receiver!(Receiver::<SixAxes>::new());
