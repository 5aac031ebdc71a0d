//! Steps all dragons of a formation from tick to tick.

use std::sync::Arc;

use glam::DVec3;

use super::Formation;
use crate::dragon::{ChainStepper, TravelOutOfRange};

/// Advances a formation along its course, in steps that are short compared to the links: a [`ChainStepper`] for each dragon.
#[derive(Debug)]
pub struct FormationStepper {
    formation: Arc<Formation>,
    chains: Vec<ChainStepper>,
}

impl FormationStepper {
    /// A stepper of a formation.
    pub fn new(formation: Arc<Formation>) -> Self {
        let chains = formation.dragons().iter().map(|planned| ChainStepper::new(Arc::clone(&planned.dragon))).collect();
        Self { formation, chains }
    }

    /// The formation that the stepper advances.
    pub fn formation(&self) -> &Formation {
        &self.formation
    }

    /// Moves the formation to a place of its course and writes one record per handle, dragon after dragon. The velocities are
    /// those of a formation that goes along its course at `speed_mps`. `record` as for [`ChainStepper::step`].
    ///
    /// # Errors
    /// The travel of a dragon must be feasible, as it is everywhere on the course.
    ///
    /// # Panics
    /// Panics if the number of records differs from the number of handles.
    pub fn step<H>(
        &mut self,
        course_m: f64,
        speed_mps: f64,
        records: &mut [H],
        record: impl Fn(DVec3, DVec3) -> H,
    ) -> Result<(), TravelOutOfRange> {
        assert_eq!(records.len(), self.formation.layout().handles(), "one record for each handle");
        for (number, chain) in self.chains.iter_mut().enumerate() {
            let motion = self.formation.motion(number, course_m, speed_mps);
            let records = &mut records[self.formation.layout().handles_of(number)];
            chain.step(motion.travel_m, motion.speed_mps, records, &record)?;
        }
        Ok(())
    }
}
