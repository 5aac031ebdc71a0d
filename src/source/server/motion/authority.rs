//! Movement authority of a guarded head: how far it may walk. The term is from railway signalling.

use bench_dragon_ipc::Refusal;

use super::Limits;

/// An interval of travel that the guard has proved free of contact.
#[derive(Clone, Copy, Debug, PartialEq)]
struct GrantedInterval {
    from_m: f64,
    to_m: f64,
    /// Whether the proven travel ends permanently at `to_m`.
    is_final: bool,
}

impl GrantedInterval {
    fn contains(&self, travel_m: f64) -> bool {
        (self.from_m..=self.to_m).contains(&travel_m)
    }

    /// Joins two overlapping intervals into one.
    fn joined(self, other: Self) -> Self {
        let reaches = |interval: Self, to_m: f64| interval.is_final && interval.to_m == to_m;
        let to_m = self.to_m.max(other.to_m);
        Self { from_m: self.from_m.min(other.from_m), to_m, is_final: reaches(self, to_m) || reaches(other, to_m) }
    }
}

/// The intervals that the guard of a run has granted.
///
/// A proof is about the run's geometry and stays valid, so no grant is ever revoked. Overlapping grants are joined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Authority {
    run_id: u64,
    /// The interval that contains the head.
    present: Option<GrantedInterval>,
    /// An interval without the head: the guard proved it for a refused seek.
    prepared: Option<GrantedInterval>,
    /// The target of the last refused seek, until a grant contains it.
    asked_m: Option<f64>,
}

impl Authority {
    /// The authority of a run before any grant.
    pub(super) fn none(run_id: u64) -> Self {
        Self { run_id, present: None, prepared: None, asked_m: None }
    }

    /// Travel up to which a head at `travel_m` may walk, in metres.
    pub(super) fn limit_m(&self, travel_m: f64) -> f64 {
        self.present.map_or(travel_m, |present| present.to_m)
    }

    /// Adds a grant while the head is at `travel_m`. Its ends are finite and in order.
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
        let interval = GrantedInterval { from_m, to_m, is_final };
        self.asked_m = self.asked_m.filter(|&asked_m| !interval.contains(asked_m));
        let slot = if interval.contains(travel_m) { &mut self.present } else { &mut self.prepared };
        let known = slot.filter(|known| known.from_m <= to_m && from_m <= known.to_m);
        *slot = Some(known.map_or(interval, |known| known.joined(interval)));
        Ok(())
    }

    /// Moves the head to `travel_m` where that travel is proved. Otherwise keeps `travel_m` as the requested travel.
    ///
    /// # Errors
    /// [`Refusal::NotProved`].
    pub(super) fn seek(&mut self, travel_m: f64) -> Result<(), Refusal> {
        let holds = |interval: &Option<GrantedInterval>| interval.is_some_and(|interval| interval.contains(travel_m));
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

    /// Returns the limits of a head at `travel_m`, for its guard.
    pub(super) fn limits(&self, travel_m: f64) -> Limits {
        let end_m = self.present.filter(|present| present.is_final).map(|present| present.to_m);
        Limits { granted_to_m: Some(self.limit_m(travel_m)), asked_m: self.asked_m, end_m }
    }
}
