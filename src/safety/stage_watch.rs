//! Watches the boards of all dragons with respect to the borders of the stage.
//!
//! Two sources agree about a board that walks. The boards of each frame are measured. And for each dragon, the ground on which a board
//! does not keep clear is known from the description, so that the instants at which boards pass its ends between two frames are exact, and
//! no passage is missed.
//!
//! Benches follow each other over the same ground. So an event is reported where a board comes too near while the bench before it
//! is clear, and where a board is clear again while the bench behind it is clear too, and not for each bench that follows.

use std::ops::Range;

use bench_dragon_geometry::clearance::{BreachGround, HandlePlaces, Passage};
use bench_dragon_geometry::dragon::Board;
use bench_dragon_geometry::formation::{Formation, Layout};
use bench_dragon_geometry::stage::{Border, BorderKind, Stage};
use bench_dragon_ipc::AlertKind;
use glam::DVec2;

/// The boards of all dragons on a stage.
#[derive(Debug)]
pub(super) struct StageWatch {
    layout: Layout,
    watches: Vec<Watch>,
    /// Where the handles of each dragon were in the last frame, of a stage that boards come near to.
    places: Vec<HandlePlaces>,
    passages: Vec<Passage>,
}

/// The boards with respect to the borders of one kind, at one distance.
#[derive(Debug)]
struct Watch {
    borders: Vec<Border>,
    clear_m: f64,
    begins: AlertKind,
    ends: AlertKind,
    boards: Vec<BoardState>,
    /// The ground of each dragon; `None` where it takes too much work.
    grounds: Vec<Option<BreachGround>>,
}

/// The last measurement of a board.
#[derive(Clone, Copy, Debug, Default)]
struct BoardState {
    is_near: bool,
    /// Whether a passage between the last two frames has set the state.
    is_swept: bool,
    /// Centre of the board when it was last measured.
    centre: DVec2,
    /// Distance from that centre within which the board is clear.
    slack_m: f64,
}

/// An event on the stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StageEvent {
    pub(super) kind: AlertKind,
    /// Bench, numbered on from dragon to dragon.
    pub(super) bench: usize,
    pub(super) point: DVec2,
    /// Distance of the board from the border.
    pub(super) distance_m: f64,
    /// Place of the course; `None` for an event that is measured in a frame.
    pub(super) course_m: Option<f64>,
}

impl StageWatch {
    /// A watch of a formation, whose dragons have a meter that limits the search for the ground; `None` for a stage without borders.
    pub(super) fn new(formation: &Formation, stage: &Stage) -> Option<Self> {
        let watches: Vec<Watch> = rules(stage)
            .into_iter()
            .map(|(kind, clear_m, begins, ends)| {
                let borders = stage.of_kind(kind).to_vec();
                let ground = |dragon: usize| {
                    let dragon = &formation.dragons()[dragon].dragon;
                    dragon.meter().restart();
                    BreachGround::of(dragon, &borders, clear_m).ok()
                };
                let grounds = (0..formation.layout().dragons()).map(ground).collect();
                let boards = vec![BoardState::default(); formation.layout().benches()];
                Watch { borders, clear_m, begins, ends, boards, grounds }
            })
            .collect();
        (!watches.is_empty()).then(|| Self {
            layout: formation.layout().clone(),
            watches,
            places: Vec::new(),
            passages: Vec::new(),
        })
    }

    /// Forgets the states of all boards, because the head was repositioned.
    pub(super) fn restart(&mut self) {
        self.places.clear();
        for board in self.watches.iter_mut().flat_map(|watch| &mut watch.boards) {
            (board.is_near, board.is_swept) = (false, false);
        }
    }

    /// Whether all passages are known: the search for the ground of each dragon was not too much work.
    pub(super) fn is_complete(&self) -> bool {
        self.watches.iter().flat_map(|watch| &watch.grounds).all(Option::is_some)
    }

    /// Reports the events since the last frame, from which the formation walked to this place of its course.
    pub(super) fn sweep(&mut self, formation: &Formation, to_m: f64, mut report: impl FnMut(StageEvent)) {
        let Self { layout, watches, places, passages } = self;
        let has_ground = |ground: &Option<BreachGround>| ground.as_ref().is_some_and(|ground| !ground.is_empty());
        if !watches.iter().flat_map(|watch| &watch.grounds).any(has_ground) {
            return;
        }
        let next: Vec<HandlePlaces> = formation
            .dragons()
            .iter()
            .enumerate()
            .map(|(number, planned)| {
                let (low, high) = (planned.dragon.start_travel_m(), planned.dragon.end_travel_m());
                let travel_m = formation.travel_m(number, to_m).clamp(low, high);
                let known = places.get(number).filter(|known| known.travel_m() == travel_m).cloned();
                known.unwrap_or_else(|| HandlePlaces::of(&planned.dragon, travel_m))
            })
            .collect();
        let from = std::mem::replace(places, next);
        for watch in watches.iter_mut() {
            let mut events = Vec::new();
            for (number, ((from, to), ground)) in from.iter().zip(places.iter()).zip(&watch.grounds).enumerate() {
                let Some(ground) = ground.as_ref().filter(|ground| !ground.is_empty()) else { continue };
                let planned = &formation.dragons()[number];
                passages.clear();
                ground.add_passages(&planned.dragon, from, to, passages);
                let benches = layout.benches_of(number);
                events.extend(passages.iter().map(|&passage| {
                    let course_m = formation.place_of(number, passage.travel_m);
                    (benches.clone(), Passage { bench: benches.start + passage.bench, ..passage }, course_m)
                }));
            }
            events.sort_by(|(_, one, one_m), (_, other, other_m)| {
                one_m.total_cmp(other_m).then(one.bench.cmp(&other.bench))
            });
            for (benches, passage, course_m) in events {
                let Passage { bench, point, distance_m, begins, .. } = passage;
                watch.boards[bench].is_swept = true;
                if let Some(kind) = watch.change(&benches, bench, begins) {
                    report(StageEvent { kind, bench, point, distance_m, course_m: Some(course_m) });
                }
            }
        }
    }

