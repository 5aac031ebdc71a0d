//! Comparison of recorded frames with simulated ones: their bits and their due times.

use std::fmt;

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::{CommandEvent, FrameHeader, HandleState, ShowState};
use serde::{Deserialize, Serialize};

use super::RunVerdict;
use crate::recording::RecordedFrame;
use crate::source::server::schedule::Schedule;

/// Greatest difference that rounding can cause, in metres or metres per second.
const ROUNDING: f64 = 1e-6;
/// Begin of the field of a count of missed periods that differs from the frames.
const OVERRUNS: &str = "overruns of command event";

/// First difference between a recording and its simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// The tick.
    pub tick: u64,
    /// Show time of the recorded frame, in seconds.
    pub time_s: f64,
    /// The field, as the frame's message names it.
    pub field: String,
    /// Index of the handle; null where the field does not belong to a handle.
    pub handle: Option<u64>,
    /// The recorded value.
    pub recorded: Value,
    /// The simulated value.
    pub simulated: Value,
}

/// A value that differs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A finite number. Two numbers are equal where their bits are equal.
    Number(f64),
    /// Any other value, in words.
    Text(String),
}

impl Difference {
    /// Verdict with a difference between two values in words.
    pub(super) fn in_words(header: &FrameHeader, field: &str, recorded: String, simulated: String) -> RunVerdict {
        RunVerdict::Differs { difference: Self::of(header, field, None, [recorded, simulated].map(Value::Text)) }
    }

    fn of(header: &FrameHeader, field: &str, handle: Option<u64>, [recorded, simulated]: [Value; 2]) -> Self {
        let (tick, time_s) = (header.tick, header.show_time_s());
        Self { tick, time_s, field: field.to_owned(), handle, recorded, simulated }
    }

    /// Whether a count of missed periods disagrees with the frames. Periods missed before the first frame never cause that.
    pub(super) fn is_of_overruns(&self) -> bool {
        self.field.starts_with(OVERRUNS)
    }

    /// Whether rounding alone may cause the difference: by other processor instructions or another C library.
    pub fn may_be_rounding(&self) -> bool {
        match (&self.recorded, &self.simulated) {
            (Value::Number(recorded), Value::Number(simulated)) => {
                self.handle.is_some() && (recorded - simulated).abs() < ROUNDING
            }
            _ => false,
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, time_s, field, handle, recorded, simulated } = self;
        write!(formatter, "at tick {tick} ({} s of show time), ", Fixed::<6>(*time_s))?;
        if let Some(handle) = handle {
            write!(formatter, "handle {handle}, ")?;
        }
        write!(formatter, "{field} is recorded as {recorded} and simulated as {simulated}")
    }
}

impl fmt::Display for Value {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(formatter, "{number}"),
            Self::Text(text) => formatter.write_str(text),
        }
    }
}

impl Value {
    fn has_bits_of(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Number(number), Self::Number(other)) => number.to_bits() == other.to_bits(),
            _ => self == other,
        }
    }
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        if number.is_finite() {
            Self::Number(number)
        } else {
            Self::Text(format!("{number} ({:#018x})", number.to_bits()))
        }
    }
}

/// Returns the first field of a recorded frame whose bits differ from the simulated frame. `scheduled_ns` and
/// `published_ns` are not compared.
pub(super) fn difference(
    recorded: &RecordedFrame,
    header: &FrameHeader,
    handles: &[HandleState],
) -> Option<Difference> {
    let was = &recorded.header;
    let text = |value: &dyn fmt::Display| Value::Text(value.to_string());
    let fields = [
        ("state", state_text(was), state_text(header)),
        ("show_time_ns", text(&was.show_time_ns), text(&header.show_time_ns)),
        ("bench_count", text(&was.bench_count), text(&header.bench_count)),
        ("handles", text(&recorded.handles.len()), text(&handles.len())),
        ("head_travel_m", was.head_travel_m.into(), header.head_travel_m.into()),
        ("head_speed_mps", was.head_speed_mps.into(), header.head_speed_mps.into()),
        ("course_m", was.course_m.into(), header.course_m.into()),
        ("course_mps", was.course_mps.into(), header.course_mps.into()),
        ("time_scale", was.time_scale.into(), header.time_scale.into()),
    ];
    if let Some((field, was, is)) = fields.into_iter().find(|(_, was, is)| !was.has_bits_of(is)) {
        return Some(Difference::of(&recorded.header, field, None, [was, is]));
    }
    for (number, (was, is)) in was.dragons().iter().zip(header.dragons()).enumerate() {
        let fields = [
            ("travel_m", was.travel_m.into(), is.travel_m.into()),
            ("speed_mps", was.speed_mps.into(), is.speed_mps.into()),
            ("first_handle", text(&was.first_handle), text(&is.first_handle)),
            ("bench_count", text(&was.bench_count), text(&is.bench_count)),
            ("state", text(&was.state), text(&is.state)),
        ];
        if let Some((field, was, is)) = fields.into_iter().find(|(_, was, is)| !was.has_bits_of(is)) {
            return Some(Difference::of(&recorded.header, &format!("dragons[{number}].{field}"), None, [was, is]));
        }
    }
    for (index, (was, is)) in recorded.handles.iter().zip(handles).enumerate() {
        let fields =
            [("position_m", was.position_m, is.position_m), ("velocity_mps", was.velocity_mps, is.velocity_mps)];
        for (field, was, is) in fields {
            if let Some(axis) = (0..3).find(|&axis| was[axis].to_bits() != is[axis].to_bits()) {
                let field = format!("{field}[{axis}]");
                let values = [was[axis].into(), is[axis].into()];
                return Some(Difference::of(&recorded.header, &field, Some(index as u64), values));
            }
        }
    }
    None
}

