//! Random numbers that a failing test can be run with again.

use std::env;
use std::hash::{BuildHasher as _, DefaultHasher, Hash as _, Hasher as _, RandomState};

const VARIABLE: &str = "BENCH_DRAGON_TEST_SEED";

/// What all random numbers of a test follow from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seed(u64);

impl Seed {
    /// A new one, or the one that is asked for; printed, so that a failing test tells it.
    pub(crate) fn announced() -> Self {
        let asked = env::var(VARIABLE).ok().and_then(|seed| seed.parse().ok());
        let seed = asked.unwrap_or_else(|| RandomState::new().hash_one(0));
        println!("{VARIABLE}={seed}");
        Self(seed)
    }

    /// The number at a place, from 0 to 1.
    pub(crate) fn share(self, place: u64) -> f64 {
        let mut hasher = DefaultHasher::new();
        (self.0, place).hash(&mut hasher);
        (hasher.finish() >> 11) as f64 / (1_u64 << 53) as f64
    }
}
