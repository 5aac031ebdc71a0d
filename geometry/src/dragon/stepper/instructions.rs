//! Selection of the vector instructions for the steps. Detection at run time lets one program run on every machine.
#![allow(
    unsafe_code,
    reason = "a function compiled for more instructions than the program may only be called where they exist"
)]

use glam::DVec3;

use super::pass::Pass;

/// Whether the whole program was compiled for fused multiplication and addition.
const FUSED: bool = cfg!(any(target_arch = "aarch64", target_feature = "fma"));

/// The vector instructions that the stepper uses on this machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instructions {
    has_avx2: bool,
}

impl Instructions {
    /// The best instructions available.
    #[cfg(target_arch = "x86_64")]
    pub fn best() -> Self {
        Self { has_avx2: is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") }
    }

    /// The best instructions available.
    #[cfg(not(target_arch = "x86_64"))]
    pub fn best() -> Self {
        Self::portable()
    }

    /// The instructions for which the whole program was compiled.
    pub fn portable() -> Self {
        Self { has_avx2: false }
    }

    /// Name of the instructions beyond those for which the whole program was compiled.
    pub fn name(self) -> &'static str {
        if self.has_avx2 { "AVX2, FMA" } else { "portable" }
    }

    /// Runs a pass with these instructions.
    pub(super) fn run<H>(self, pass: Pass<'_, H, impl Fn(DVec3, DVec3) -> H>) {
        let on_ground = pass.curve.route.is_on_ground();
        #[cfg(target_arch = "x86_64")]
        if self.has_avx2 {
            // SAFETY: `has_avx2` is true only if the processor has been found to have both features.
            return unsafe { if on_ground { run_with_avx2::<H, true>(pass) } else { run_with_avx2::<H, false>(pass) } };
        }
        if on_ground { pass.run::<FUSED, true>() } else { pass.run::<FUSED, false>() }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_with_avx2<H, const ON_GROUND: bool>(pass: Pass<'_, H, impl Fn(DVec3, DVec3) -> H>) {
    pass.run::<true, ON_GROUND>();
}
