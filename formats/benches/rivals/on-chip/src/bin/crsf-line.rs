//! framelock's receiver, on a line.
#![no_std]
#![no_main]

use framelock::{BufferedReceiver, Line};
use framelock_formats::Crsf;
use framelock_rivals_on_chip::receiver;

receiver!(Line::new(BufferedReceiver::<Crsf, 128>::new(
    Crsf
)));
