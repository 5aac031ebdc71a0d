//! The camera: the part of the plan in view.

use std::ops::RangeInclusive;

use glam::DVec2;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;

use super::look::Glyphs;
use crate::display::observe::{FrameCopy, Snapshot};

/// Factor of one zoom step, and range of the zoom. At 1, all of the route is in view.
const ZOOM_STEP: f64 = 1.25;
const ZOOM: RangeInclusive<f64> = 0.5..=20_000.0;
/// Smallest zoom, and largest extent of the part in view in metres, when the camera begins to follow the head.
const FOLLOW_ZOOM: f64 = 4.0;
const FOLLOW_M: f64 = 30.0;
/// Step of an arrow key, as a share of the part in view.
const PAN_STEP: f64 = 0.1;
/// Free margin around the route, as a share of its size.
const MARGIN: f64 = 0.03;

/// The part of the plan in view, as the keys have set it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Camera {
    /// Whether the camera follows the head.
    pub(super) follows: bool,
    zoom: f64,
    /// Offset of the view's centre from the head if it is followed, else from the middle of the route, in metres.
    offset: DVec2,
}

/// A rectangle in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    pub(super) low: DVec2,
    pub(super) high: DVec2,
}

/// The part of the plan that fills an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Viewport {
    pub(super) extent: Extent,
    /// Width of a cell in metres. Its height is twice its width.
    pub(super) cell_m: f64,
    /// Vertical distance of two dots, in metres.
    pub(super) dot_m: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Self { follows: false, zoom: 1.0, offset: DVec2::ZERO }
    }
}

impl Camera {
    /// Handles a key, if the camera uses it. Returns whether it does.
    pub(super) fn press(&mut self, code: KeyCode, snapshot: &Snapshot) -> bool {
        match code {
            KeyCode::Char('f') => self.toggle_follow(snapshot),
            KeyCode::Char('0') => *self = Self::default(),
            KeyCode::Char('z' | ']') => self.zoom_by(ZOOM_STEP),
            KeyCode::Char('x' | '[') => self.zoom_by(1.0 / ZOOM_STEP),
            KeyCode::Left => self.pan(DVec2::NEG_X, snapshot),
            KeyCode::Right => self.pan(DVec2::X, snapshot),
            KeyCode::Up => self.pan(DVec2::Y, snapshot),
            KeyCode::Down => self.pan(DVec2::NEG_Y, snapshot),
            _ => return false,
        }
        true
    }

    /// Returns the part in view in an area of cells; `None` if the area or the snapshot is empty.
    pub(super) fn viewport(&self, area: Rect, glyphs: Glyphs, snapshot: &Snapshot) -> Option<Viewport> {
        let all = Extent::of(snapshot)?;
        if area.is_empty() {
            return None;
        }
        let size = (all.high - all.low) * (1.0 + 2.0 * MARGIN);
        let [across, up] = glyphs.dots().map(f64::from);
        // In cells, between the middles of the outermost dots, since the canvas puts its bounds there.
        let (columns, rows) = (f64::from(area.width) - 1.0 / across, f64::from(area.height) - 1.0 / up);
        let cell_m = (size.x / columns.max(0.5)).max(size.y / (2.0 * rows.max(0.5))).max(1e-6) / self.zoom;
        let half = 0.5 * DVec2::new(cell_m * columns, 2.0 * cell_m * rows);
        let centre = self.centre(&all, snapshot);
        let extent = Extent { low: centre - half, high: centre + half };
        Some(Viewport { extent, cell_m, dot_m: 2.0 * cell_m / up })
    }

    fn centre(&self, all: &Extent, snapshot: &Snapshot) -> DVec2 {
        let head = snapshot.frame.as_deref().and_then(head).filter(|_| self.follows);
        head.unwrap_or_else(|| all.middle()) + self.offset
    }

    /// Switches following on or off. When switched off, the camera stays where it is.
    fn toggle_follow(&mut self, snapshot: &Snapshot) {
        let all = Extent::of(snapshot);
        if self.follows {
            self.offset = all.map_or(DVec2::ZERO, |all| self.centre(&all, snapshot) - all.middle());
            self.follows = false;
        } else {
            let largest_m = all.map_or(0.0, |all| (all.high - all.low).max_element());
            let least = FOLLOW_ZOOM.max(largest_m / FOLLOW_M).min(*ZOOM.end());
            *self = Self { follows: true, zoom: self.zoom.max(least), offset: DVec2::ZERO };
        }
    }

    fn zoom_by(&mut self, factor: f64) {
        self.zoom = (self.zoom * factor).clamp(*ZOOM.start(), *ZOOM.end());
    }