    /// Measures the boards of a frame. Reports the events that no passage has reported.
    pub(super) fn observe(&mut self, boards: &[Board], mut report: impl FnMut(StageEvent)) {
        let layout = &self.layout;
        for watch in &mut self.watches {
            for benches in (0..layout.dragons()).map(|dragon| layout.benches_of(dragon)) {
                for bench in benches.clone() {
                    let (board, state) = (&boards[bench], &mut watch.boards[bench]);
                    if std::mem::take(&mut state.is_swept) {
                        continue;
                    }
                    let breach = state.breach(board, &watch.borders, watch.clear_m);
                    if let Some(kind) = watch.change(&benches, bench, breach.is_some()) {
                        let nearest = watch.nearest(board);
                        let (distance_m, point) = nearest.map_or((0.0, board.centre), |nearest| nearest);
                        let point = breach.unwrap_or(point);
                        report(StageEvent { kind, bench, point, distance_m, course_m: None });
                    }
                }
            }
        }
    }
}

/// The kinds of borders with the distance to watch, and the alerts for boards that come nearer, and that are clear again.
fn rules(stage: &Stage) -> Vec<(BorderKind, f64, AlertKind, AlertKind)> {
    use AlertKind::{Clear, Inside, KeepOut, Outside, TooNear};
    let clear_m = stage.clear_m();
    let beyond = [(BorderKind::Outline, 0.0, Outside, Inside), (BorderKind::KeepOut, 0.0, KeepOut, Clear)];
    let near = BorderKind::ALL.map(|kind| (kind, clear_m, TooNear, Clear));
    // To cross the line of the crowd is to be too near, whatever the distance.
    let near = near.into_iter().filter(|(kind, ..)| clear_m > 0.0 || *kind == BorderKind::Crowd);
    beyond.into_iter().chain(near).filter(|(kind, ..)| !stage.of_kind(*kind).is_empty()).collect()
}

impl Watch {
    /// Changes the state of a board of the dragon with these benches. Returns the alert for it.
    fn change(&mut self, benches: &Range<usize>, bench: usize, is_near: bool) -> Option<AlertKind> {
        if std::mem::replace(&mut self.boards[bench].is_near, is_near) == is_near {
            return None;
        }
        let neighbour = if is_near { bench.checked_sub(1) } else { Some(bench + 1) };
        let is_led = neighbour.is_some_and(|other| benches.contains(&other) && self.boards[other].is_near);
        (!is_led).then_some(if is_near { self.begins } else { self.ends })
    }

    /// Distance from the nearest border, and the point of the board that is nearest to it.
    fn nearest(&self, board: &Board) -> Option<(f64, DVec2)> {
        let nearest = self.borders.iter().map(|border| (border.distance_m(board), border.nearest_point(board)));
        nearest.reduce(|one, other| if other.0 < one.0 { other } else { one })
    }
}

