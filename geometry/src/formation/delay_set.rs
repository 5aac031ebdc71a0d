//! Sets of delays: by how much one dragon leaves after another.

/// Intervals of delays in seconds, in order, with gaps between them. An end may be infinite.
///
/// ```
/// use bench_dragon_geometry::formation::DelaySet;
///
/// let mut delays = DelaySet::default();
/// delays.insert([2.0, 5.0]);
/// delays.insert([8.0, f64::INFINITY]);
/// assert_eq!((delays.next_outside(3.0), delays.last_outside(3.0)), (5.0, 2.0));
/// assert_eq!((delays.next_outside(9.0), delays.next_outside(6.0)), (f64::INFINITY, 6.0));
/// delays.insert([4.0, 8.0]);
/// assert_eq!(delays.intervals(), [[2.0, f64::INFINITY]]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DelaySet(Vec<[f64; 2]>);

impl DelaySet {
    /// The intervals, in order.
    pub fn intervals(&self) -> &[[f64; 2]] {
        &self.0
    }

    /// Whether the set has no delay.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether the set has every delay.
    pub fn is_all(&self) -> bool {
        self.0 == [[f64::NEG_INFINITY, f64::INFINITY]]
    }

    /// Adds an interval, and joins it with those that it meets.
    pub fn insert(&mut self, [low, high]: [f64; 2]) {
        let first = self.0.partition_point(|interval| interval[1] < low);
        let end = self.0.partition_point(|interval| interval[0] <= high);
        let joined = self.0[first..end]
            .iter()
            .fold([low, high], |joined, interval| [joined[0].min(interval[0]), joined[1].max(interval[1])]);
        self.0.splice(first..end, [joined]);
    }

    /// Adds all intervals of another set.
    pub fn extend(&mut self, other: &Self) {
        for interval in &other.0 {
            self.insert(*interval);
        }
    }

    /// Adds the gaps that are shorter than `least_s`.
    pub(crate) fn close_gaps(&mut self, least_s: f64) {
        self.0.dedup_by(|next, before| {
            let is_short = next[0] - before[1] < least_s;
            if is_short {
                before[1] = next[1];
            }
            is_short
        });
    }

    /// The set for the other dragon: by how much it leaves after this one.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self(self.0.iter().rev().map(|[low, high]| [-high, -low]).collect())
    }

    /// The interval that has a delay, ends included.
    pub fn around(&self, delay_s: f64) -> Option<[f64; 2]> {
        let first = self.0.partition_point(|interval| interval[1] < delay_s);
        self.0.get(first).copied().filter(|interval| interval[0] <= delay_s)
    }

    /// Whether one interval has all delays between two.
    pub fn covers(&self, [low, high]: [f64; 2]) -> bool {
        self.around(low).is_some_and(|interval| interval[1] >= high)
    }

    /// The least delay from `delay_s` on that is not inside an interval: infinite if there is none. The end of an interval is
    /// not inside it.
    pub fn next_outside(&self, delay_s: f64) -> f64 {
        let inside = self.0.iter().find(|interval| interval[0] < delay_s && delay_s < interval[1]);
        inside.map_or(delay_s, |interval| interval[1])
    }

    /// The greatest delay up to `delay_s` that is not inside an interval: −∞ if there is none.
    pub fn last_outside(&self, delay_s: f64) -> f64 {
        -self.reversed().next_outside(-delay_s)
    }

    /// The delays between which `delay_s` may change without entering an interval.
    pub fn gap_around(&self, delay_s: f64) -> [f64; 2] {
        let below = self.0.iter().rev().find(|interval| interval[1] <= delay_s);
        let above = self.0.iter().find(|interval| interval[0] >= delay_s);
        [below.map_or(f64::NEG_INFINITY, |interval| interval[1]), above.map_or(f64::INFINITY, |interval| interval[0])]
    }
}