    fn pan(&mut self, direction: DVec2, snapshot: &Snapshot) {
        if let Some(all) = Extent::of(snapshot) {
            let step_m = PAN_STEP * (all.high - all.low).max_element() / self.zoom;
            self.offset += direction * step_m;
        }
    }
}

impl Extent {
    /// The extent of the route and the stage, without the far part of a long run-up; without a description, the extent of the
    /// handles.
    pub(super) fn of(snapshot: &Snapshot) -> Option<Self> {
        match &snapshot.run {
            Some(run) => Self::around(run.view.into_iter()),
            None => Self::around(
                snapshot.frame.iter().flat_map(|frame| &frame.handles).map(|handle| handle.plan_view_m().into()),
            ),
        }
    }

    fn around(points: impl Iterator<Item = DVec2>) -> Option<Self> {
        points
            .filter(|point| point.is_finite())
            .map(|point| Self { low: point, high: point })
            .reduce(|one, other| Self { low: one.low.min(other.low), high: one.high.max(other.high) })
    }

    fn middle(&self) -> DVec2 {
        0.5 * (self.low + self.high)
    }

    /// Whether a circle may overlap the rectangle.
    pub(super) fn reaches(&self, centre: DVec2, radius_m: f64) -> bool {
        centre.cmpge(self.low - radius_m).all() && centre.cmple(self.high + radius_m).all()
    }
}

pub(super) fn head(frame: &FrameCopy) -> Option<DVec2> {
    frame.handles.first().map(|handle| handle.plan_view_m().into())
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::ShowState;

    use super::*;
    use crate::display::watch::sample::snapshot;

    #[test]
    fn both_axes_have_the_same_scale_and_all_of_the_route_is_in_view() {
        let snapshot = snapshot(ShowState::Running, 100.0);
        let all = Extent::of(&snapshot).expect("a run");
        for (glyphs, cell) in [(Glyphs::Braille, [2.0, 4.0]), (Glyphs::Blocks, [1.0, 2.0])] {
            for (width, height) in [(49, 21), (153, 57), (40, 7), (3, 30), (1, 1)] {
                let area = Rect::new(0, 0, width, height);
                let viewport = Camera::default().viewport(area, glyphs, &snapshot).expect("a viewport");
                let size = viewport.extent.high - viewport.extent.low;
                // Dots have the same distance across and up: a cell is twice as high as wide, and has twice as many dots up as
                // across.
                let across = f64::from(width) * cell[0] - 1.0;
                let up = f64::from(height) * cell[1] - 1.0;
                if across > 0.0 && up > 0.0 {
                    let ratio = (size.x / across) / (size.y / up);
                    assert!((ratio - 1.0).abs() < 1e-12, "{glyphs:?} {width} by {height}: {ratio}");
                }
                if width > 1 && height > 1 {
                    assert!(viewport.extent.low.cmple(all.low).all() && viewport.extent.high.cmpge(all.high).all());
                }
            }
        }
    }

    #[test]
    fn after_following_the_camera_stays_where_it_is() {
        let (before, after) = (snapshot(ShowState::Running, 100.0), snapshot(ShowState::Running, 130.0));
        let area = Rect::new(0, 0, 49, 21);
        let mut camera = Camera::default();
        camera.press(KeyCode::Char('f'), &before);
        let followed = camera.viewport(area, Glyphs::Braille, &before);
        camera.press(KeyCode::Char('f'), &before);
        assert_eq!(camera.viewport(area, Glyphs::Braille, &after), followed);
    }

    #[test]
    fn opposite_keys_of_zoom_and_arrows_restore_the_view() {
        let snapshot = snapshot(ShowState::Running, 100.0);
        let mut camera = Camera::default();
        for code in [KeyCode::Char('z'), KeyCode::Char(']'), KeyCode::Left, KeyCode::Up] {
            let before = camera;
            assert!(camera.press(code, &snapshot));
            assert_ne!(camera, before);
        }
        for code in [KeyCode::Right, KeyCode::Down, KeyCode::Char('x'), KeyCode::Char('[')] {
            camera.press(code, &snapshot);
        }
        assert!((camera.zoom - 1.0).abs() < 1e-12 && camera.offset.length() < 1e-12, "{camera:?}");
        (0..100).for_each(|_| assert!(camera.press(KeyCode::Char('z'), &snapshot)));
        assert_eq!(camera.zoom, *ZOOM.end());
        camera.press(KeyCode::Char('0'), &snapshot);
        assert_eq!(camera, Camera::default());
    }
}
