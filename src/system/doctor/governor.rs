//! Whether the processors keep their speed: one that has slowed down makes the next tick late.

use std::collections::BTreeSet;
use std::fs;

use super::{Check, Finding, Patient};

const PROCESSORS: &str = "/sys/devices/system/cpu";

/// The governors of the processors' speed.
pub(super) struct Governor;

impl Check for Governor {
    fn name(&self) -> &'static str {
        "processor governor"
    }

    fn examine(&self, _: &Patient) -> Finding {
        judge(&governors())
    }
}

fn governors() -> BTreeSet<String> {
    let Ok(processors) = fs::read_dir(PROCESSORS) else { return BTreeSet::new() };
    let governor = |path| fs::read_to_string(path).ok();
    processors
        .flatten()
        .filter_map(|processor| governor(processor.path().join("cpufreq/scaling_governor")))
        .map(|name| name.trim().to_owned())
        .collect()
}

fn judge(governors: &BTreeSet<String>) -> Finding {
    if governors.is_empty() {
        return Finding::not_known("this system does not tell: in a virtual machine it is the host's affair");
    }
    let value = governors.iter().cloned().collect::<Vec<_>>().join(", ");
    if governors.iter().all(|governor| governor == "performance") {
        return Finding::ok(value, "the processors keep their speed");
    }
    Finding::warning(
        value.clone(),
        format!("{value}: a processor that was idle is slow at first"),
        "`cpupower frequency-set --governor performance`",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn one_that_saves_power_is_enough_for_a_warning() {
        let judged = |names: &[&str]| judge(&names.iter().map(ToString::to_string).collect()).status;
        assert_eq!(judged(&["performance"]), Verdict::Ok);
        assert_eq!(judged(&["performance", "powersave"]), Verdict::Warning);
        assert_eq!(judged(&[]), Verdict::NotKnown);
    }
}
