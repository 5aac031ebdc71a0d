//! The stage: its outline, areas that no board may enter, and the line that people stand behind.

mod border;
mod edge;
mod outline;

use glam::DVec2;

pub(crate) use edge::{Edge, GRAZE_M};

pub use border::{Border, BorderKind};
pub use outline::{Outline, OutlineError};

/// The borders of a stage, and the distance that boards should keep from them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stage {
    borders: Vec<Border>,
    clear_m: f64,
}

impl Stage {
    /// A stage with these borders, from which boards should keep `clear_m`, 0 or more.
    ///
    /// # Panics
    /// Panics for a distance that is negative or not finite.
    pub fn new(mut borders: Vec<Border>, clear_m: f64) -> Self {
        assert!(clear_m >= 0.0 && clear_m.is_finite(), "a distance from borders");
        borders.sort_by_key(Border::kind);
        Self { borders, clear_m }
    }

    /// All borders: the outline, the areas to keep out of, and the line of the crowd.
    pub fn borders(&self) -> &[Border] {
        &self.borders
    }

    /// Distance that boards should keep from all borders, in metres.
    pub fn clear_m(&self) -> f64 {
        self.clear_m
    }

    /// The outline, if there is one.
    pub fn outline(&self) -> Option<&Border> {
        self.of_kind(BorderKind::Outline).first()
    }

    /// The line that people stand behind, if there is one.
    pub fn crowd(&self) -> Option<&Border> {
        self.of_kind(BorderKind::Crowd).first()
    }

    /// The areas to keep out of, in the given order.
    pub fn keep_out(&self) -> &[Border] {
        self.of_kind(BorderKind::KeepOut)
    }

    /// The borders of a kind. The first of them has the index [`first_of`](Self::first_of) among all.
    pub fn of_kind(&self, kind: BorderKind) -> &[Border] {
        let end = self.borders.partition_point(|border| border.kind() <= kind);
        &self.borders[self.first_of(kind)..end]
    }

    /// The index of the first border of a kind.
    pub fn first_of(&self, kind: BorderKind) -> usize {
        self.borders.partition_point(|border| border.kind() < kind)
    }

    /// The name of the border that is nearest to a point, if there is one.
    pub fn nearest(&self, point: DVec2) -> Option<String> {
        let distances_m = self.borders.iter().map(|border| border.point_distance_m(point)).enumerate();
        let nearest = distances_m.min_by(|one, other| one.1.total_cmp(&other.1));
        nearest.map(|(border, _)| self.name(border))
    }

    /// A border as messages call it: by its key, and of several areas by its number from 1.
    pub fn name(&self, border: usize) -> String {
        match self.borders[border].kind() {
            BorderKind::Outline => "outline".to_owned(),
            BorderKind::KeepOut => format!("keep_out area {}", border - self.first_of(BorderKind::KeepOut) + 1),
            BorderKind::Crowd => "crowd".to_owned(),
        }
    }
}
