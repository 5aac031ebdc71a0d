//! Alerts: events that a monitor detects.

use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use super::wire_enum::wire_enum;

/// One event, on the `bench-dragon/alerts` service.
///
/// A monitor sends at most 200 alerts of benches at once and 100 a second, measured by the frames' own clock. Beyond that,
/// contacts have priority, then partings, then boards at borders of the stage, then the nearest pairs. The monitor's summary counts
/// the alerts that were not sent. These are always sent: the first contact of a run, every fault, and every alert without a
/// bench.
///
/// 72 bytes, no padding. Use [`Alert::alert_kind`], [`Alert::pair`], [`Alert::bench`] and [`Alert::forecast`] to read the coded
/// fields.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.Alert.v1")]
pub struct Alert {
    /// Run in which it happened.
    pub run_id: u64,
    /// First tick at which the event held.
    pub tick: u64,
    /// Show time of the event in nanoseconds: exact for pairs that touch or part and boards at borders of the stage, if the head
    /// walked; the frame's show time for the other kinds.
    pub show_time_ns: i64,
    /// Show time of the forecast contact in nanoseconds, or [`Alert::NO_FORECAST`].
    pub forecast_ns: i64,
    /// Clearance of the two benches in metres, negative where they overlap. For one bench: distance of its board from the border of the
    /// stage, 0 beyond it. 0 for an alert without benches.
    pub clearance_m: f64,
    /// Point midway between the nearest points of the two boards, in metres. For one bench: a point of its board beyond the border of the
    /// stage, or nearest to it, or of the border in the board. 0 for an alert without benches.
    pub point_m: [f64; 2],
    /// An [`AlertKind`] as its number.
    pub kind: u32,
    /// The lower bench index, the only one, or [`Alert::NO_BENCH`].
    pub bench_a: u32,
    /// The higher bench index, or [`Alert::NO_BENCH`].
    pub bench_b: u32,
    /// Always 0.
    pub reserved: u32,
}

const _: () = assert!(size_of::<Alert>() == 72 && align_of::<Alert>() == 8);

impl Alert {
    /// Sentinel of `forecast_ns` for *no forecast*: no contact lies ahead, or none is known yet.
    pub const NO_FORECAST: i64 = i64::MIN;
    /// Sentinel of `bench_a` and `bench_b` for *no bench*.
    pub const NO_BENCH: u32 = u32::MAX;

    /// The kind, or `None` for a number that this version does not support.
    pub fn alert_kind(&self) -> Option<AlertKind> {
        AlertKind::from_wire(self.kind)
    }

    /// The two benches, the lower index first; `None` for an alert without a pair.
    pub fn pair(&self) -> Option<[u32; 2]> {
        (self.bench_b != Self::NO_BENCH).then_some([self.bench_a, self.bench_b])
    }

    /// The bench of an alert about one bench; `None` for any other.
    pub fn bench(&self) -> Option<u32> {
        (self.bench_a != Self::NO_BENCH && self.bench_b == Self::NO_BENCH).then_some(self.bench_a)
    }

    /// Show time of the forecast contact in seconds; `None` where no contact lies ahead, or none is known yet.
    pub fn forecast(&self) -> Option<f64> {
        (self.forecast_ns != Self::NO_FORECAST).then_some(self.forecast_ns as f64 * 1e-9)
    }
}

wire_enum! {
    /// Kind of an alert.
    #[derive(Eq, Hash)]
    AlertKind {
        /// Two benches came nearer than the configured `near_m`.
        Near = 0, "near";
        /// Two benches touched.
        Contact = 1, "contact";
        /// Two benches that had touched are apart again.
        Parted = 2, "parted";
        /// The show is held.
        Held = 3, "held";
        /// The frames do not agree with the published description.
        Fault = 4, "fault";
        /// The source of the frames was restarted.
        Restarted = 5, "restarted";
        /// A board left the outline of the stage, while the bench before it is inside.
        Outside = 6, "outside";
        /// A board that was outside is inside the outline of the stage, and so is the bench behind it.
        Inside = 7, "inside";
        /// A board entered an area to keep out of, while the bench before it is not in one.
        KeepOut = 8, "keep_out";
        /// A board came nearer to a border of the stage than the configured `clear_m`, while the bench before it is clear. The line of
        /// the crowd counts without a `clear_m` too.
        TooNear = 9, "too_near";
        /// A board is clear again of an area or a border, and so is the bench behind it.
        Clear = 10, "clear";
    }
}

/// Urgency of an alert: its colour, and whether a screen reader interrupts for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Severity {
    /// The benches touch, or nothing keeps them apart.
    Danger,
    /// The benches or the stage come near to trouble.
    Caution,
    /// It is over, or no trouble.
    Calm,
}

impl AlertKind {
    /// The urgency of alerts of this kind.
    pub fn severity(self) -> Severity {
        match self {
            Self::Contact | Self::Held | Self::Fault | Self::KeepOut => Severity::Danger,
            Self::Near | Self::Outside | Self::TooNear => Severity::Caution,
            Self::Parted | Self::Restarted | Self::Inside | Self::Clear => Severity::Calm,
        }
    }

    /// Whether the alert is about one bench, instead of a pair or none.
    pub fn is_of_one_bench(self) -> bool {
        matches!(self, Self::Outside | Self::Inside | Self::KeepOut | Self::TooNear | Self::Clear)
    }

    /// All kinds, the most urgent first.
    pub fn by_severity() -> impl Iterator<Item = Self> {
        let of = |severity| Self::ALL.into_iter().filter(move |kind| kind.severity() == severity);
        [Severity::Danger, Severity::Caution, Severity::Calm].into_iter().flat_map(of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alert_names_a_pair_one_bench_or_none() {
        let alert = |bench_a, bench_b| Alert {
            run_id: 1,
            tick: 0,
            show_time_ns: 0,
            forecast_ns: Alert::NO_FORECAST,
            clearance_m: 0.0,
            point_m: [0.0; 2],
            kind: AlertKind::Outside.to_wire(),
            bench_a,
            bench_b,
            reserved: 0,
        };
        let [pair, one, none] = [alert(0, 8), alert(3, Alert::NO_BENCH), alert(Alert::NO_BENCH, Alert::NO_BENCH)];
        assert_eq!([pair, one, none].map(|alert| alert.pair()), [Some([0, 8]), None, None]);
        assert_eq!([pair, one, none].map(|alert| alert.bench()), [None, Some(3), None]);
    }
}
