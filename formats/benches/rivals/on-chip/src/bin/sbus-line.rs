//! framelock's receiver, on a line.
#![no_std]
#![no_main]

use framelock::{BufferedReceiver, Line};
use framelock_formats::Sbus;
use framelock_rivals_on_chip::receiver;

receiver!(Line::new(BufferedReceiver::<Sbus, 50>::new(Sbus)));
