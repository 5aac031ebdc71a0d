//! Gaps of a recording: frames of its runs that no part contains.

use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
};

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::FrameHeader;
use serde::{Deserialize, Serialize};

/// Greatest number of gaps that are kept; further ones are only counted.
const MOST_GAPS: usize = 1000;

/// Consecutive frames of a run that no part contains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// The run.
    pub run_id: u64,
    /// First missing tick.
    pub from_tick: u64,
    /// Last missing tick.
    pub to_tick: u64,
    /// Number of missing frames.
    pub frames: u64,
    /// Show time of the last frame before the gap in seconds; null at the begin of the run.
    pub from_s: Option<f64>,
    /// Show time of the first frame after the gap in seconds; null at the end of the run.
    pub to_s: Option<f64>,
    /// Wall time between these two frames in seconds; null at the begin and at the end of the run.
    pub wall_s: Option<f64>,
    /// The part with the frame before the gap; null at the begin of the run.
    pub after: Option<PathBuf>,
    /// The part with the frame after the gap; null at the end of the run.
    pub before: Option<PathBuf>,
}

impl fmt::Display for Gap {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { run_id, from_tick, to_tick, frames, from_s, to_s, wall_s, after, before } = self;
        let plural = if *frames == 1 { "frame is" } else { "frames are" };
        write!(formatter, "gap: {frames} {plural} missing, ticks {from_tick} to {to_tick} of run {run_id}")?;
        match (from_s, to_s) {
            (Some(from_s), Some(to_s)) => {
                write!(formatter, ", show time {} to {} s", Fixed::<3>(*from_s), Fixed::<3>(*to_s))?;
            }
            (None, Some(to_s)) => write!(formatter, ", from its begin to show time {} s", Fixed::<3>(*to_s))?,
            (Some(from_s), None) => write!(formatter, ", from show time {} s to its end", Fixed::<3>(*from_s))?,
            (None, None) => {}
        }
        if let Some(wall_s) = wall_s {
            write!(formatter, ", {wall_s:.1} s of wall time")?;
        }
        let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().escape_debug().to_string();
        match (after, before) {
            (Some(after), Some(before)) if after == before => write!(formatter, "; in {}", name(after)),
            (Some(after), Some(before)) => write!(formatter, "; between {} and {}", name(after), name(before)),
            (Some(part), None) => write!(formatter, "; after {}", name(part)),
            (None, Some(part)) => write!(formatter, "; before {}", name(part)),
            (None, None) => Ok(()),
        }
    }
}

/// The frames of a recording and those that it lacks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Number of parts with frames.
    pub parts: u64,
    /// Frames in the parts. A frame that several parts contain counts once.
    pub recorded: u64,
    /// Frames that a later part contains once more. Readers skip them.
    pub repeated: u64,
    /// Frames that the gaps lack.
    pub missing: u64,
    /// The gaps, at most 1000, in the recorded order.
    pub gaps: Vec<Gap>,
    /// Frames that the show has published, by its summary; null without one.
    pub published: Option<u64>,
}

impl Coverage {
    /// Published frames that neither a part nor a gap accounts for, such as those after the end of the last recorder.
    pub fn unplaced(&self) -> u64 {
        self.published.unwrap_or(0).saturating_sub(self.recorded + self.missing)
    }

    /// All frames that are known to be missing.
    pub fn lacking(&self) -> u64 {
        self.missing + self.unplaced()
    }

    fn add(&mut self, gap: Gap) {
        self.missing = self.missing.saturating_add(gap.frames);
        if self.gaps.len() < MOST_GAPS {
            self.gaps.push(gap);
        }
    }
}

/// Takes the frames of all parts, finds repeated ones, and notes the gaps.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameTrail {
    coverage: Coverage,
    runs: BTreeMap<u64, RunTrail>,
    last_part: Option<usize>,
    /// Whether the frames are taken from somewhere in the middle: then the first frame is preceded by no gap.
    is_excerpt: bool,
}

#[derive(Clone, Copy, Debug)]
struct RunTrail {
    first_tick: u64,
    last: FrameHeader,
    /// Part of the last frame.
    part: usize,
    /// Tick of the run's recorded end.
    end_tick: Option<u64>,
}

impl FrameTrail {
    /// A trail that begins with any frame of a run.
    pub(super) fn of_excerpt() -> Self {
        Self { is_excerpt: true, ..Self::default() }
    }

    /// Takes the next frame of a part. Returns whether it is new: not in an earlier part.
    pub(super) fn take(&mut self, header: &FrameHeader, part: usize, parts: &[PathBuf]) -> bool {
        let FrameHeader { run_id, tick, .. } = *header;
        let known = self.runs.get(&run_id).copied();
        let is_repeated = known.is_some_and(|run| run.part != part && (run.first_tick..=run.last.tick).contains(&tick));
        if is_repeated {
            self.coverage.repeated += 1;
            return false;
        }
        let expected = known.map_or(0, |run| run.last.tick + 1);
        if tick > expected && (known.is_some() || !self.is_excerpt) {
            self.coverage.add(gap_before(
                header,
                expected,
                &parts[part],
                known.map(|run| (run.last, &*parts[run.part])),
            ));
        }
        self.is_excerpt = false;
        self.coverage.recorded += 1;
        if self.last_part.replace(part) != Some(part) {
            self.coverage.parts += 1;
        }
        let (first_tick, end_tick) = known.map_or((tick, None), |run| (run.first_tick, run.end_tick));
        self.runs.insert(run_id, RunTrail { first_tick, last: *header, part, end_tick });
        true
    }

    /// Takes the recorded end of a run.
    pub(super) fn end(&mut self, run_id: u64, tick: u64) {
        if let Some(run) = self.runs.get_mut(&run_id) {
            run.end_tick = Some(tick);
        }
    }

    /// The frames and the gaps so far, with gaps at the ends of runs.
    pub(super) fn coverage(&self, parts: &[PathBuf]) -> Coverage {
        let mut coverage = self.coverage.clone();
        for (&run_id, RunTrail { last, part, end_tick, .. }) in &self.runs {
            let Some(end_tick) = end_tick.filter(|&end_tick| end_tick > last.tick) else { continue };
            coverage.add(Gap {
                run_id,
                from_tick: last.tick + 1,
                to_tick: end_tick,
                frames: end_tick - last.tick,
                from_s: Some(last.show_time_s()),
                to_s: None,
                wall_s: None,
                after: Some(parts[*part].clone()),
                before: None,
            });
        }
        coverage
    }
}

fn gap_before(header: &FrameHeader, from_tick: u64, part: &Path, before: Option<(FrameHeader, &Path)>) -> Gap {
    let wall_s = |last: FrameHeader| header.scheduled_ns.saturating_sub(last.scheduled_ns) as f64 / 1e9;
    Gap {
        run_id: header.run_id,
        from_tick,
        to_tick: header.tick - 1,
        frames: header.tick - from_tick,
        from_s: before.map(|(last, _)| last.show_time_s()),
        to_s: Some(header.show_time_s()),
        wall_s: before.map(|(last, _)| wall_s(last)),
        after: before.map(|(_, part)| part.to_owned()),
        before: Some(part.to_owned()),
    }
}
