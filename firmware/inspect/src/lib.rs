//! What the firmware's ELF tells without being run: how much flash and RAM it takes, and what its
//! interrupt handlers can call.

mod calls;
mod sizes;
mod thumb;

pub use calls::{HandlerCalls, why_handlers_may_panic};
pub use sizes::Sizes;
