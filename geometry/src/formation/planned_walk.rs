//! A walk whose planned speed changes: pieces of constant acceleration.
//!
//! The head turns to a new speed at the planned instant, with its acceleration. For a rest it brakes before, so that it stands at
//! the planned instant. It brakes likewise for the end of its run. Both brakings begin at one instant at most: on any piece, the
//! speed falls no faster than a braking head, so `v − a·(time left)` and `v² / 2a − (travel left)` never fall.

use super::Change;

/// Travel of a head over time, in pieces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlannedWalk {
    planned_mps: f64,
    accel_mps2: Option<f64>,
    changes: Vec<Change>,
    /// The last piece is a rest.
    pieces: Vec<Piece>,
}

/// A piece of the walk, up to the beginning of the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    from_s: f64,
    from_m: f64,
    speed_mps: f64,
    accel_mps2: f64,
}

impl Piece {
    fn travel_m(&self, time_s: f64) -> f64 {
        let elapsed_s = time_s - self.from_s;
        self.from_m + (self.speed_mps + 0.5 * self.accel_mps2 * elapsed_s) * elapsed_s
    }

    fn speed_mps(&self, time_s: f64) -> f64 {
        (self.speed_mps + self.accel_mps2 * (time_s - self.from_s)).max(0.0)
    }

    /// Time to walk a distance: v·t + a·t²/2 = the distance.
    fn duration_s(&self, distance_m: f64) -> f64 {
        if distance_m <= 0.0 {
            return 0.0;
        }
        let root_mps = (self.speed_mps * self.speed_mps + 2.0 * self.accel_mps2 * distance_m).max(0.0).sqrt();
        2.0 * distance_m / (self.speed_mps + root_mps)
    }
}

impl PlannedWalk {
    /// A walk from `start_m`, which the head leaves at `start_s`, to `end_m`. `changes` are in the order of their times.
    pub(super) fn new(
        [start_s, start_m]: [f64; 2],
        planned_mps: f64,
        accel_mps2: Option<f64>,
        changes: &[Change],
        end_m: f64,
    ) -> Self {
        let mut walker = Walker {
            at: Piece { from_s: start_s, from_m: start_m, speed_mps: 0.0, accel_mps2: 0.0 },
            target_mps: planned_mps,
            end_m: end_m.max(start_m),
            accel_mps2,
            pieces: Vec::new(),
        };
        walker.walk(changes);
        Self { planned_mps, accel_mps2, changes: changes.to_vec(), pieces: walker.pieces }
    }

    pub(super) fn delayed(&self, delay_s: f64) -> Self {
        let later = |piece: &Piece| Piece { from_s: piece.from_s + delay_s, ..*piece };
        Self {
            changes: self.changes.iter().map(|change| change.delayed(delay_s)).collect(),
            pieces: self.pieces.iter().map(later).collect(),
            ..*self
        }
    }

    pub(super) fn time_s(&self, travel_m: f64) -> f64 {
        let next = self.pieces.partition_point(|piece| piece.from_m < travel_m);
        let Some(piece) = next.checked_sub(1).map(|last| self.pieces[last]) else { return self.start_s() };
        let time_s = piece.from_s + piece.duration_s(travel_m - piece.from_m);
        self.pieces.get(next).map_or(piece.from_s, |next| time_s.min(next.from_s))
    }

    pub(super) fn travel_m(&self, time_s: f64) -> f64 {
        let next = self.pieces.partition_point(|piece| piece.from_s <= time_s);
        let Some(piece) = next.checked_sub(1).map(|last| self.pieces[last]) else { return self.pieces[0].from_m };
        // Rounding must not put the head past the beginning of the next piece.
        self.pieces.get(next).map_or(piece.from_m, |next| piece.travel_m(time_s).min(next.from_m))
    }

    pub(super) fn speed_mps(&self, time_s: f64) -> f64 {
        let next = self.pieces.partition_point(|piece| piece.from_s <= time_s);
        next.checked_sub(1).map_or(0.0, |last| self.pieces[last].speed_mps(time_s))
    }

    pub(super) fn pieces(&self) -> Vec<[f64; 4]> {
        let numbers = |piece: &Piece| [piece.from_s, piece.from_m, piece.speed_mps, piece.accel_mps2];
        self.pieces.iter().map(numbers).collect()
    }

    pub(super) fn start_s(&self) -> f64 {
        self.pieces[0].from_s
    }

    pub(super) fn end_s(&self) -> f64 {
        self.pieces[self.pieces.len() - 1].from_s
    }

    pub(super) fn planned_mps(&self) -> f64 {
        self.planned_mps
    }

    pub(super) fn accel_mps2(&self) -> Option<f64> {
        self.accel_mps2
    }

    /// The speed that is planned at a time, apart from ramps and rests.
    pub(super) fn ordered_mps(&self, time_s: f64) -> f64 {
        let speeds = self.changes.iter().take_while(|change| change.at_s() <= time_s).filter_map(Change::speed_mps);
        speeds.last().unwrap_or(self.planned_mps)
    }

