//! framelock's receiver.
#![no_std]
#![no_main]

use framelock::Receiver;
use framelock::motion::Bin;
use framelock_rivals_on_chip::receiver;

receiver!(Receiver::<Bin>::new());
