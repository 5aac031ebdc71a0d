//! Figures for print: plans of the dragon, and what happens over time.
//!
//! A figure is plain data with a `draw`. What it draws, a [`Drawing`], becomes the bytes of a file, the same bytes each
//! time: vector graphics, or pixels at 300 dots per inch. Every figure is 160 mm wide, a page between its margins, or
//! fills a sheet of [`Paper`]. Letters are outlines, so neither the machine that draws nor the one that shows needs a
//! font. Colours are those of Okabe and Ito, which people with any kind of colour vision tell apart.
//!
//! Nothing here knows dragons, routes or the planner. Data are plain numbers: points in metres ([`glam::DVec2`]), times in
//! seconds of show time. Positions on the page are [`kurbo::Point`]s in millimetres.
//!
//! | files | what is in them |
//! |---|---|
//! | `plan_view`, `contact`, `clearance`, `speeds`, `sensitivity` | the figures |
//! | `page`, `plot`, `boards`, `notes`, `text`, `style` | their parts |
//! | `drawing`, `svg`, `png` | marks on a page, and the files that they become |

mod boards;
mod clearance;
mod contact;
mod drawing;
mod notes;
mod page;
mod plan_view;
mod plot;
mod png;
mod sensitivity;
mod speeds;
mod style;
mod svg;
mod text;

use std::path::Path;

pub use boards::DragonInPlan;
pub use clearance::{ClearanceOverTime, ContactMark, NearMissMark};
pub use contact::ContactView;
pub use drawing::{Drawing, Paper};
pub use page::{Caption, missing_letter};
pub use plan_view::{Circle, NearestPair, PlanView, TurnMarks};
pub use sensitivity::{ChartQuantity, SensitivityChart};
pub use speeds::{HandleSpeed, LargestSpeed, SpeedRange, SpeedsOverTime};

/// The kinds of file that a drawing can become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    /// Scalable Vector Graphics.
    Svg,
    /// Portable Network Graphics, 300 dots per inch.
    Png,
}

impl FigureFormat {
    /// The format that a file's suffix names, if it names one.
    ///
    /// ```
    /// use std::path::Path;
    /// use bench_dragon::output::figure::FigureFormat;
    ///
    /// assert_eq!(FigureFormat::of(Path::new("plan.svg")), Some(FigureFormat::Svg));
    /// assert_eq!(FigureFormat::of(Path::new("plan.pdf")), None);
    /// ```
    pub fn of(path: &Path) -> Option<Self> {
        let suffix = path.extension()?.to_str()?.to_ascii_lowercase();
        match suffix.as_str() {
            "svg" => Some(Self::Svg),
            "png" => Some(Self::Png),
            _ => None,
        }
    }
}
