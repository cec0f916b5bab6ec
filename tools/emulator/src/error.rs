//! Why an emulation stops.

use thiserror::Error;

/// Why the emulation stopped. All of them are about the guest, or about what the model lacks.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Error {
    /// The guest used the chip in a way that the product specification forbids, or leaves open, or
    /// that is not modelled.
    #[error("{refusal} (pc {pc:#010x}{function})")]
    Refused {
        /// What it did.
        refusal: Refusal,
        /// The instruction that did it, or that ran at the time.
        pc: u32,
        /// Its function, if known: ", in NAME".
        function: String,
    },
    /// The core took a fault.
    #[error(
        "{exception} at pc {pc:#010x}{function}: CFSR {cfsr:#010x}, HFSR {hfsr:#010x}, \
         address {bfar:#010x}"
    )]
    Fault {
        /// `hardfault`, `busfault`, …
        exception: &'static str,
        /// The instruction that ran into it.
        pc: u32,
        /// Its function, if known: ", in NAME".
        function: String,
        /// The Configurable Fault Status Register.
        cfsr: u32,
        /// The `HardFault` Status Register.
        hfsr: u32,
        /// The Bus Fault Address Register.
        bfar: u32,
    },
    /// A fault inside a fault's handler: nothing but a reset helps.
    #[error("the core locked up at pc {pc:#010x}")]
    Lockup {
        /// Where.
        pc: u32,
    },
    /// The ELF cannot be loaded.
    #[error("the image cannot be loaded: {0}")]
    Image(String),
    /// No symbol has that name, or several have it.
    #[error("the image has {found} symbols named `{name}`, and exactly one is needed")]
    Symbol {
        /// What was asked for.
        name: String,
        /// How many there are.
        found: usize,
    },
}

/// What was done to an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Reading.
    Read,
    /// Writing that value.
    Write(u32),
    /// Triggering the task, by PPI or a short.
    Task,
}

impl std::fmt::Display for Access {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Read => write!(formatter, "read of"),
            Self::Write(value) => write!(formatter, "write of {value:#x} to"),
            Self::Task => write!(formatter, "task of"),
        }
    }
}

/// What the guest did that is not modelled, or that the product specification forbids or does not
/// describe.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[allow(missing_docs, reason = "the texts say it")]
pub enum Refusal {
    #[error(
        "{access} {peripheral} at {address:#010x}, which is not modelled: model it, or keep the \
         firmware from using it"
    )]
    Unmodelled {
        access: Access,
        peripheral: &'static str,
        address: u32,
    },
    #[error("EasyDMA to {address:#010x}, which is not RAM")]
    DmaOutsideRam { address: u32 },
    #[error("{peripheral}: {how}; what happens then is not specified, or not modelled")]
    Misused {
        peripheral: &'static str,
        how: &'static str,
    },
    #[error("UICR at {address:#010x}: written while NVMC.CONFIG does not enable writing")]
    UicrNotWritable { address: u32 },
    #[error("PPI: more than {0} events at one instant; the channels form a loop")]
    Loop(usize),
}

impl Refusal {
    pub(crate) fn misused(peripheral: &'static str, how: &'static str) -> Self {
        Self::Misused { peripheral, how }
    }
}

/// The usual result.
pub type Result<T> = std::result::Result<T, Error>;