impl BoardState {
    /// The point of a board that is not clear. A board is measured only where it may have come near.
    fn breach(&mut self, board: &Board, borders: &[Border], clear_m: f64) -> Option<DVec2> {
        if board.centre.distance(self.centre) < self.slack_m {
            return None;
        }
        self.centre = board.centre;
        self.slack_m = borders.iter().map(|border| border.slack_m(board, clear_m)).fold(f64::INFINITY, f64::min);
        if self.slack_m > 0.0 { None } else { borders.iter().find_map(|border| border.breach(board, clear_m)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    /// A straight dragon of five benches 2 m apart, and a watch of it on a stage.
    fn watch(stage: &str) -> (Config, StageWatch) {
        let text = format!(
            "[dragon]\nbenches = 5\nhead_length_m = 2.4\nbody_length_m = 2.4\nwidth_m = 0.3\nhole_offset_m = 0.2\n\
             [route]\nkind = \"path\"\nsegments = [{{ kind = \"line\", length_m = 60 }}]\n[stage]\n{stage}\n"
        );
        let config = Config::from_toml(&text).expect("a valid configuration");
        let watch = StageWatch::new(config.formation(), config.stage()).expect("it has borders");
        (config, watch)
    }

    /// A row of boards behind a head at x, one every 2 m.
    fn row(head_m: f64) -> Vec<Board> {
        let at = |bench: u32| DVec2::new(head_m - 2.0 * f64::from(bench), 0.0);
        (0..5).map(|bench| Board::from_handles(at(bench), at(bench + 1), 2.4, 0.3)).collect()
    }

    /// The events that are measured in a frame: kind and bench.
    fn measured(watch: &mut StageWatch, head_m: f64) -> Vec<(AlertKind, usize)> {
        let mut events = Vec::new();
        watch.observe(&row(head_m), |event| events.push((event.kind, event.bench)));
        events
    }

    /// The events since the last frame, and those of this one.
    fn walked(config: &Config, watch: &mut StageWatch, head_m: f64) -> Vec<StageEvent> {
        let mut events = Vec::new();
        watch.sweep(config.formation(), head_m, |event| events.push(event));
        watch.observe(&row(head_m), |event| events.push(event));
        events
    }

    const STAGE: &str = "outline = [[-20, -5], [10, -5], [10, 5], [-20, 5]]";

    #[test]
    fn a_row_that_walks_off_the_stage_is_reported_once() {
        let (_, mut watch) = watch(STAGE);
        let reported: Vec<_> = (0..300).flat_map(|step| measured(&mut watch, 0.1 * f64::from(step))).collect();
        assert_eq!(reported, [(AlertKind::Outside, 0)]);
    }

    #[test]
    fn a_board_that_returns_and_leaves_again_is_reported_again() {
        let (_, mut watch) = watch(STAGE);
        let reported = [9.0, 9.9, 9.95, 9.0, 9.9].map(|head_m| measured(&mut watch, head_m));
        let (outside, inside) = (vec![(AlertKind::Outside, 0)], vec![(AlertKind::Inside, 0)]);
        assert_eq!(reported, [vec![], outside.clone(), vec![], inside, outside.clone()]);
        watch.restart();
        assert_eq!(measured(&mut watch, 9.9), outside);
    }

    #[test]
    fn boards_between_two_edges_are_always_measured() {
        let (_, mut watch) = watch("outline = [[-20, -0.16], [30, -0.16], [30, 0.16], [-20, 0.16]]");
        watch.observe(&row(0.0), |event| panic!("{event:?}"));
        let mut turned = row(0.0);
        turned[3].heading = DVec2::from_angle(0.1);
        let mut reported = Vec::new();
        watch.observe(&turned, |event| reported.push(event.bench));
        assert_eq!(reported, [3]);
    }

    #[test]
    fn a_row_that_passes_a_spike_is_reported_between_frames_with_exact_places() {
        // The tip of the area is 0.1 m in the way of boards that are 0.15 m to either side, so a frame every 30 m has none of it.
        let (config, mut watch) = watch("keep_out = [[[20, 0.05], [20.001, 3], [19.999, 3]]]");
        assert!(watch.is_complete());
        assert_eq!(walked(&config, &mut watch, 5.0), []);
        let events = walked(&config, &mut watch, 35.0);
        let kinds: Vec<_> = events.iter().map(|event| (event.kind, event.bench)).collect();
        // The boards overlap on their hinges: before one leaves the spike, the next one has reached it.
        assert_eq!(kinds, [(AlertKind::KeepOut, 0), (AlertKind::Clear, 4)]);
        let places = events.iter().map(|event| event.course_m.expect("between frames"));
        for (place_m, expected_m) in places.zip([20.0 - 0.2, 20.0 + 10.0 + 0.2]) {
            assert!((place_m - expected_m).abs() < 2e-3, "{place_m} m, expected {expected_m}");
        }
        assert_eq!(walked(&config, &mut watch, 36.0), []);
    }

    #[test]
    fn a_board_too_near_to_the_crowd_and_clear_again_is_reported_with_its_distance() {
        let (config, mut watch) = watch("crowd = [[20, 1], [20, 9]]\nclear_m = 0.9");
        let events: Vec<_> = (0..600).flat_map(|step| walked(&config, &mut watch, 0.1 * f64::from(step))).collect();
        let kinds: Vec<_> = events.iter().map(|event| (event.kind, event.bench)).collect();
        assert_eq!(kinds, [(AlertKind::TooNear, 0), (AlertKind::Clear, 4)]);
        assert!(events.iter().all(|event| (event.distance_m - 0.9).abs() < 1e-6), "{events:?}");
        // The front corner is at √(0.9² − 0.85²) before the end of the line.
        let expected_m = 20.0 - 0.2 - (0.9_f64 * 0.9 - 0.85 * 0.85).sqrt();
        assert!((events[0].course_m.expect("swept") - expected_m).abs() < 1e-6, "{events:?}");
    }

    #[test]
    fn a_stage_without_borders_has_no_watch() {
        let config = Config::from_toml("").expect("the paper's dragon");
        assert!(StageWatch::new(config.formation(), config.stage()).is_none());
    }
}
