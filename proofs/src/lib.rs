//! What framelock's receivers are measured against: the naive whole-buffer
//! [reference](mod@reference). It shares no code with them.
#![no_std]
#![forbid(unsafe_code)]

pub mod reference;
