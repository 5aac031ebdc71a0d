//! The part of a proof that is about the borders of a stage: no board passes one, or comes nearer than the stage allows.
//!
//! *Method.* As in [`border_search`](super::border_search): each bench is followed over ground of its own, from where it stands at the
//! beginning of the proof. Behind bench 1 that ends where the bench before it stood. So once a dragon has walked its length, only benches
//! 0 and 1 are followed.

use super::bench_search::{BenchSearch, Moment, Stride};
use super::border_search::{Breach, own_ground, parameters};
use crate::dragon::{Dragon, Spent};
use crate::stage::{BorderKind, Stage};

/// Proof that a dragon keeps clear of all borders, which can grow.
#[derive(Clone, Debug)]
pub(super) struct ProvenBorders<'a> {
    dragon: &'a Dragon,
    stage: &'a Stage,
    travel_m: f64,
    tracks: Vec<Track>,
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
    /// A board that does not keep clear, and does not come in.
    pub(super) fn at(dragon: &'a Dragon, stage: &'a Stage, travel_m: f64) -> Result<Self, Breach> {
        let (here, mut tracks) = (parameters(dragon, travel_m), Vec::new());
        let mut beginning: Option<Vec<f64>> = None;
        dragon.meter().restart();
        for kind in BorderKind::ALL.into_iter().filter(|&kind| !stage.of_kind(kind).is_empty()) {
            for bench in 0..dragon.dimensions().benches() {
                let search = search_of(dragon, stage, kind, bench);
                let moment = search.at(here[bench]).expect("the travel is feasible");
                if let Some((border, point)) = moment.breach {
                    let from = beginning.get_or_insert_with(|| parameters(dragon, dragon.start_travel_m()))[bench];
                    let comes_in = search.comes_in() && search.has_come_in(from, here[bench]) == Some(false);
                    if !comes_in {
                        return Err(Breach { travel_m, bench, border: stage.first_of(kind) + border, point });
                    }
                }
                tracks.push(Track { kind, bench, moment, limit: own_ground(&here, bench) });
            }
        }
        Ok(Self { dragon, stage, travel_m, tracks })
    }

    /// Follows all boards up to a travel of the run. Returns the travel up to which all of them keep clear.
    ///
    /// # Errors
    /// The dragon's meter is spent.
    pub(super) fn walk_over(&mut self, to_m: f64) -> Result<f64, Spent> {
        let Self { dragon, stage, travel_m, tracks } = self;
        let Some(last) = tracks.iter().map(|track| track.bench).max() else { return Ok(to_m) };
        let chain = dragon.chain(to_m).expect("within the run");
        let there: Vec<f64> = chain.take(last + 1).map(|handle| handle.parameter).collect();
        let mut reached_m = to_m;
        for track in tracks.iter_mut() {
            let search = search_of(dragon, stage, track.kind, track.bench);
            let breach = track.follow(&search, there[track.bench].min(track.limit));
            dragon.meter().check(*travel_m)?;
            if let Some(parameter) = breach {
                reached_m = search.head_travels_m(parameter, [*travel_m, reached_m])[0];
            }
        }
        tracks.retain(|track| track.moment.parameter() < track.limit);
        *travel_m = reached_m;
        Ok(reached_m)
    }
}

fn search_of<'a>(dragon: &'a Dragon, stage: &'a Stage, kind: BorderKind, bench: usize) -> BenchSearch<'a> {
    BenchSearch { dragon, borders: stage.of_kind(kind), clear_m: stage.clear_m(), bench }
}

impl Track {
    /// Follows the board up to a parameter, or to where it does not keep clear. That parameter is returned. If the meter is spent, the
    /// board is followed a part of the way.
    fn follow(&mut self, search: &BenchSearch<'_>, to: f64) -> Option<f64> {
        while self.moment.parameter() < to {
            if self.moment.breach.is_some() {
                self.moment = search.next_look(&self.moment, to)?;
                continue;
            }
            match search.stride(&self.moment, to) {
                Stride::Clear(later) => self.moment = later,
                Stride::Breach([earlier, _]) => return Some(earlier.parameter()),
                Stride::Spent => return None,
            }
        }
        None
    }
}
