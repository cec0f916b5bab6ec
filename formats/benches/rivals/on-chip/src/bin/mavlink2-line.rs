//! framelock's receiver, on a line.
#![no_std]
#![no_main]

use framelock::{BufferedReceiver, Line};
use framelock_formats::Mavlink2;
use framelock_rivals_on_chip::{MESSAGES, receiver};

receiver!(Line::new(BufferedReceiver::<_, 560>::new(Mavlink2(
    MESSAGES
))));
