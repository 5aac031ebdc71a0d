//! Arguments of a bench, besides cargo's own `--bench`. An unknown argument ends the program.

use std::process;

/// Checks the arguments of a bench that takes none.
pub fn require_no_arguments() {
    if let Some(argument) = given().first() {
        refuse(&format!("argument is {argument}, this bench takes no arguments"));
    }
}

/// Number of seconds that a bench measures: the N of `--seconds N`, or `default_s`.
pub fn seconds_or(default_s: u32) -> u32 {
    let arguments = given();
    let seconds = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => Some(default_s),
        ["--seconds", seconds] => seconds.parse().ok().filter(|seconds| (1..=3_600).contains(seconds)),
        _ => None,
    };
    let allowed = "must be empty or --seconds N, with N a whole number from 1 to 3600";
    seconds.unwrap_or_else(|| refuse(&format!("arguments are {arguments:?}, {allowed}")))
}

fn given() -> Vec<String> {
    std::env::args().skip(1).filter(|argument| argument != "--bench").collect()
}

#[allow(clippy::print_stderr, reason = "a bench prints")]
fn refuse(why: &str) -> ! {
    eprintln!("{why}");
    process::exit(2)
}
