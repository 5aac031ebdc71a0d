//! The clearance so far, over show time.

/// Stretches that a run is cut into.
const BINS: usize = 480;

/// The least clearance that was seen in each stretch of a run, all equally long.
#[derive(Clone, Debug, PartialEq)]
pub struct ClearanceChart {
    start_s: f64,
    step_s: f64,
    least_m: Vec<Option<f64>>,
    revision: Vec<u64>,
    revisions: u64,
}

impl ClearanceChart {
    /// An empty chart from one show time to another, in seconds.
    pub fn new(start_s: f64, end_s: f64) -> Self {
        let step_s = ((end_s - start_s) / BINS as f64).max(f64::MIN_POSITIVE);
        Self { start_s, step_s, least_m: vec![None; BINS], revision: vec![0; BINS], revisions: 0 }
    }

    /// Takes note of a clearance at a show time; one outside the run is counted to its first or last stretch.
    pub fn note(&mut self, time_s: f64, clearance_m: f64) {
        let bin = (((time_s - self.start_s) / self.step_s) as usize).min(BINS - 1);
        if self.least_m[bin].is_none_or(|least_m| clearance_m < least_m) {
            self.least_m[bin] = Some(clearance_m);
            self.revisions += 1;
            self.revision[bin] = self.revisions;
        }
    }

    /// Show time at which the first stretch begins, in seconds.
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Length of a stretch in seconds.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// How often the chart has changed.
    pub fn revisions(&self) -> u64 {
        self.revisions
    }

    /// The least clearance of each stretch in metres; `None` where the head has not been seen.
    pub fn least_m(&self) -> &[Option<f64>] {
        &self.least_m
    }

    /// The stretches that have changed since a revision, by index, and their least clearance in metres.
    pub fn since(&self, revision: u64) -> impl Iterator<Item = (usize, f64)> {
        let bins = self.revision.iter().zip(&self.least_m).enumerate();
        bins.filter(move |(_, (changed, _))| **changed > revision)
            .filter_map(|(bin, (_, least_m))| least_m.map(|least_m| (bin, least_m)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_stretch_keeps_its_least_clearance_and_tells_what_has_changed() {
        let mut chart = ClearanceChart::new(-100.0, 100.0);
        chart.note(-100.0, 0.3);
        chart.note(-100.0, 0.2);
        let seen = chart.revisions();
        chart.note(-100.0, 0.25);
        chart.note(1e9, 0.1);
        chart.note(-1e9, 0.05);
        let changed: Vec<(usize, f64)> = chart.since(seen).collect();
        assert_eq!(changed, [(0, 0.05), (BINS - 1, 0.1)]);
        assert_eq!(chart.least_m().iter().flatten().count(), 2);
    }
}
