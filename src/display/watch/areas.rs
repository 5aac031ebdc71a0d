//! Where on the screen everything is.

use ratatui::layout::Rect;

/// From this width on there is room for a column of figures beside the plan.
const WIDE: u16 = 64;
/// Widths of that column.
const PANEL: [u16; 2] = [30, 46];
/// A screen of so many lines has lamps.
pub(super) const LAMPED: u16 = 13;
/// Lines of figures under the plan where there is none.
const STRIP: u16 = 4;

/// The parts of the screen; what there is no room for is empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Areas {
    pub(super) status: Rect,
    pub(super) lamps: Rect,
    pub(super) plan: Rect,
    /// Beside the plan.
    pub(super) panel: Rect,
    /// Under the plan, where there is no panel.
    pub(super) strip: Rect,
    pub(super) reply: Rect,
    pub(super) keys: Rect,
}

impl Areas {
    /// Parts a screen. The status comes first, then the reply, the keys and the lamps; the plan gets what is left.
    pub(super) fn of(screen: Rect) -> Self {
        let (status, rest) = cut_top(screen, 1);
        let (rest, keys) = cut_bottom(rest, u16::from(screen.height >= 4));
        let (rest, reply) = cut_bottom(rest, u16::from(screen.height >= 3));
        let (lamps, rest) = cut_top(rest, u16::from(screen.height >= LAMPED));
        if screen.width < WIDE {
            let (plan, strip) = cut_bottom(rest, if rest.height > 2 * STRIP { STRIP } else { rest.height / 3 });
            return Self { status, lamps, plan, panel: Rect::ZERO, strip, reply, keys };
        }
        let width = (screen.width * 3 / 8).clamp(PANEL[0], PANEL[1]);
        let plan = Rect { width: rest.width - width - 1, ..rest };
        let panel = Rect { x: rest.right() - width, width, ..rest };
        Self { status, lamps, plan, panel, strip: Rect::ZERO, reply, keys }
    }
}

/// The first rows, at most as many as there are, and the others.
pub(super) fn cut_top(area: Rect, rows: u16) -> (Rect, Rect) {
    let rows = rows.min(area.height);
    (Rect { height: rows, ..area }, Rect { y: area.y + rows, height: area.height - rows, ..area })
}

/// All but the last rows, and those.
fn cut_bottom(area: Rect, rows: u16) -> (Rect, Rect) {
    cut_top(area, area.height.saturating_sub(rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_any_screen_lie_in_it_and_apart() {
        for (width, height) in (0..=130).flat_map(|width| (0..=40).map(move |height| (width, height))) {
            let screen = Rect::new(0, 0, width, height);
            let Areas { status, lamps, plan, panel, strip, reply, keys } = Areas::of(screen);
            let parts = [status, lamps, plan, panel, strip, reply, keys];
            for (index, part) in parts.iter().enumerate() {
                assert!(part.is_empty() || screen.union(*part) == screen, "{part} of {screen}");
                let others = parts[index + 1..].iter();
                assert!(others.clone().all(|other| !part.intersects(*other)), "{part} of {screen}");
            }
        }
    }

    #[test]
    fn a_screen_of_80_by_24_has_a_plan_of_49_by_20_beside_the_figures() {
        let areas = Areas::of(Rect::new(0, 0, 80, 24));
        assert_eq!((areas.plan, areas.panel), (Rect::new(0, 2, 49, 20), Rect::new(50, 2, 30, 20)));
    }
}
