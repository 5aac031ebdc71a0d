//! Watches whether boards are on the stage.
//!
//! Benches follow each other over the same ground. So an alert is raised where a board leaves the stage while the bench before
//! it is inside, and not for each bench that follows.

use bench_dragon_geometry::dragon::Board;
use bench_dragon_geometry::stage::Border;
use glam::DVec2;

/// The boards of one dragon on a stage with an outline.
#[derive(Debug)]
pub(super) struct StageWatch {
    outline: Border,
    boards: Vec<BoardState>,
}

/// The last measurement of a board.
#[derive(Clone, Copy, Debug, Default)]
struct BoardState {
    is_outside: bool,
    /// Centre of the board when it was last measured.
    centre: DVec2,
    /// Distance from that centre within which the board is inside.
    slack_m: f64,
}

impl StageWatch {
    pub(super) fn new(outline: Border) -> Self {
        Self { outline, boards: Vec::new() }
    }

    /// Forgets which boards are outside, because the head was repositioned.
    pub(super) fn restart(&mut self) {
        self.boards.iter_mut().for_each(|board| board.is_outside = false);
    }

    /// Takes the boards of the next frame. Calls `report` with each bench that has left the stage while the bench before it is
    /// inside, and with a point of its board outside.
    pub(super) fn observe(&mut self, boards: &[Board], mut report: impl FnMut(usize, DVec2)) {
        self.boards.resize(boards.len(), BoardState::default());
        let mut is_before_outside = false;
        for (bench, (board, state)) in boards.iter().zip(&mut self.boards).enumerate() {
            let leaving = state.leaving_point(board, &self.outline);
            if let Some(point) = leaving.filter(|_| !state.is_outside && !is_before_outside) {
                report(bench, point);
            }
            state.is_outside = leaving.is_some();
            is_before_outside = state.is_outside;
        }
    }
}

impl BoardState {
    /// The point of a board that is outside. A board is measured only where it may have reached the outline.
    fn leaving_point(&mut self, board: &Board, outline: &Border) -> Option<DVec2> {
        if board.centre.distance(self.centre) < self.slack_m {
            return None;
        }
        self.centre = board.centre;
        self.slack_m = outline.slack_m(board, 0.0);
        if self.slack_m > 0.0 { None } else { outline.breach(board, 0.0) }
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_geometry::stage::Outline;

    use super::*;

    /// A row of boards behind a head at x, one every 2 m.
    fn row(head_m: f64) -> Vec<Board> {
        let at = |bench: u32| DVec2::new(head_m - 2.0 * f64::from(bench), 0.0);
        (0..5).map(|bench| Board::from_handles(at(bench), at(bench + 1), 2.4, 0.3)).collect()
    }

    fn reports(watch: &mut StageWatch, head_m: f64) -> Vec<usize> {
        let mut reported = Vec::new();
        watch.observe(&row(head_m), |bench, point| {
            assert!(!watch_contains(point), "{point} is inside");
            reported.push(bench);
        });
        reported
    }

    fn rectangle() -> Outline {
        Outline::new(&[[-20.0, -5.0], [10.0, -5.0], [10.0, 5.0], [-20.0, 5.0]]).expect("a rectangle")
    }

    fn stage() -> Border {
        Border::outline(rectangle())
    }

    fn watch_contains(point: DVec2) -> bool {
        rectangle().contains(point)
    }

    #[test]
    fn a_row_that_walks_off_the_stage_is_reported_once() {
        let mut watch = StageWatch::new(stage());
        let reported: Vec<usize> = (0..300).flat_map(|step| reports(&mut watch, 0.1 * f64::from(step))).collect();
        assert_eq!(reported, [0]);
    }

    #[test]
    fn a_board_that_returns_and_leaves_again_is_reported_again() {
        let mut watch = StageWatch::new(stage());
        let reported = [9.0, 9.9, 9.95, 9.0, 9.9].map(|head_m| reports(&mut watch, head_m));
        assert_eq!(reported, [vec![], vec![0], vec![], vec![], vec![0]]);
        watch.restart();
        assert_eq!(reports(&mut watch, 9.9), [0]);
    }

    #[test]
    fn boards_between_two_edges_are_always_measured() {
        let aisle = Outline::new(&[[-20.0, -0.16], [30.0, -0.16], [30.0, 0.16], [-20.0, 0.16]]).expect("a rectangle");
        let mut watch = StageWatch::new(Border::outline(aisle));
        watch.observe(&row(0.0), |bench, _| panic!("bench {bench} is inside"));
        let mut turned = row(0.0);
        turned[3].heading = DVec2::from_angle(0.1);
        let mut reported = Vec::new();
        watch.observe(&turned, |bench, _| reported.push(bench));
        assert_eq!(reported, [3]);
    }
}
