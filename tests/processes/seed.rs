//! Random numbers that can be repeated after a failure.

use std::env;

const VARIABLE: &str = "BENCH_DRAGON_TEST_SEED";

/// The seed of all random numbers of a test.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seed(u64);

impl Seed {
    /// Returns a new seed, or the one of the environment. Prints it, so that the output of a failing test has it.
    pub(crate) fn announced() -> Self {
        let asked = env::var(VARIABLE).ok().and_then(|seed| seed.parse().ok());
        let seed = asked.unwrap_or_else(|| fastrand::u64(..));
        println!("{VARIABLE}={seed}");
        Self(seed)
    }

    /// Returns the random numbers of one part of the test. They do not depend on the order of the parts.
    pub(crate) fn random(self, part: u64) -> fastrand::Rng {
        fastrand::Rng::with_seed(self.0.wrapping_add(part))
    }
}
