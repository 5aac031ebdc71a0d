//! Which program this is, and on which kernel it runs.

use std::fs;

use super::{Check, Finding, Patient};

/// The versions.
pub(super) struct Version;

impl Check for Version {
    fn name(&self) -> &'static str {
        "version"
    }

    fn examine(&self, _: &Patient) -> Finding {
        let kernel =
            fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_else(|_| "of unknown version".to_owned());
        let version = env!("CARGO_PKG_VERSION");
        let bus = bench_dragon_ipc::ICEORYX2_VERSION;
        Finding::ok(version, format!("bench-dragon {version}, iceoryx2 {bus}, Linux {}", kernel.trim()))
    }
}
