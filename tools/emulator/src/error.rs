//! The errors that stop an emulation.

use thiserror::Error;

/// The reason why the emulation stopped. Each reason is an action of the firmware or a gap in the
/// model.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The firmware used the chip in a way that the product specification forbids or leaves open,
    /// or that is not modelled.
    #[error("{refusal} (pc {pc:#010x}{function})")]
    Refused {
        /// The rejected action.
        refusal: Refusal,
        /// The address of the instruction that caused the action, or that was executing at the time.
        pc: u32,
        /// The instruction's function, if known, as in ", in NAME".
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
        /// The address of the instruction that faulted.
        pc: u32,
        /// The instruction's function, if known, as in ", in NAME".
        function: String,
        /// The Configurable Fault Status Register.
        cfsr: u32,
        /// The `HardFault` Status Register.
        hfsr: u32,
        /// The Bus Fault Address Register.
        bfar: u32,
    },
    /// The core faulted inside a fault's handler. Only a reset helps.
    #[error("the core locked up at pc {pc:#010x}")]
    Lockup {
        /// The address of the last instruction.
        pc: u32,
    },
    /// The ELF cannot be loaded.
    #[error("the image cannot be loaded: {0}")]
    Image(String),
    /// No symbol has this name, or several have it.
    #[error("the image has {found} symbols named `{name}`, and exactly one is needed")]
    Symbol {
        /// The requested name.
        name: String,
        /// The number of symbols with this name.
        found: usize,
    },
}

/// An action on an address.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum Access {
    /// Reading the register.
    #[error("read of")]
    Read,
    /// Writing this value.
    #[error("write of {0:#x} to")]
    Write(u32),
    /// Triggering the task, by PPI or a short.
    #[error("task of")]
    Task,
}

/// An action of the firmware that is not modelled, or that the product specification forbids or
/// does not describe.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[allow(missing_docs, reason = "the texts say it")]
#[non_exhaustive]
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
    #[error("{peripheral}: {how}; the effect is not specified or not modelled")]
    Misused {
        peripheral: &'static str,
        how: &'static str,
    },
}

impl Refusal {
    pub(crate) fn misused(peripheral: &'static str, how: &'static str) -> Self {
        Self::Misused { peripheral, how }
    }
}

/// A result with this crate's error.
pub type Result<T> = std::result::Result<T, Error>;
