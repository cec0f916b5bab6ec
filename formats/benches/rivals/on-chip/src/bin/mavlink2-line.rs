//! framelock's receiver, on a line.
#![no_std]
#![no_main]

use framelock::{BufferedReceiver, Line};
use framelock_formats::{Mavlink2, Mavlink2Entry};
use framelock_rivals_on_chip::{message, receiver};

fn dialect(id: u32) -> Option<Mavlink2Entry> {
    let (crc_extra, longest) = message(id)?;
    Some(Mavlink2Entry { crc_extra, longest })
}

receiver!(Line::new(BufferedReceiver::<_, 560>::new(Mavlink2(
    dialect
))));
