//! What the kernel reads the time from: every tick reads it, and from some sources that is a slow access to a device.

use std::fs;

use super::{Check, Finding, Patient};

const FOLDER: &str = "/sys/devices/system/clocksource/clocksource0";
/// Sources behind which there is a device.
const SLOW: [&str; 4] = ["hpet", "acpi_pm", "jiffies", "refined-jiffies"];

/// The clock source.
pub(super) struct ClockSource;

impl Check for ClockSource {
    fn name(&self) -> &'static str {
        "clock source"
    }

    fn examine(&self, _: &Patient) -> Finding {
        let read = |name: &str| fs::read_to_string(format!("{FOLDER}/{name}")).unwrap_or_default();
        judge(read("current_clocksource").trim(), read("available_clocksource").trim())
    }
}

fn judge(current: &str, available: &str) -> Finding {
    if current.is_empty() {
        return Finding::not_known("this system does not tell");
    }
    if !SLOW.contains(&current) {
        return Finding::ok(current, format!("{current} is quick to read"));
    }
    let message = format!("{current} is slow to read; available are {available}");
    let remedy = match available.split_whitespace().find(|source| !SLOW.contains(source)) {
        Some(better) => format!("`echo {better} > {FOLDER}/current_clocksource`, or boot with clocksource={better}"),
        None => "boot with tsc=reliable, where the processor's counter can be relied upon".to_owned(),
    };
    Finding::warning(current, message, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn a_slow_source_is_to_be_changed_for_one_that_is_there() {
        let finding = judge("hpet", "tsc hpet acpi_pm");
        assert_eq!(finding.status, Verdict::Warning);
        assert!(finding.remedy.is_some_and(|remedy| remedy.contains("clocksource=tsc")));
        assert_eq!(judge("kvm-clock", "kvm-clock tsc").status, Verdict::Ok);
        assert_eq!(judge("", "").status, Verdict::NotKnown);
    }
}
