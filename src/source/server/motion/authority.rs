//! How far a guarded head may walk: the movement authority, as railway signalling calls it.

use bench_dragon_ipc::Refusal;

use super::Limits;

/// A stretch of travel that the guard has proved free.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    from_m: f64,
    to_m: f64,
    /// Whether the proven travel ends there for good.
    is_final: bool,
}

impl Stretch {
    fn contains(&self, travel_m: f64) -> bool {
        (self.from_m..=self.to_m).contains(&travel_m)
    }

    /// Both stretches, which overlap, as one.
    fn joined(self, other: Self) -> Self {
        let reaches = |stretch: Self, to_m: f64| stretch.is_final && stretch.to_m == to_m;
        let to_m = self.to_m.max(other.to_m);
        Self { from_m: self.from_m.min(other.from_m), to_m, is_final: reaches(self, to_m) || reaches(other, to_m) }
    }
}

/// What the guard of a run has granted.
///
/// A proof is about the run's geometry and stays true, so nothing is ever taken back: what overlaps is joined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Authority {
    run_id: u64,
    /// The stretch on which the head is.
    present: Option<Stretch>,
    /// A stretch on which it is not: where a seek was asked to.
    prepared: Option<Stretch>,
    asked_m: Option<f64>,
}

impl Authority {
    /// None yet, for a run.
    pub(super) fn none(run_id: u64) -> Self {
        Self { run_id, present: None, prepared: None, asked_m: None }
    }

    /// Travel up to which a head at `travel_m` may walk.
    pub(super) fn limit_m(&self, travel_m: f64) -> f64 {
        self.present.map_or(travel_m, |present| present.to_m)
    }

    /// Takes a grant, finite and not backwards, while the head is at `travel_m`.
    ///
    /// # Errors
    /// [`Refusal::OtherRun`].
    pub(super) fn grant(
        &mut self,
        run_id: u64,
        [from_m, to_m]: [f64; 2],
        is_final: bool,
        travel_m: f64,
    ) -> Result<(), Refusal> {
        if run_id != self.run_id {
            return Err(Refusal::OtherRun);
        }
        let stretch = Stretch { from_m, to_m, is_final };
        let slot = if stretch.contains(travel_m) { &mut self.present } else { &mut self.prepared };
        let known = slot.filter(|known| known.from_m <= to_m && from_m <= known.to_m);
        *slot = Some(known.map_or(stretch, |known| known.joined(stretch)));
        Ok(())
    }

    /// Lets the head be repositioned, where that is proved; otherwise notes where it was asked to go.
    ///
    /// # Errors
    /// [`Refusal::NotProved`].
    pub(super) fn seek(&mut self, travel_m: f64) -> Result<(), Refusal> {
        let holds = |stretch: &Option<Stretch>| stretch.is_some_and(|stretch| stretch.contains(travel_m));
        if !holds(&self.present) {
            if !holds(&self.prepared) {
                self.asked_m = Some(travel_m);
                return Err(Refusal::NotProved);
            }
            std::mem::swap(&mut self.present, &mut self.prepared);
        }
        self.asked_m = None;
        Ok(())
    }

    /// What a guard has to do with a head at `travel_m`.
    pub(super) fn limits(&self, travel_m: f64) -> Limits {
        let end_m = self.present.filter(|present| present.is_final).map(|present| present.to_m);
        Limits { granted_to_m: Some(self.limit_m(travel_m)), asked_m: self.asked_m, end_m }
    }
}
