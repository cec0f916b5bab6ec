//! framelock's receiver.
#![no_std]
#![no_main]

use framelock::Receiver;
use framelock::motion::BinCrc8;
use framelock_rivals_on_chip::receiver;

receiver!(Receiver::<BinCrc8>::new());
