//! What is read of a module of LLVM's intermediate representation.

use std::collections::{BTreeMap, BTreeSet, HashMap};

/// The functions and constants of one or more modules, by their names.
#[derive(Debug, Default)]
pub(crate) struct Module {
    pub(crate) functions: BTreeMap<String, Function>,
    pub(crate) constants: BTreeMap<String, Constant>,
    /// Functions that go by a second name, and their first.
    pub(crate) aliases: BTreeMap<String, String>,
    /// Functions that are declared, and never return: all of them panic.
    pub(crate) never_return: BTreeSet<String>,
    /// What is defined in a way that is not modelled, and why it is not.
    pub(crate) unreadable: BTreeMap<String, String>,
}

/// A function's blocks; the first is the entry.
#[derive(Debug)]
pub(crate) struct Function {
    pub(crate) result: Type,
    pub(crate) parameters: Vec<(Type, String)>,
    pub(crate) blocks: Vec<Block>,
}

impl Function {
    /// Where each block stands, by its label.
    pub(crate) fn block_places(&self) -> HashMap<&str, usize> {
        let blocks = self.blocks.iter().enumerate();
        blocks
            .map(|(place, block)| (block.label.as_str(), place))
            .collect()
    }
}

#[derive(Debug)]
pub(crate) struct Block {
    pub(crate) label: String,
    pub(crate) instructions: Vec<Instruction>,
    pub(crate) end: End,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Type {
    Void,
    Pointer,
    Integer(u32),
    Structure(Vec<Self>, Packed),
    Array(u64, Box<Self>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Packed {
    Yes,
    No,
}

/// Data that never changes: its bytes, and at which of them an address stands instead.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Constant {
    pub(crate) bytes: Vec<u8>,
    pub(crate) addresses: BTreeMap<usize, String>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Value {
    Local(String),
    Global(String),
    Integer(i128),
    /// Any value that there is.
    Undefined,
    /// 0 throughout, and the null pointer.
    Zero,
    Bytes(Vec<u8>),
    Aggregate(Vec<(Type, Self)>),
    /// An address computed from a constant's.
    Offset(Box<Self>, i128),
    /// An address that is a number: of what has no bytes.
    Address(i128),
}

#[derive(Debug)]
pub(crate) enum Instruction {
    /// `arithmetic` is an operator of two operands of one type, such as `add`.
    Binary {
        to: String,
        operator: String,
        of: Type,
        left: Value,
        right: Value,
    },
    Compare {
        to: String,
        predicate: String,
        of: Type,
        left: Value,
        right: Value,
    },
    Cast {
        to: String,
        operator: String,
        from: Type,
        value: Value,
        into: Type,
    },
    Select {
        to: String,
        condition: Value,
        of: Type,
        yes: Value,
        no: Value,
    },
    Phi {
        to: String,
        of: Type,
        incoming: Vec<(Value, String)>,
    },
    Load {
        to: String,
        of: Type,
        address: Value,
    },
    Store {
        of: Type,
        value: Value,
        address: Value,
    },
    Allocate {
        to: String,
        bytes: u64,
    },
    /// `address` plus each index times the size of what it counts.
    Offset {
        to: String,
        address: Value,
        steps: Vec<(Type, Value, u64)>,
    },
    Extract {
        to: String,
        of: Type,
        value: Value,
        field: usize,
    },
    Insert {
        to: String,
        of: Type,
        value: Value,
        part: (Type, Value),
        field: usize,
    },
    Call(Call),
}

/// A call, of a function by its name.
#[derive(Debug)]
pub(crate) struct Call {
    pub(crate) to: Option<String>,
    pub(crate) result: Type,
    pub(crate) function: String,
    pub(crate) arguments: Vec<(Type, Value)>,
}

/// How a block ends.
#[derive(Debug)]
pub(crate) enum End {
    Return(Option<(Type, Value)>),
    Jump(String),
    Branch {
        condition: Value,
        yes: String,
        no: String,
    },
    Switch {
        of: Type,
        value: Value,
        cases: Vec<(i128, String)>,
        otherwise: String,
    },
    Unreachable,
}

impl End {
    /// The blocks that may follow, in order, perhaps more than once.
    pub(crate) fn successors(&self) -> Vec<&str> {
        match self {
            Self::Return(_) | Self::Unreachable => Vec::new(),
            Self::Jump(to) => vec![to],
            Self::Branch { yes, no, .. } => vec![yes, no],
            Self::Switch {
                cases, otherwise, ..
            } => {
                let mut all: Vec<&str> = cases.iter().map(|(_, to)| to.as_str()).collect();
                all.push(otherwise);
                all
            }
        }
    }
}

impl Type {
    /// Bytes in memory, padding included, where a pointer has eight and nothing wider than 16
    /// bytes is aligned to more: as on every 64-bit machine that Rust's tools run on.
    pub(crate) fn size(&self) -> u64 {
        match self {
            Self::Void => 0,
            Self::Pointer => 8,
            Self::Integer(bits) => u64::from(bits.div_ceil(8)).next_multiple_of(self.alignment()),
            Self::Structure(..) => self.offset(usize::MAX),
            Self::Array(length, of) => length * of.size(),
        }
    }

    fn alignment(&self) -> u64 {
        match self {
            Self::Void | Self::Structure(_, Packed::Yes) => 1,
            Self::Pointer => 8,
            Self::Integer(bits) => u64::from(bits.div_ceil(8)).next_power_of_two().min(16),
            Self::Structure(fields, Packed::No) => {
                fields.iter().map(Self::alignment).max().unwrap_or(1)
            }
            Self::Array(_, of) => of.alignment(),
        }
    }

    /// Where in a structure or array the part `index` begins; behind the last, where it ends.
    pub(crate) fn offset(&self, index: usize) -> u64 {
        match self {
            Self::Structure(fields, packed) => {
                let mut at = 0_u64;
                for (place, field) in fields.iter().enumerate() {
                    if *packed == Packed::No {
                        at = at.next_multiple_of(field.alignment());
                    }
                    if place == index {
                        return at;
                    }
                    at += field.size();
                }
                at.next_multiple_of(self.alignment())
            }
            Self::Array(_, of) => index as u64 * of.size(),
            _ => 0,
        }
    }

    /// The type of the part `index` of a structure or array.
    pub(crate) fn part(&self, index: usize) -> Option<&Self> {
        match self {
            Self::Structure(fields, _) => fields.get(index),
            Self::Array(_, of) => Some(of),
            _ => None,
        }
    }
}
