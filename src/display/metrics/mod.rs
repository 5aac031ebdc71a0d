//! What a scraper is told, in the text format of Prometheus.
//!
//! Every metric is worked out of a [`Scene`], when it is asked for. Names begin with `bench_dragon_` and end with their unit;
//! what counts ends with `_total`. Numbers of the server's begin anew with each run, which Prometheus takes for the restart of a
//! counter; numbers of this process's own begin with it. What is not known has no sample.
//!
//! | file | of what |
//! |---|---|
//! | `bus` | whether frames come, what this process read of them, alerts |
//! | `show` | state, show time, clearance, forecast |
//! | `server` | ticks, overruns, lateness |
//! | `readers` | what each reader read and lost, what recorders have written |

mod buckets;
mod bus;
mod family;
mod readers;
mod server;
mod show;
mod site;

use prometheus::{TEXT_FORMAT, TextEncoder};

use crate::display::observe::Scene;

pub use site::{reply, router};

/// The media type of [`exposition`].
pub const MEDIA_TYPE: &str = TEXT_FORMAT;

/// All metrics of a scene at an instant, in nanoseconds of `CLOCK_MONOTONIC`, as text.
pub fn exposition(scene: &Scene, now_ns: u64) -> String {
    let families =
        [bus::families(scene, now_ns), show::families(scene), server::families(scene), readers::families(scene)];
    // A family without samples cannot be told.
    let families: Vec<_> = families.into_iter().flatten().filter(|family| !family.get_metric().is_empty()).collect();
    TextEncoder::new().encode_to_string(&families).expect("every family has a name and samples")
}

#[cfg(test)]
mod tests;
