//! The speed at which a head that stands will walk on.

/// The speed at which a head last walked steadily.
///
/// On its way to a rest a head with bounded acceleration has every speed down to none: what it had in passing is not what it will
/// go on at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WalkingSpeed {
    last_mps: f64,
    steady_mps: Option<f64>,
}

impl WalkingSpeed {
    /// Takes note of the speed in the next frame that is looked at.
    pub(super) fn note(&mut self, speed_mps: f64) {
        if speed_mps > 0.0 && speed_mps.to_bits() == self.last_mps.to_bits() {
            self.steady_mps = Some(speed_mps);
        }
        self.last_mps = speed_mps;
    }

    /// In metres a show second; `None` of a head that has not walked steadily yet.
    pub(super) fn steady_mps(&self) -> Option<f64> {
        self.steady_mps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(speeds_mps: &[f64]) -> Option<f64> {
        let mut speed = WalkingSpeed::default();
        for &speed_mps in speeds_mps {
            speed.note(speed_mps);
        }
        speed.steady_mps()
    }

    #[test]
    fn a_head_that_stands_goes_on_as_it_walked_before_it_slowed_down() {
        assert_eq!(after(&[1.0, 1.0, 0.5, 0.5, 0.0, 0.0]), Some(0.5));
        assert_eq!(after(&[0.5, 0.5, 0.4, 0.25, 0.01, 0.0]), Some(0.5));
    }

    #[test]
    fn of_a_head_that_never_walked_nothing_is_known() {
        assert_eq!(after(&[0.0, 0.0]), None);
        assert_eq!(after(&[0.0, 0.2, 0.4]), None);
    }
}