    pub(super) fn reaches_speed(&self, speed_mps: f64, [from_s, to_s]: [f64; 2]) -> bool {
        self.pieces.iter().any(|piece| piece.speed_mps == speed_mps && (from_s..=to_s).contains(&piece.from_s))
    }

    pub(super) fn most_speed_mps(&self) -> f64 {
        self.changes.iter().filter_map(Change::speed_mps).fold(self.planned_mps, f64::max)
    }

    pub(super) fn next_jump_s(&self, time_s: f64) -> Option<f64> {
        if self.accel_mps2.is_some() {
            return None;
        }
        self.pieces.iter().map(|piece| piece.from_s).find(|&jump_s| jump_s > time_s)
    }
}

/// The head while the pieces are made.
struct Walker {
    /// The head now; its acceleration is 0.
    at: Piece,
    target_mps: f64,
    end_m: f64,
    accel_mps2: Option<f64>,
    pieces: Vec<Piece>,
}

impl Walker {
    fn walk(&mut self, changes: &[Change]) {
        let mut next = 0;
        loop {
            while let Some(change) = changes.get(next).filter(|change| change.at_s() <= self.at.from_s) {
                self.target_mps = change.speed_mps().unwrap_or(self.target_mps);
                next += 1;
            }
            let rest_s = changes[next..].iter().find(|change| change.speed_mps().is_none()).map(Change::at_s);
            let change_s = changes.get(next).map_or(f64::INFINITY, Change::at_s);
            if self.at.from_m >= self.end_m || !self.advance(change_s, rest_s) {
                return self.pieces.push(Piece { speed_mps: 0.0, ..self.at });
            }
        }
    }

    /// Adds the next piece, or two of them. `false` if the head stands from here on.
    fn advance(&mut self, change_s: f64, rest_s: Option<f64>) -> bool {
        let Some(accel_mps2) = self.accel_mps2 else { return self.advance_at_once(change_s) };
        let Piece { from_s, from_m, speed_mps, .. } = self.at;
        let piece =
            Piece { accel_mps2: accel_mps2 * f64::from(self.target_mps.total_cmp(&speed_mps) as i8), ..self.at };
        let slower = accel_mps2 + piece.accel_mps2;
        let until_target_s = match piece.accel_mps2 {
            0.0 => f64::INFINITY,
            change => (self.target_mps - speed_mps) / change,
        };
        let braking_s = |left: f64| if slower > 0.0 { (left / slower).max(0.0) } else { f64::INFINITY };
        let until_rest_s = rest_s.map_or(f64::INFINITY, |rest_s| braking_s(accel_mps2 * (rest_s - from_s) - speed_mps));
        let free_m = (self.end_m - from_m - 0.5 * speed_mps * speed_mps / accel_mps2).max(0.0);
        let until_end_s = match slower {
            slower if slower > 0.0 && speed_mps + piece.accel_mps2 > 0.0 => {
                piece.duration_s(free_m * accel_mps2 / slower)
            }
            _ => f64::INFINITY,
        };
        let until_s =
            [until_target_s, change_s - from_s, until_rest_s, until_end_s].into_iter().fold(f64::INFINITY, f64::min);
        if until_s == f64::INFINITY {
            return false;
        }
        let to_s = if until_s == change_s - from_s { change_s } else { from_s + until_s };
        let reached = Piece {
            from_s: to_s,
            from_m: piece.travel_m(to_s).min(self.end_m),
            speed_mps: if until_s == until_target_s { self.target_mps } else { piece.speed_mps(to_s) },
            accel_mps2: 0.0,
        };
        self.add(piece, reached);
        if until_s == until_rest_s {
            self.brake(accel_mps2, rest_s.expect("it limits the piece"), None);
        } else if until_s == until_end_s {
            self.brake(accel_mps2, to_s + reached.speed_mps / accel_mps2, Some(self.end_m));
        }
        true
    }

    fn advance_at_once(&mut self, change_s: f64) -> bool {
        let piece = Piece { speed_mps: self.target_mps, ..self.at };
        let until_end_s =
            if self.target_mps > 0.0 { piece.duration_s(self.end_m - piece.from_m) } else { f64::INFINITY };
        let to_s = change_s.min(piece.from_s + until_end_s);
        if to_s == f64::INFINITY {
            return false;
        }
        let to_m = if to_s < change_s { self.end_m } else { piece.travel_m(to_s).min(self.end_m) };
        self.add(piece, Piece { from_s: to_s, from_m: to_m, ..piece });
        true
    }

    /// Brakes to a rest at an instant, and at a travel if the travel is known.
    fn brake(&mut self, accel_mps2: f64, rest_s: f64, at_m: Option<f64>) {
        let piece = Piece { accel_mps2: -accel_mps2, ..self.at };
        let rest_m = at_m
            .unwrap_or_else(|| (piece.from_m + 0.5 * piece.speed_mps * piece.speed_mps / accel_mps2).min(self.end_m));
        self.add(piece, Piece { from_s: rest_s.max(piece.from_s), from_m: rest_m, speed_mps: 0.0, accel_mps2: 0.0 });
    }

    fn add(&mut self, piece: Piece, reached: Piece) {
        if reached.from_s > piece.from_s {
            self.pieces.push(piece);
        }
        self.at = reached;
    }
}
