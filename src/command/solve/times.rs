//! The times of a question: a list, or even steps.

use std::ops::RangeInclusive;

use bench_dragon_geometry::number::Number;

use crate::cli::TimesArgs;
use crate::command::BadInput;

/// Most positions of handles in one answer: a workbook of them takes some 600 MB while it is made, and 20 MB on the disk.
pub(super) const MAX_POSITIONS: usize = 1_000_000;

/// The times asked for, in seconds. They must lie in `run_s` and be `most` at most.
///
/// Steps are counted in whole nanoseconds, so each time is the `f64` nearest to the decimal that it stands for.
pub(super) fn times_s(args: &TimesArgs, run_s: &RangeInclusive<f64>, most: usize) -> Result<Vec<f64>, BadInput> {
    let (Some(from_ns), Some(to_ns)) = (args.from, args.to) else {
        args.at.iter().try_for_each(|&at_s| require_within("--at", at_s, run_s))?;
        return match args.at.len() {
            count if count <= most => Ok(args.at.clone()),
            count => Err(BadInput(format!("--at has {count} times, must be at most {most}"))),
        };
    };
    let (from_s, to_s) = (seconds(from_ns), seconds(to_ns));
    require_within("--from", from_s, run_s)?;
    require_within("--to", to_s, run_s)?;
    if to_ns < from_ns {
        return Err(BadInput(format!("--to is {to_s}, must be at least --from, which is {from_s}")));
    }
    let steps = (to_ns - from_ns) / args.step;
    if steps >= most as i64 {
        let step_s = seconds(args.step);
        return Err(BadInput(format!(
            "--step is {step_s}, which makes {} times from {from_s} to {to_s}, must make at most {most}: try --step {}",
            steps + 1,
            coarser_step_s(to_s - from_s, most)
        )));
    }
    Ok((0..=steps).map(|step| seconds(from_ns + step * args.step)).collect())
}

/// A step that makes at most so many times of a span: 1, 2 or 5 times a power of ten, in seconds.
pub(super) fn coarser_step_s(span_s: f64, most: usize) -> f64 {
    // One time fewer, as the span's end may be one more.
    let least_s = span_s / most.saturating_sub(1).max(1) as f64;
    let exponent = least_s.log10().floor() as i32;
    let nice = (exponent..=exponent + 1).flat_map(|exponent| {
        // Written out, so that it is the nearest number to the decimal.
        [1, 2, 5].map(|digit| format!("{digit}e{exponent}").parse::<f64>().expect("a decimal is a number"))
    });
    nice.into_iter().find(|step_s| *step_s > least_s).expect("ten times the power is more")
}

fn require_within(flag: &str, time_s: f64, run_s: &RangeInclusive<f64>) -> Result<(), BadInput> {
    if run_s.contains(&time_s) {
        return Ok(());
    }
    let (start_s, end_s) = (run_s.start(), run_s.end());
    Err(BadInput(format!("{flag} is {}, must be from {start_s} to {end_s}, where the run ends", Number(time_s))))
}

/// The `f64` nearest to a number of nanoseconds in seconds: both operands are exact, and a quotient is rounded once.
fn seconds(time_ns: i64) -> f64 {
    time_ns as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_is_proposed_is_round_and_coarse_enough_and_not_ten_times_too_coarse() {
        for span_s in [1e-3, 0.9, 1.0, 412.473_838, 9.99e5, 3e8] {
            for most in [2, 17, 1000, 1_000_000] {
                let step_s = coarser_step_s(span_s, most);
                assert!((span_s / step_s).floor() + 2.0 <= most as f64 + 1.0, "{span_s} s: {step_s}");
                assert!(span_s / step_s >= 0.19 * (most - 1) as f64, "{span_s} s: {step_s}");
                let digits = format!("{step_s:e}");
                assert!(["1e", "2e", "5e"].iter().any(|start| digits.starts_with(start)), "{digits}");
            }
        }
    }

    fn steps(from: i64, to: i64, step: i64, most: usize) -> Result<Vec<f64>, BadInput> {
        let args = TimesArgs { at: Vec::new(), from: Some(from), to: Some(to), step };
        times_s(&args, &(0.0..=432.5), most)
    }

    #[test]
    fn a_second_each_makes_301_times_of_300_seconds() {
        let times = steps(0, 300_000_000_000, 1_000_000_000, 301).expect("all lie in the run");
        assert_eq!(times, (0..=300).map(f64::from).collect::<Vec<_>>());
    }

    #[test]
    fn every_step_is_the_number_nearest_to_its_decimal() {
        let times = steps(0, 432_500_000_000, 100_000_000, 5_000).expect("all lie in the run");
        assert_eq!(times.len(), 4326);
        for (step, time_s) in times.iter().enumerate() {
            let decimal = format!("{}.{}", step / 10, step % 10);
            assert_eq!(Ok(*time_s), decimal.parse(), "step {step}");
        }
    }

    #[test]
    fn steps_that_do_not_meet_the_end_stop_before_it() {
        assert_eq!(steps(0, 1_000_000_000, 400_000_000, 9).expect("all lie in the run"), [0.0, 0.4, 0.8]);
        assert_eq!(steps(5_000_000_000, 5_000_000_000, 1, 1).expect("one time"), [5.0]);
    }

    #[test]
    fn what_does_not_go_together_is_told_in_one_line() {
        for (result, message) in [
            (steps(2_000_000_000, 1_000_000_000, 1, 9), "--to is 1, must be at least --from, which is 2"),
            (steps(-1, 1, 1, 9), "--from is -1e-9, must be from 0 to 432.5, where the run ends"),
            (steps(0, 433_000_000_000, 1, 9), "--to is 433, must be from 0 to 432.5, where the run ends"),
            (
                steps(0, 300_000_000_000, 10_000_000, 4464),
                "--step is 0.01, which makes 30001 times from 0 to 300, must make at most 4464: try --step 0.1",
            ),
        ] {
            assert_eq!(result.expect_err(message).to_string(), message);
        }
    }
}
