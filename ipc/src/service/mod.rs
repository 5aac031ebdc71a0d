//! Names, types and limits of the services, and the [`Member`] that opens or creates them.

mod joining;
mod member;
mod trouble;

pub use crate::wire::services::*;
pub use joining::Role;
pub use member::Member;
