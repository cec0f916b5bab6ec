//! framelock's receiver, on a line.
#![no_std]
#![no_main]

use framelock::{Line, Receiver};
use framelock_formats::SixAxes;
use framelock_rivals_on_chip::receiver;

receiver!(Line::new(Receiver::<SixAxes>::new()));
