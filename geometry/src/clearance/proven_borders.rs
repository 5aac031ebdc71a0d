//! The part of a proof that is about the borders of a stage: no board passes one, or comes nearer than the stage allows.
//!
//! *Method.* As in [`border_search`](super::border_search): each bench is followed over ground of its own, from where it stands at the
//! beginning of the proof. Behind bench 1 that ends where the bench before it stood. So once a dragon has walked its length, only benches
//! 0 and 1 are followed.
//!
//! *Loose hinges.* The proof is then about every pose that the play allows. A bench's front pole is anywhere between that of the taut and
//! that of the compact chain (see `dragon::loose`), so the bench is followed from the first to the second. Its board without play
//! keeps clear by as much more as the play lets a board reach (see `play::play_reach_m`). A board that comes in counts from where
//! every pose keeps clear. The proof ends where the brackets of the poles do.

use glam::DVec2;

use super::bench_search::{BenchSearch, Moment, Stride};
use super::border_search::{Breach, own_ground, parameters};
use super::play::play_reach_m;
use super::proven_travel::Reached;
use crate::dragon::loose::Loose;
use crate::dragon::{Dragon, Spent};
use crate::stage::{BorderKind, Stage};

/// Proof that a dragon keeps clear of all borders, which can grow.
#[derive(Clone, Debug)]
pub(super) struct ProvenBorders<'a> {
    dragon: &'a Dragon,
    stage: &'a Stage,
    travel_m: f64,
    tracks: Vec<Track>,
    /// How far the play lets the head's board and a body bench's reach.
    reach_m: [f64; 2],
}

/// One bench that is followed with respect to the borders of a kind.
#[derive(Clone, Copy, Debug)]
struct Track {
    kind: BorderKind,
    bench: usize,
    moment: Moment,
    /// Parameter of the front handle up to which the bench is followed.
    limit: f64,
}

impl<'a> ProvenBorders<'a> {
    /// The proof at one travel of the run.
    ///
    /// # Errors
    /// A board that does not keep clear, and does not come in. For loose hinges also one that may not, and the head if nothing is known of
    /// the poses.
    pub(super) fn at(dragon: &'a Dragon, stage: &'a Stage, travel_m: f64) -> Result<Self, Breach> {
        let unknown = |bench: usize| {
            let point = dragon.route().point(dragon.route().parameter(travel_m)).position;
            Breach { travel_m, bench, border: 0, point }
        };
        let reaches_m = [0, 1].map(|bench| play_reach_m(dragon, bench.min(dragon.dimensions().benches() - 1)));
        let ([Some(head_m), Some(body_m)], true) = (reaches_m, travel_m <= known_to_m(dragon)) else {
            return Err(unknown(0));
        };
        let mut proof = Self { dragon, stage, travel_m, tracks: Vec::new(), reach_m: [head_m, body_m] };
        let poles = chains(dragon).map(|chain| parameters(chain, travel_m));
        dragon.meter().restart();
        for kind in BorderKind::ALL.into_iter().filter(|&kind| !stage.of_kind(kind).is_empty()) {
            for bench in 0..dragon.dimensions().benches() {
                let track = proof.track(kind, bench, &poles);
                proof.tracks.push(track.map_err(|breach| match breach {
                    Some((border, point)) => Breach { travel_m, bench, border: stage.first_of(kind) + border, point },
                    None => unknown(bench),
                })?);
            }
        }
        Ok(proof)
    }

    /// Begins to follow a bench: from the rearmost place of its front pole to the foremost one, unless another bench is followed there.
    ///
    /// # Errors
    /// Where it does not keep clear; `None` if the meter is spent.
    fn track(
        &self,
        kind: BorderKind,
        bench: usize,
        [rearmost, foremost]: &[Vec<f64>; 2],
    ) -> Result<Track, Option<(usize, DVec2)>> {
        let search = self.search_of(kind, bench);
        let (from, limit) = (rearmost[bench], own_ground(rearmost, bench));
        let moment = search.at(from).ok_or(None)?;
        if moment.breach.is_some() {
            let begin = |chain: &Dragon| chain.chain(self.dragon.start_travel_m()).expect("within the run").nth(bench);
            let start = begin(chains(self.dragon)[0]).expect("each bench has a handle").parameter;
            let comes_in = search.comes_in() && search.has_come_in(start, from) == Some(false);
            if !comes_in {
                return Err(moment.breach);
            }
        }
        let mut track = Track { kind, bench, moment, limit };
        match track.follow(&search, foremost[bench].min(limit)) {
            Some(later) => Err(later.breach),
            None if self.dragon.meter().is_spent() => Err(None),
            None => Ok(track),
        }
    }

