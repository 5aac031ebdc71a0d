//! Figures for print: plans of the dragon, and plots over time.
//!
//! A figure is plain data with a method `draw`. It returns a [`Drawing`], which becomes the bytes of a file: vector graphics,
//! or pixels at 300 dots per inch. Equal figures give equal bytes. Every figure is 160 mm wide, a page between its margins, or
//! fills a sheet of [`Paper`]. Letters are outlines, so neither drawing nor viewing needs a font. The colours are those of
//! Okabe and Ito; people with any kind of colour vision can distinguish them.
//!
//! This module is independent of dragons, routes and the planner. Its data are plain numbers: points in metres
//! ([`glam::DVec2`]), times in seconds of show time. Positions on the page are [`kurbo::Point`]s in millimetres.
//!
//! | files | contents |
//! |---|---|
//! | `plan_view`, `formation`, `route`, `contact`, `clearance`, `speeds`, `profile`, `sensitivity`, `timeline`, `coordination`, `time_distance`, `sweep` | the figures |
//! | `page`, `plot`, `boards`, `stage`, `notes`, `text`, `style` | their parts |
//! | `drawing`, `svg`, `pdf`, `png` | marks on a page, and their file formats |

mod boards;
mod clearance;
mod contact;
mod coordination;
mod drawing;
mod formation;
mod notes;
mod page;
mod pdf;
mod plan_view;
mod plot;
mod png;
mod profile;
mod route;
mod sensitivity;
mod speeds;
mod stage;
mod style;
mod svg;
mod sweep;
mod text;
mod time_distance;
mod timeline;

use std::path::Path;

pub use boards::DragonInPlan;
pub use clearance::{ClearanceOverTime, ContactMark, NearMissMark};
pub use contact::ContactView;
pub use coordination::CoordinationDiagram;
pub use drawing::{Drawing, Paper, pages_of};
pub use formation::{FormationView, NamedInPlan};
pub use page::{Caption, missing_letter};
pub use plan_view::{Circle, NearestPair, PlanView, TurnMarks};
pub use profile::{SpeedLine, SpeedProfile};
pub use route::RouteView;
pub use sensitivity::{ChartQuantity, SensitivityChart};
pub use speeds::{HandleSpeed, LargestSpeed, SpeedRange, SpeedsOverTime};
pub use stage::StageInPlan;
pub use sweep::SweepView;
pub use time_distance::{DragonLine, PassingMark, TimeDistanceChart};
pub use timeline::{ShowTimeline, StateLook, StateSpan};

/// File formats of a drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    /// Scalable Vector Graphics.
    Svg,
    /// Portable Document Format.
    Pdf,
    /// Portable Network Graphics, 300 dots per inch.
    Png,
}

impl FigureFormat {
    /// Returns the format for the suffix of a file; `None` for another suffix.
    ///
    /// ```
    /// use std::path::Path;
    /// use bench_dragon::output::figure::FigureFormat;
    ///
    /// assert_eq!(FigureFormat::of(Path::new("plan.svg")), Some(FigureFormat::Svg));
    /// assert_eq!(FigureFormat::of(Path::new("plan.tif")), None);
    /// ```
    pub fn of(path: &Path) -> Option<Self> {
        let suffix = path.extension()?.to_str()?.to_ascii_lowercase();
        match suffix.as_str() {
            "svg" => Some(Self::Svg),
            "pdf" => Some(Self::Pdf),
            "png" => Some(Self::Png),
            _ => None,
        }
    }
}
