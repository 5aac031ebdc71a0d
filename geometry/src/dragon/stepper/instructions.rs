//! Which vector instructions the steps are made with: found out once, at run time, so that one program runs everywhere.
#![allow(
    unsafe_code,
    reason = "a function compiled for more instructions than the program may only be called where they exist"
)]

use glam::DVec2;

use super::pass::Pass;

/// The instructions that this machine has for steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instructions {
    has_avx2: bool,
}

impl Instructions {
    /// The best that there are.
    #[cfg(target_arch = "x86_64")]
    pub fn best() -> Self {
        Self { has_avx2: is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") }
    }

    /// The best that there are.
    #[cfg(not(target_arch = "x86_64"))]
    pub fn best() -> Self {
        Self::portable()
    }

    /// Those that the whole program was compiled for.
    pub fn portable() -> Self {
        Self { has_avx2: false }
    }

    /// The name of what goes beyond those that the whole program was compiled for.
    pub fn name(self) -> &'static str {
        if self.has_avx2 { "AVX2, FMA" } else { "portable" }
    }

    /// Makes a pass with these instructions.
    pub(super) fn run<H>(self, pass: Pass<'_, H, impl Fn(DVec2, DVec2) -> H>) {
        #[cfg(target_arch = "x86_64")]
        if self.has_avx2 {
            // SAFETY: `has_avx2` is only ever true where the processor has been found to have both features.
            return unsafe { run_with_avx2(pass) };
        }
        pass.run::<{ cfg!(any(target_arch = "aarch64", target_feature = "fma")) }>();
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_with_avx2<H>(pass: Pass<'_, H, impl Fn(DVec2, DVec2) -> H>) {
    pass.run::<true>();
}
