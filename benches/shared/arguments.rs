//! What a bench is called with.

use std::process;

/// Ends the program where it was called with an argument beside cargo's own.
#[allow(clippy::print_stderr, reason = "a bench prints")]
pub fn require_no_arguments() {
    if let Some(argument) = std::env::args().skip(1).find(|argument| argument != "--bench") {
        eprintln!("{argument} is no argument of this bench, which takes none");
        process::exit(2);
    }
}
