//! Theorem 13g: whatever stands in a layout, it keeps the laws of [`Format`], alone and among others; and nothing
//! panics, in deciding, in checking, in writing, or in decoding the shipped formats, whatever the bytes are.
//!
//! Each harness of the laws takes any bytes, and asks about the first of them twice: about `some`, and about
//! `more`. What says whether a checksum is right is any function of the frame: so the laws hold with any
//! checksum.

mod any_layout;
mod any_of;
mod laws;
mod no_panic;
