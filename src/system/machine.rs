//! The machine that this process runs on.

use std::fs;
use std::thread;

use serde::{Deserialize, Serialize};

/// Where the kernel reports its clock sources.
pub(crate) const CLOCKS: &str = "/sys/devices/system/clocksource/clocksource0";

/// Facts about the machine, in words. A fact that the system does not report is `None`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Machine {
    /// Name of the host.
    pub(crate) host: String,
    /// Name and release of the kernel, and the architecture of the processors.
    pub(crate) kernel: String,
    /// Number of processors that this process may use.
    pub(crate) processors: Option<usize>,
    /// Model of the first processor.
    pub(crate) processor: Option<String>,
    /// Clock source of the kernel.
    pub(crate) clock_source: Option<String>,
}

impl Machine {
    /// Reads the facts.
    pub(crate) fn read() -> Self {
        let name = rustix::system::uname();
        let words = |text: &std::ffi::CStr| text.to_string_lossy().into_owned();
        let [system, release, architecture] = [name.sysname(), name.release(), name.machine()].map(words);
        Self {
            host: words(name.nodename()),
            kernel: format!("{system} {release}, {architecture}"),
            processors: thread::available_parallelism().ok().map(usize::from),
            processor: fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| model(&text)),
            clock_source: fs::read_to_string(format!("{CLOCKS}/current_clocksource"))
                .ok()
                .map(|source| source.trim().to_owned()),
        }
    }
}

/// The model of the first processor. Some architectures do not report it.
fn model(cpuinfo: &str) -> Option<String> {
    let value = |line: &str| {
        line.split_once(':').filter(|(key, _)| key.trim() == "model name").map(|(_, value)| value.trim().to_owned())
    };
    cpuinfo.lines().find_map(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_is_that_of_the_first_processor() {
        let text = "processor\t: 0\nmodel\t\t: 85\nmodel name\t: Xeon 2.0\n\nprocessor\t: 1\nmodel name\t: other\n";
        assert_eq!(model(text).as_deref(), Some("Xeon 2.0"));
        assert_eq!(model("processor\t: 0\nBogoMIPS\t: 50\n"), None);
    }
}