    /// Travel up to which all boards were followed.
    pub(super) fn travel_m(&self) -> f64 {
        self.travel_m
    }

    /// Follows all boards up to a travel of the run, stride by stride.
    pub(super) fn extend(&mut self, to_m: f64, stride_m: f64) -> Reached {
        while self.travel_m < to_m {
            let next_m = to_m.min(self.travel_m + stride_m);
            match self.walk_over(next_m) {
                Ok(reached_m) if reached_m < next_m => return Reached { travel_m: reached_m, is_end: true },
                Ok(_) => {}
                Err(_) => return Reached { travel_m: self.travel_m, is_end: false },
            }
        }
        Reached { travel_m: to_m, is_end: false }
    }

    /// Follows all boards up to a travel of the run. Returns the travel up to which all of them keep clear.
    ///
    /// # Errors
    /// The dragon's meter is spent.
    fn walk_over(&mut self, to_m: f64) -> Result<f64, Spent> {
        let Some(last) = self.tracks.iter().map(|track| track.bench).max() else {
            self.travel_m = to_m;
            return Ok(to_m);
        };
        let to_m = to_m.min(known_to_m(self.dragon)).max(self.travel_m);
        let foremost = chains(self.dragon)[1];
        let chain = foremost.chain(to_m).expect("within the run");
        let there: Vec<f64> = chain.take(last + 1).map(|handle| handle.parameter).collect();
        let mut reached_m = to_m;
        for number in 0..self.tracks.len() {
            let Track { kind, bench, limit, .. } = self.tracks[number];
            let search = self.search_of(kind, bench);
            let track = &mut self.tracks[number];
            let breach = track.follow(&search, there[bench].min(limit));
            self.dragon.meter().check(self.travel_m)?;
            if breach.is_some() {
                let search = BenchSearch { dragon: foremost, ..search };
                reached_m = search.head_travels_m(track.moment.parameter(), [self.travel_m, reached_m])[0];
            }
        }
        self.tracks.retain(|track| track.moment.parameter() < track.limit);
        self.travel_m = reached_m;
        Ok(reached_m)
    }

    fn search_of(&self, kind: BorderKind, bench: usize) -> BenchSearch<'a> {
        let clear_m = self.stage.clear_m() + self.reach_m[bench.min(1)];
        BenchSearch { dragon: self.dragon, borders: self.stage.of_kind(kind), clear_m, bench }
    }
}

/// The chains between which each pole is: the rearmost and the foremost one.
fn chains(dragon: &Dragon) -> [&Dragon; 2] {
    dragon.loose().map_or([dragon; 2], |loose| [loose.taut(), loose.compact()])
}

/// Travel up to which the poles are known.
fn known_to_m(dragon: &Dragon) -> f64 {
    dragon.loose().map_or_else(|| dragon.end_travel_m(), Loose::end_travel_m)
}

impl Track {
    /// Follows the board up to a parameter, or to where it keeps clear for the last time. The next moment is then returned. If the
    /// meter is spent, the board is followed a part of the way.
    fn follow(&mut self, search: &BenchSearch<'_>, to: f64) -> Option<Moment> {
        while self.moment.parameter() < to {
            if self.moment.breach.is_some() {
                self.moment = search.next_look(&self.moment, to)?;
                continue;
            }
            match search.stride(&self.moment, to) {
                Stride::Clear(later) => self.moment = later,
                Stride::Breach([earlier, later]) => {
                    self.moment = earlier;
                    return Some(later);
                }
                Stride::Spent => return None,
            }
        }
        None
    }
}
