//! The whole show on one thread, under a simulated clock, with faults from a seed.
//!
//! The parts are the program's own: the server's [`Simulation`](bench_dragon::source::server::Simulation) and
//! [`Schedule`](bench_dragon::source::server::schedule::Schedule), the [`Monitor`](bench_dragon::safety::monitor::Monitor), the
//! [`Guard`](bench_dragon::safety::guard::Guard), the timecode's follower, and the supervisor's
//! [`Liveness`](bench_dragon::supervision::Liveness) and [`Resumption`](bench_dragon::supervision::Resumption). Simulated are the
//! clock, the bus, the kernel's signals, and the people.
//!
//! A [`Scenario`] is a function of its seed: the dragons, their plan, the settings, and a list of [`Fault`]s with their instants.
//! [`play`] is a function of the scenario: the same scenario gives the same trace, to the bit. [`Promise`] lists what must hold.
//! [`shortest`] reduces the faults of a broken promise to those that matter. [`Scenario::script`] is the part of a scenario that real
//! processes can repeat.

mod agenda;
mod dice;
mod disk;
mod fault;
mod frame;
mod guard;
mod observer;
mod plan;
mod promises;
mod recorder;
mod scenario;
mod script;
mod server;
mod shrink;
mod supervisor;
mod world;

pub use fault::{Fault, FaultKind, Operator, Part, TimecodeFault};
pub use promises::{Broken, Promise};
pub use scenario::Scenario;
pub use script::{Script, ScriptAction, ScriptStep};
pub use shrink::shortest;
pub use world::{Outcome, play, request_to_walk};
