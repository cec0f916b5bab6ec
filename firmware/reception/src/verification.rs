//! Theorem 12.
