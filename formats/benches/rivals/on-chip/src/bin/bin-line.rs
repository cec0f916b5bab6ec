//! framelock's receiver, on a line.
#![no_std]
#![no_main]

use framelock::motion::Bin;
use framelock::{Line, Receiver};
use framelock_rivals_on_chip::receiver;

receiver!(Line::new(Receiver::<Bin>::new()));
