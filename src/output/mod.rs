//! Output: printing, tables, figures, reports and histograms.
//!
//! | module | contents |
//! |---|---|
//! | [`table`] | tables as text for people, as CSV, and as a workbook |
//! | [`figure`] | figures for print, as SVG, PDF and PNG |
//! | [`floor_plan`] | the floor of a show in metres, as DXF and GeoJSON |
//! | [`report`] | reports for people, as one printable HTML file |
//! | `in_plan` | dragons and stages as figures draw them |
//! | `poses` | positions and speeds of all handles, as tables |
//! | `dragon_colours()` | the colours of several dragons |
//! | `visible_box()` | the part of the plane that a picture shows |
//! | [`histogram`] | distributions of times: percentiles, bars, the text format of `HdrHistogram`'s tools |
//! | `json` | JSON on one line or indented |
//! | [`command_words`] | a command and its outcome, in words and as a line of JSON |
//! | `log` | the log on stderr |
//! | `terminal_text` | colours, and escapes for control characters in foreign text |
//! | `printing` | all output to stdout and stderr: lines, the live line, a whole screen |
//! | `queue`, `writer`, `live_line` | the bounded queue of a file, its writer thread, the line that is redrawn in place |

pub mod command_words;
mod dragon_colours;
pub mod figure;
pub mod floor_plan;
pub mod histogram;
pub(crate) mod in_plan;
pub(crate) mod json;
mod live_line;
pub(crate) mod log;
pub(crate) mod poses;
mod printing;
mod queue;
pub mod report;
pub mod table;
pub(crate) mod terminal_text;
mod visible_box;
mod workbook;
mod writer;

use std::fmt;

pub use dragon_colours::{Rgb, colours_of, dragon_colours};
pub(crate) use live_line::bar;
pub(crate) use printing::{
    Screen, finish_stderr, finish_stdout, hold_terminal, print, print_to_stderr, release_terminal, set_live_line,
    start, wait_for_reader,
};
pub(crate) use queue::Stream;
pub use visible_box::visible_box;

/// A count with its noun in singular or plural: `1 frame`, `2 frames`.
///
/// ```
/// use bench_dragon::output::Counted;
///
/// assert_eq!(Counted(1, "frame").to_string(), "1 frame");
/// assert_eq!(Counted(0, "near miss").to_string(), "0 near misses");
/// assert_eq!(Counted(2, "bench").to_string(), "2 benches");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counted(pub u64, pub &'static str);

impl fmt::Display for Counted {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(count, noun) = *self;
        let ending = match noun.as_bytes() {
            _ if count == 1 => "",
            [.., b's' | b'x'] | [.., b'c' | b's', b'h'] => "es",
            _ => "s",
        };
        write!(formatter, "{count} {noun}{ending}")
    }
}
