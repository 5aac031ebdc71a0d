//! Checks of the machine: versions, the speed and the idle states of the processors, the clock and the timers.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use rustix::time::{ClockId, clock_getres};

use super::{Finding, Target};
use crate::system::machine::CLOCKS;

const PROCESSORS: &str = "/sys/devices/system/cpu";
/// Slow clock sources: devices, or counters of kernel ticks.
const SLOW_CLOCKS: [&str; 4] = ["hpet", "acpi_pm", "jiffies", "refined-jiffies"];
/// Coarsest resolution of a timer, in nanoseconds, that does not make ticks late.
const COARSEST_NS: i64 = 1_000;

/// The versions of this program and of the kernel.
pub(super) fn version(_: &Target) -> Finding {
    let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_else(|_| "of unknown version".to_owned());
    let version = env!("CARGO_PKG_VERSION");
    let bus = bench_dragon_ipc::ICEORYX2_VERSION;
    Finding::ok(version, format!("bench-dragon {version}, iceoryx2 {bus}, Linux {}", kernel.trim()))
}

/// Whether the processors keep their speed. A processor that has slowed down makes the next tick late.
pub(super) fn governor(_: &Target) -> Finding {
    judge_governors(&governors())
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

fn judge_governors(governors: &BTreeSet<String>) -> Finding {
    if governors.is_empty() {
        return Finding::not_known("this system does not report it; in a virtual machine the host controls it");
    }
    let value = governors.iter().cloned().collect::<Vec<_>>().join(", ");
    if governors.iter().all(|governor| governor == "performance") {
        return Finding::ok(value, "the processors keep their speed");
    }
    Finding::warning(
        value.clone(),
        format!("{value}: after idling, a processor is slow at first"),
        "`cpupower frequency-set --governor performance`",
    )
}

/// Exit latencies of idle states over this share of a frame's period are a warning.
const IDLE_SHARE: f64 = 0.1;

/// The driver of a virtual machine, whose idle state is a halt that its host handles.
const HOST_DRIVER: &str = "haltpoll";

/// How deep an idle processor sleeps: how long the kernel expects it to take until it runs again.
pub(super) fn idle_states(target: &Target) -> Finding {
    let driver = fs::read_to_string(format!("{PROCESSORS}/cpuidle/current_driver")).unwrap_or_default();
    judge_idle(driver.trim(), deepest_idle(), target.config.tables().serve.rate_hz)
}

/// The idle state with the longest exit latency, in microseconds, that no processor has disabled.
fn deepest_idle() -> Option<(u64, String)> {
    let states = |processor: PathBuf| fs::read_dir(processor.join("cpuidle")).into_iter().flatten().flatten();
    let read = |state: &Path, name: &str| fs::read_to_string(state.join(name)).ok().map(|text| text.trim().to_owned());
    let latency = |state: PathBuf| {
        let is_disabled = read(&state, "disable").is_some_and(|disable| disable != "0");
        let latency_us = read(&state, "latency")?.parse().ok()?;
        (!is_disabled).then_some((latency_us, read(&state, "name")?))
    };
    let processors = fs::read_dir(PROCESSORS).ok()?.flatten().map(|processor| processor.path());
    processors.flat_map(states).filter_map(|state| latency(state.path())).max()
}

fn judge_idle(driver: &str, deepest: Option<(u64, String)>, rate_hz: u32) -> Finding {
    if driver == HOST_DRIVER {
        return Finding::not_known(
            "an idle processor goes to the host, which does not report how deep it lets it sleep",
        );
    }
    let Some((latency_us, name)) = deepest else {
        return Finding::not_known("this system does not report it; in a virtual machine the host controls it");
    };
    let value = format!("{latency_us} \u{b5}s");
    let message = format!("from the deepest idle state, {name}, a processor returns within {value}");
    if latency_us as f64 * f64::from(rate_hz) > IDLE_SHARE * 1e6 {
        let limit_us = (IDLE_SHARE * 1e6 / f64::from(rate_hz)) as u64;
        let remedy = format!("`cpupower idle-set --disable-by-latency {limit_us}`");
        return Finding::warning(value, format!("{message}, over a tenth of a frame's period"), remedy);
    }
    Finding::ok(value, message)
}

/// The clock source of the kernel. Every tick reads it, and some sources are slow to read.
pub(super) fn clock_source(_: &Target) -> Finding {
    let read = |name: &str| fs::read_to_string(format!("{CLOCKS}/{name}")).unwrap_or_default();
    judge_clock_source(read("current_clocksource").trim(), read("available_clocksource").trim())
}

fn judge_clock_source(current: &str, available: &str) -> Finding {
    if current.is_empty() {
        return Finding::not_known("this system does not report it");
    }
    if !SLOW_CLOCKS.contains(&current) {
        return Finding::ok(current, format!("{current} is fast to read"));
    }
    let message = format!("{current} is slow to read; available are {available}");
    let remedy = match available.split_whitespace().find(|source| !SLOW_CLOCKS.contains(source)) {
        Some(better) => format!("`echo {better} > {CLOCKS}/current_clocksource`, or boot with clocksource={better}"),
        None => "boot with tsc=reliable, if the processor's counter is reliable".to_owned(),
    };
    Finding::warning(current, message, remedy)
}

/// Whether a sleep can end between two ticks of the kernel.
pub(super) fn timers(_: &Target) -> Finding {
    let resolution = clock_getres(ClockId::Monotonic);
    judge_timers(resolution.tv_sec * 1_000_000_000 + resolution.tv_nsec)
}

fn judge_timers(resolution_ns: i64) -> Finding {
    let value = format!("{resolution_ns} ns");
    if resolution_ns > COARSEST_NS {
        return Finding::problem(
            value,
            format!("sleeps end at multiples of {resolution_ns} ns"),
            "boot without highres=off, or use a kernel that is built with CONFIG_HIGH_RES_TIMERS",
        );
    }
    Finding::ok(value, "sleeps end on time")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::doctor::finding::Verdict;

    #[test]
    fn one_processor_that_saves_power_is_a_warning() {
        let judged = |names: &[&str]| judge_governors(&names.iter().map(ToString::to_string).collect()).status;
        assert_eq!(judged(&["performance"]), Verdict::Ok);
        assert_eq!(judged(&["performance", "powersave"]), Verdict::Warning);
        assert_eq!(judged(&[]), Verdict::NotKnown);
    }

    #[test]
    fn an_idle_state_that_takes_a_tenth_of_a_period_to_leave_is_a_warning() {
        let judged = |latency_us, rate_hz| judge_idle("intel_idle", Some((latency_us, "C6".to_owned())), rate_hz);
        assert_eq!(judged(100, 1000).status, Verdict::Ok);
        let deep = judged(133, 1000);
        assert_eq!((deep.status, deep.value.as_str()), (Verdict::Warning, "133 \u{b5}s"));
        assert_eq!(deep.remedy.as_deref(), Some("`cpupower idle-set --disable-by-latency 100`"));
        assert_eq!(judged(133, 60).status, Verdict::Ok);
        assert_eq!(judge_idle("none", None, 1000).status, Verdict::NotKnown);
        let halts = Some((1, "haltpoll idle".to_owned()));
        assert_eq!(judge_idle("haltpoll", halts, 1000).status, Verdict::NotKnown);
    }

    #[test]
    fn the_remedy_for_a_slow_clock_source_is_an_available_one() {
        let finding = judge_clock_source("hpet", "tsc hpet acpi_pm");
        assert_eq!(finding.status, Verdict::Warning);
        assert!(finding.remedy.is_some_and(|remedy| remedy.contains("clocksource=tsc")));
        assert_eq!(judge_clock_source("kvm-clock", "kvm-clock tsc").status, Verdict::Ok);
        assert_eq!(judge_clock_source("", "").status, Verdict::NotKnown);
    }

    #[test]
    fn timers_as_coarse_as_a_kernel_tick_are_a_problem() {
        assert_eq!(judge_timers(4_000_000).status, Verdict::Problem);
        assert_eq!(judge_timers(1).status, Verdict::Ok);
    }
}
