//! framelock's receiver, on a line.
#![no_std]
#![no_main]

use framelock::motion::BinCrc8;
use framelock::{Line, Receiver};
use framelock_rivals_on_chip::receiver;

receiver!(Line::new(Receiver::<BinCrc8>::new()));