fn state_text(header: &FrameHeader) -> Value {
    Value::Text(
        header.show_state().map_or_else(|| header.state.to_string(), |state: ShowState| state.name().to_owned()),
    )
}

/// Periods in which the recorded ticks were due.
#[derive(Clone, Copy, Debug)]
pub(super) struct Periods {
    rate_hz: u32,
    /// Due instant of period 0, as if no period had been missed before the first frame.
    epoch_ns: Option<u64>,
    last: Option<u64>,
    /// Periods missed before the first frame; `None` where the recording does not contain the number.
    missed_before: Option<u64>,
    missed: u64,
}

impl Periods {
    /// Creates the periods of a server with this rate, before its first frame.
    pub(super) fn at(rate_hz: u32) -> Self {
        Self { rate_hz, epoch_ns: None, last: None, missed_before: None, missed: 0 }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.last.is_none()
    }

    /// Whether it is known that no period was missed before the first frame.
    pub(super) fn are_known_from_tick_0(&self) -> bool {
        self.missed_before == Some(0)
    }

    /// Known number of missed periods so far.
    pub(super) fn overruns(&self) -> u64 {
        self.missed_before.unwrap_or(0).saturating_add(self.missed)
    }

    /// Takes a frame after `missing` lost ones. Returns the number of periods missed before it.
    pub(super) fn take(&mut self, header: &FrameHeader, missing: u64) -> Result<u64, RunVerdict> {
        let wrong = |simulated: String| {
            let recorded = header.scheduled_ns.to_string();
            Difference::in_words(header, "scheduled_ns", recorded, simulated)
        };
        let Some(last) = self.last else {
            // The first frame gets the period of its tick, so periods missed before it shift the epoch.
            let epoch_ns = Schedule::from_epoch_ns(header.tick, self.rate_hz)
                .and_then(|elapsed_ns| header.scheduled_ns.checked_sub(elapsed_ns));
            self.epoch_ns = Some(epoch_ns.ok_or_else(|| wrong("a later instant".to_owned()))?);
            self.last = Some(header.tick);
            self.missed_before = (missing == 0).then_some(0);
            return Ok(0);
        };
        let epoch_ns = self.epoch_ns.expect("known since the first frame");
        let (period, off_ns) = Schedule::nearest_period(epoch_ns, self.rate_hz, header.scheduled_ns)
            .ok_or_else(|| wrong("a later instant".to_owned()))?;
        // If the first frame's due instant is uncertain, rounding may differ by 1 ns.
        let tolerance_ns = u64::from(self.missed_before != Some(0));
        if off_ns > tolerance_ns {
            return Err(wrong(format!("a due instant (the nearest is {off_ns} ns away)")));
        }
        let missed = period.checked_sub(last).and_then(|ahead| ahead.checked_sub(missing.saturating_add(1)));
        let missed = missed.ok_or_else(|| wrong("a later due instant".to_owned()))?;
        self.last = Some(period);
        self.missed += missed;
        Ok(missed)
    }

    /// Checks that an event has the same number of missed periods as the frames show.
    pub(super) fn agree_with(&mut self, event: &CommandEvent, header: Option<&FrameHeader>) -> Result<(), RunVerdict> {
        let before = self.missed_before.or_else(|| event.overruns.checked_sub(self.missed));
        if before.is_some_and(|before| before + self.missed == event.overruns) {
            // An event before the first frame cannot confirm the number for the later frames.
            let is_behind_first = header.is_some();
            self.missed_before = if is_behind_first { before } else { self.missed_before };
            return Ok(());
        }
        let of_event = FrameHeader { tick: event.tick, show_time_ns: event.show_time_ns, ..FrameHeader::default() };
        let shown = self.overruns();
        let field = format!("{OVERRUNS} {}", event.number);
        let (recorded, simulated) = (event.overruns.to_string(), format!("{shown}, counted from the frames"));
        Err(Difference::in_words(header.unwrap_or(&of_event), &field, recorded, simulated))
    }
}
