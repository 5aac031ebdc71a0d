//! The numbers of runs.

/// A random number under 2^53, so that every double and every JavaScript number holds it.
pub(crate) fn random_run_id() -> u64 {
    let mut bytes = [0; 8];
    rustix::rand::getrandom(&mut bytes, rustix::rand::GetRandomFlags::empty())
        .expect("the kernel's random numbers are ready long before any program runs");
    u64::from_ne_bytes(bytes) >> 11
}
