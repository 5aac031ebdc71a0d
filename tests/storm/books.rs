//! The storm's records: the kills by role and phase, and the warnings of the processes.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Instant;

/// The phase of a process at its kill.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Phase {
    /// Before any progress of the process.
    Starting,
    Playing,
}

/// The events so far.
#[derive(Debug)]
pub(crate) struct Books {
    begun: Instant,
    kills: BTreeMap<&'static str, [u32; 2]>,
    /// Number of each warning, without the numbers in its text.
    complaints: BTreeMap<String, u32>,
    pub(crate) half_made: u32,
    pub(crate) recordings: u32,
    pub(crate) recorded: u64,
}

impl Books {
    pub(crate) fn new() -> Self {
        Self {
            begun: Instant::now(),
            kills: BTreeMap::new(),
            complaints: BTreeMap::new(),
            half_made: 0,
            recordings: 0,
            recorded: 0,
        }
    }

    pub(crate) fn kill(&mut self, name: &'static str, phase: Phase) {
        self.kills.entry(name).or_default()[phase as usize] += 1;
    }

    pub(crate) fn kills(&self) -> u32 {
        self.kills.values().flatten().sum()
    }

    /// Counts the warnings of a process.
    pub(crate) fn complain(&mut self, complaints: &[String]) {
        for complaint in complaints {
            self.half_made += u32::from(complaint.contains("incomplete service file"));
            *self.complaints.entry(without_names(complaint)).or_default() += 1;
        }
    }
}

/// Returns a warning without the parts that differ between processes: numbers, hashes and paths.
fn without_names(complaint: &str) -> String {
    let is_name = |word: &str| word.contains('/') || word.chars().filter(char::is_ascii_digit).count() > 2;
    let words: Vec<&str> = complaint.split(' ').map(|word| if is_name(word) { "…" } else { word }).collect();
    words.join(" ").chars().take(160).collect()
}

impl fmt::Display for Books {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "{:<16}{:>10}{:>10}", "killed", "starting", "playing")?;
        for (name, [starting, playing]) in &self.kills {
            writeln!(formatter, "{name:<16}{starting:>10}{playing:>10}")?;
        }
        let Self { half_made, recordings, recorded, .. } = self;
        writeln!(formatter, "half-made services met and removed: {half_made}")?;
        writeln!(formatter, "recordings finished and read: {recordings}, with {recorded} frames")?;
        writeln!(formatter, "complaints:")?;
        for (complaint, times) in &self.complaints {
            writeln!(formatter, "{times:>6} × {complaint}")?;
        }
        write!(formatter, "{} kills in {:.1} s", self.kills(), self.begun.elapsed().as_secs_f64())
    }
}
