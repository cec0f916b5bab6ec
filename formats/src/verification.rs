//! Proves theorems 13g to 13i. Every layout keeps the laws of [`Format`], alone and together with other layouts. Other
//! harnesses prove that the following functions never panic, whatever the bytes are: the functions that check and write
//! frames, and the functions that decode frames of the shipped formats, except Modbus RTU and packets.
//!
//! Each harness for the laws classifies two prefixes of arbitrary bytes: the first `some` bytes, and the first `more`
//! bytes. In [`laws`], arbitrary results replace the results of parsing the header and of checking the rest of the
//! frame, so the laws hold with every header and every checksum.

mod any_layout;
mod any_of;
mod laws;
mod no_panic;
mod silence;
