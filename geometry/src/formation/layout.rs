//! The numbers of benches and handles, dragon after dragon.
//!
//! Benches are numbered on from dragon to dragon, and so are handles. A dragon of N benches has N + 1 handles, so handle i of a
//! formation is not the front handle of bench i from the second dragon on.

use std::ops::Range;
use std::sync::Arc;

/// Which benches and handles belong to which dragon of a formation.
///
/// ```
/// use bench_dragon_geometry::formation::Layout;
///
/// let layout = Layout::of([223, 66]);
/// assert_eq!((layout.benches(), layout.handles()), (289, 291));
/// assert_eq!((layout.benches_of(1), layout.handles_of(1)), (223..289, 224..291));
/// assert_eq!(layout.place(223), (1, 0));
/// // Two benches of one dragon that share a hinge are not a pair. The tail of one dragon and the head of the next are.
/// assert!(!layout.is_pair(221, 222) && layout.is_pair(222, 223));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// The first bench of each dragon but the first one.
    heads: Arc<[usize]>,
    /// The dragon of each bench, of several dragons.
    dragons: Arc<[u8]>,
    benches: usize,
    /// Whether only benches of two dragons are pairs.
    is_between: bool,
}

impl Layout {
    /// The layout of dragons of these numbers of benches, of which none is 0.
    pub fn of(benches: impl IntoIterator<Item = usize>) -> Self {
        let (mut heads, mut dragons, mut all) = (Vec::new(), Vec::new(), 0);
        for (dragon, count) in (0_u8..).zip(benches) {
            heads.extend((all > 0).then_some(all));
            all += count;
            dragons.resize(all, dragon);
        }
        let dragons = if heads.is_empty() { [].into() } else { dragons.into() };
        Self { heads: heads.into(), dragons, benches: all, is_between: false }
    }

    /// The same layout, in which only benches of two dragons form a pair.
    pub(crate) fn between_dragons(&self) -> Self {
        Self { is_between: true, ..self.clone() }
    }

    /// Number of benches of all dragons.
    pub fn benches(&self) -> usize {
        self.benches
    }

    /// Number of handles of all dragons: one more than benches for each dragon.
    pub fn handles(&self) -> usize {
        self.benches + self.dragons()
    }

    /// Number of dragons.
    pub fn dragons(&self) -> usize {
        self.heads.len() + 1
    }

    /// The benches of a dragon.
    pub fn benches_of(&self, dragon: usize) -> Range<usize> {
        let begin = if dragon == 0 { 0 } else { self.heads[dragon - 1] };
        begin..self.heads.get(dragon).copied().unwrap_or(self.benches)
    }

    /// The handles of a dragon.
    pub fn handles_of(&self, dragon: usize) -> Range<usize> {
        let Range { start, end } = self.benches_of(dragon);
        start + dragon..end + dragon + 1
    }

    /// The dragon of a bench, and the index of the bench within it.
    pub fn place(&self, bench: usize) -> (usize, usize) {
        let dragon = self.heads.partition_point(|&head| head <= bench);
        (dragon, bench - self.benches_of(dragon).start)
    }

    /// The pair of the lowest indices, among the first `benches` benches; `None` if these form no pair.
    pub(crate) fn first_pair(&self, benches: usize) -> Option<[usize; 2]> {
        let second = (1..benches).find(|&other| self.is_pair(0, other))?;
        Some([0, second])
    }

    /// Whether two benches form a pair, whose clearance counts. Neighbours on a hinge do not.
    #[inline]
    pub fn is_pair(&self, one: usize, other: usize) -> bool {
        let is_apart = !self.is_between && one.abs_diff(other) > 1;
        is_apart || (!self.dragons.is_empty() && self.dragons[one] != self.dragons[other])
    }
}
