//! Random numbers that a failing test can be run with again.

use std::env;

const VARIABLE: &str = "BENCH_DRAGON_TEST_SEED";

/// What all random numbers of a test follow from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seed(u64);

impl Seed {
    /// A new one, or the one that is asked for; printed, so that a failing test tells it.
    pub(crate) fn announced() -> Self {
        let asked = env::var(VARIABLE).ok().and_then(|seed| seed.parse().ok());
        let seed = asked.unwrap_or_else(|| fastrand::u64(..));
        println!("{VARIABLE}={seed}");
        Self(seed)
    }

    /// The random numbers of one part of the test, whatever order the parts come in.
    pub(crate) fn random(self, part: u64) -> fastrand::Rng {
        fastrand::Rng::with_seed(self.0.wrapping_add(part))
    }
}
