//! Values of a report in words.

use bench_dragon_geometry::number::Fixed;
use jiff::Zoned;

use crate::cli::show::course::CourseReport;
use crate::output::Counted;

/// The holders of the dragon, each once, in the order of the first hold.
pub(super) fn holders(course: &CourseReport) -> String {
    let mut names: Vec<&str> = Vec::new();
    for hold in &course.holds {
        if !names.contains(&&*hold.by) {
            names.push(&hold.by);
        }
    }
    names.join(", ")
}

/// The number of alerts of each kind.
pub(super) fn counts_words(course: &CourseReport) -> String {
    let words: Vec<String> = course.alert_counts.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    words.join(", ")
}

pub(super) fn left_out(count: u64, noun: &'static str, more: &str) -> Option<String> {
    (count > 0).then(|| format!("{} not shown{more}.", Counted(count, noun)))
}

pub(super) fn sender(name: &str, pid: Option<u32>) -> String {
    pid.map_or_else(|| name.to_owned(), |pid| format!("{name} (process {pid})"))
}

pub(super) fn millimetres(clearance_m: f64) -> String {
    format!("{} mm", Fixed::<1>(1000.0 * clearance_m))
}

pub(super) fn clock(time: &Zoned) -> String {
    time.strftime("%H:%M:%S").to_string()
}

pub(super) fn seconds_of_day(time: &Zoned) -> f64 {
    let [hours, minutes, seconds] = [time.hour(), time.minute(), time.second()].map(f64::from);
    3600.0 * hours + 60.0 * minutes + seconds + f64::from(time.subsec_nanosecond()) * 1e-9
}

/// A duration in the two largest units that it needs.
pub(super) fn duration(seconds: f64) -> String {
    if seconds < 60.0 {
        return format!("{:.1} s", seconds.max(0.0));
    }
    let whole = seconds.round() as u64;
    let (hours, minutes, rest) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 { format!("{hours} h {minutes:02} min") } else { format!("{minutes} min {rest:02} s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_has_its_largest_units() {
        let words = [-1.0, 0.25, 59.94, 60.0, 3599.4, 7260.0, 90_000.0].map(duration);
        assert_eq!(words, ["0.0 s", "0.2 s", "59.9 s", "1 min 00 s", "59 min 59 s", "2 h 01 min", "25 h 00 min"]);
    }
}
