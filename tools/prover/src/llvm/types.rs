//! Types, and how large they are.

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Type {
    Void,
    Pointer,
    Integer(u32),
    Structure { fields: Vec<Type>, packed: bool },
    Array(u64, Box<Type>),
}

impl Type {
    /// Bytes in memory, padding included. A pointer has eight, and nothing is aligned to more than
    /// 16: as on every 64-bit machine that Rust's tools run on.
    pub(crate) fn size(&self) -> u64 {
        match self {
            Self::Void => 0,
            Self::Pointer => 8,
            Self::Integer(bits) => u64::from(bits.div_ceil(8)).next_multiple_of(self.alignment()),
            Self::Structure { fields, packed } => {
                let aligned = |at: u64, to: &Self| match packed {
                    true => at,
                    false => at.next_multiple_of(to.alignment()),
                };
                let end = fields
                    .iter()
                    .fold(0, |at, field| aligned(at, field) + field.size());
                aligned(end, self)
            }
            Self::Array(length, of) => length * of.size(),
        }
    }

    fn alignment(&self) -> u64 {
        match self {
            Self::Void | Self::Structure { packed: true, .. } => 1,
            Self::Pointer => 8,
            Self::Integer(bits) => u64::from(bits.div_ceil(8)).next_power_of_two().min(16),
            Self::Structure { fields, .. } => fields.iter().map(Self::alignment).max().unwrap_or(1),
            Self::Array(_, of) => of.alignment(),
        }
    }
}
