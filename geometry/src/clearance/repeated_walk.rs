//! Strides after which the body repeats earlier positions, so that the chain is not solved anew at each.
//!
//! All body links are alike: the handles behind a handle depend only on its parameter, whichever body handle it is. If handle 2
//! is where handle 1 was at an earlier pose, then each handle from 2 on is where the handle before it was. So a stride ends
//! where handle 2 reaches handle 1 of one of the latest poses, in turn. A stride takes two searches for a front handle, for any
//! number of benches.
//!
//! Where nothing has been near for a link of the way, a stride ends where handle 2 reaches handle 1 of the pose at which it begins: it is
//! as long as a link. The other poses are left behind. Each is brought up when its turn comes again, by one search for a front handle
//! for each link that it missed, or replaced if it missed many. So long strides that have to end early cost little.
//!
//! The places are exact to about 10⁻¹² m for each link that the dragon has walked. They serve to rule out pairs. Pairs that may
//! be near are placed by the chain rule again.

use std::collections::VecDeque;

use glam::DVec2;

use super::pose::Pose;
use super::stride_extent::{PLACE_ERROR_M, StrideExtent, WalkedArc, is_kept_apart};
use crate::dragon::chain::Handle;
use crate::dragon::{Dimensions, Dragon};

/// Shortest way of handle 1 from a body that is kept to the next one, in lengths of a link.
const LEAST_LINKS: f64 = 0.125;
/// Handles of a chain that are solved in the time of one search for a front handle.
const HANDLES_PER_FRONT: f64 = 16.0;

/// Where a handle is or was.
#[derive(Clone, Copy, Debug)]
struct Place {
    parameter: f64,
    position: DVec2,
    travel_m: f64,
}

/// A walk in strides after which the body repeats.
#[derive(Clone, Debug, Default)]
pub(super) struct RepeatedWalk {
    /// The places of handle 1 and all behind it at some of the last poses, in their order. Handle 1 of each is ahead of handle 2 of the one
    /// before it, and of the last pose unless long strides left it behind.
    bodies: VecDeque<VecDeque<Place>>,
    /// Parameters of handles 1 and 2 at the end of the run, if they were calculated.
    end: Option<[f64; 2]>,
    earlier: Stand,
    later: Stand,
    /// Number of strides without a pair since the last one with a pair.
    quiet: usize,
}

/// All handles at one pose.
#[derive(Clone, Debug, Default)]
struct Stand(Vec<Place>);

impl Stand {
    fn set(&mut self, places: impl Iterator<Item = Place>) {
        self.0.clear();
        self.0.extend(places);
    }

    /// Sets the first two handles, and behind them those of a body but its last one.
    fn set_behind(&mut self, leading: [Place; 2], body: &VecDeque<Place>) {
        let (front, rear) = body.as_slices();
        self.0.clear();
        self.0.extend(leading);
        self.0.extend_from_slice(front);
        self.0.extend_from_slice(rear);
        self.0.pop();
    }

    fn benches(&self) -> usize {
        self.0.len() - 1
    }

    /// The middle of a link.
    fn centre(&self, bench: usize) -> DVec2 {
        0.5 * (self.0[bench].position + self.0[bench + 1].position)
    }

    /// Length of the route between the handles of a bench.
    fn arc_m(&self, bench: usize) -> f64 {
        self.0[bench].travel_m - self.0[bench + 1].travel_m
    }

    /// How far a handle walks up to a later pose.
    fn walked_m(&self, later: &Self, handle: usize) -> f64 {
        later.0[handle].travel_m - self.0[handle].travel_m
    }

    /// The longest way of a handle up to a later pose.
    fn longest_walked_m(&self, later: &Self) -> f64 {
        self.0.iter().zip(&later.0).map(|(from, to)| to.travel_m - from.travel_m).fold(0.0, f64::max)
    }

    /// Where a handle may be up to a later pose.
    fn arc(&self, later: &Self, handle: usize) -> WalkedArc {
        let ends = [self, later].map(|stand| stand.0[handle].position);
        WalkedArc::new(ends, self.walked_m(later, handle) + 4.0 * PLACE_ERROR_M)
    }

    /// Where a bench may be up to a later pose.
    fn extent(&self, later: &Self, dragon: &Dragon, bench: usize) -> StrideExtent {
        StrideExtent::new(dragon, bench, [bench, bench + 1].map(|handle| self.arc(later, handle)))
    }

    /// Whether two benches are proved to stay further apart than a clearance up to a later pose, by the links between them.
    fn keeps_apart(&self, later: &Self, dragon: &Dragon, benches: [usize; 2], clearance_m: f64) -> bool {
        !dragon.route().is_on_ground() && is_kept_apart(dragon, benches, |handle| self.arc(later, handle), clearance_m)
    }
}

impl RepeatedWalk {
    /// Forgets all poses.
    pub(super) fn clear(&mut self) {
        self.bodies.clear();
        self.quiet = 0;
    }

    /// Whether no pose is known.
    pub(super) fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// Adds a pose with all its handles, later than the others. Of poses that are very close, the first one is enough.
    pub(super) fn add(&mut self, dragon: &Dragon, pose: &Pose) {
        self.earlier.set(places(pose));
        let last = pose.handles[2].parameter;
        self.bodies.retain(|body| body[0].parameter > last);
        let since_m = self.bodies.back().map_or(f64::INFINITY, |body| pose.handle_travels_m[1] - body[0].travel_m);
        if since_m >= LEAST_LINKS * dragon.dimensions().link_m(1) {
            self.bodies.push_back(places(pose).skip(1).collect());
        }
    }

    /// Walks the next stride after which the body repeats, and replaces `pairs` by those pairs with a leading bench that may come within
    /// a clearance on it. Returns the head's travel there; `None`, without a stride, if that is beyond `to_m`.
    pub(super) fn stride(
        &mut self,
        dragon: &Dragon,
        clearance_m: f64,
        to_m: f64,
        pairs: &mut Vec<[usize; 2]>,
    ) -> Option<f64> {
        let latest = self.bodies.len().checked_sub(1)?;
        if self.quiet > latest {
            if let Some(travel_m) = self.look(dragon, latest, to_m) {
                self.find_pairs(dragon, clearance_m, pairs);
                if pairs.is_empty() {
                    self.advance(latest);
                    return Some(travel_m);
                }
            }
            self.quiet = 0;
        }
        self.bring_up(dragon);
        let travel_m = self.look(dragon, 0, to_m)?;
        self.find_pairs(dragon, clearance_m, pairs);
        self.quiet = if pairs.is_empty() { self.quiet + 1 } else { 0 };
        self.advance(0);
        Some(travel_m)
    }

    /// Walks to a pose with all its handles, before the next one after which the body repeats. Replaces `pairs` as
    /// [`stride`](Self::stride) does.
    pub(super) fn walk_to(&mut self, dragon: &Dragon, pose: &Pose, clearance_m: f64, pairs: &mut Vec<[usize; 2]>) {
        self.later.set(places(pose));
        self.find_pairs(dragon, clearance_m, pairs);
        std::mem::swap(&mut self.earlier, &mut self.later);
    }

    /// Sets the later pose: that at which handle 2 is where handle 1 of a body is. Returns the head's travel, at most `to_m`.
    fn look(&mut self, dragon: &Dragon, body: usize, to_m: f64) -> Option<f64> {
        let led = self.bodies.get(body)?[0].parameter;
        let [head, front] = [0, 1].map(|handle: usize| self.earlier.0[handle].parameter);
        let front = self.front_before(dragon, led, front)?;
        let (head, _) = dragon.front_near(0, front.parameter, [head, dragon.end_parameter()], self.earlier.arc_m(0));
        let head = Place::at(dragon, head);
        if head.travel_m > to_m {
            return None;
        }
        self.later.set_behind([head, front], &self.bodies[body]);
        Some(head.travel_m)
    }

    /// Where handle 1 is when handle 2 is at `led`. It passes `begin` earlier. `None` if the run ends before.
    fn front_before(&mut self, dragon: &Dragon, led: f64, begin: f64) -> Option<Place> {
        let [end, led_end] = *self.end.get_or_insert_with(|| {
            let mut chain = dragon.chain(dragon.end_travel_m()).expect("the run's end is in it").skip(1);
            [(); 2].map(|()| chain.next().expect("every handle has a position throughout the run").parameter)
        });
        if led > led_end {
            return None;
        }
        let (parameter, _) = dragon.front_near(1, led, [begin, end], self.earlier.arc_m(1));
        Some(Place::at(dragon, parameter))
    }

    /// Brings up the first body, if it is left behind, until its handle 1 is ahead of handle 2 of the last pose. A body that missed many
    /// links is replaced by a new one.
    fn bring_up(&mut self, dragon: &Dragon) {
        let last = self.earlier.0[2];
        let behind = self.bodies.iter().take_while(|body| body[0].parameter <= last.parameter).count();
        if behind == 0 {
            return;
        }
        let missed = (last.travel_m - self.bodies[0][0].travel_m) / dragon.dimensions().link_m(1);
        if missed > dragon.dimensions().benches() as f64 / HANDLES_PER_FRONT {
            // Those left behind are then spread evenly before the next body.
            let next = self.bodies.get(behind).map_or(self.earlier.0[1], |body| body[0]);
            let ahead = (next.parameter - last.parameter) / (behind + 1) as f64;
            self.bodies[0] = body_behind(dragon, last.parameter + ahead);
        }
        while let Some(led) = self.bodies.front().map(|body| body[0].parameter)
            && led <= last.parameter
            && let Some(front) = self.front_before(dragon, led, led)
        {
            let body = &mut self.bodies[0];
            body.pop_back();
            body.push_front(front);
        }
    }

    /// Makes the later pose the earlier one, and the body that it repeats the last one.
    fn advance(&mut self, body: usize) {
        let mut body = self.bodies.remove(body).expect("the pose repeats a body");
        body.pop_back();
        body.push_front(self.later.0[1]);
        self.bodies.push_back(body);
        std::mem::swap(&mut self.earlier, &mut self.later);
    }

    /// Replaces `pairs` by those pairs with a leading bench that may come within a clearance between the earlier and the later
    /// pose.
    ///
    /// The middles of two links behind each other are at most a link apart. So benches far behind one that is far away are passed over.
    fn find_pairs(&self, dragon: &Dragon, clearance_m: f64, pairs: &mut Vec<[usize; 2]>) {
        let Self { earlier, later, .. } = self;
        let radius_m = |bench: usize| dragon.board_radius_m(bench) + 4.0 * PLACE_ERROR_M;
        let (link_m, walked_m) = (dragon.dimensions().link_m(1), earlier.longest_walked_m(later));
        dragon.meter().add(dragon.dimensions().benches() as u64);
        pairs.clear();
        for first in 0..Dimensions::LEADING.min(earlier.benches()) {
            let (centre, extent) = (earlier.centre(first), earlier.extent(later, dragon, first));
            let far_m = clearance_m + radius_m(first) + radius_m(1) + 2.0 * walked_m;
            let mut partners = Dimensions::partners(first, earlier.benches());
            while let Some(second) = partners.next() {
                let beyond_m = centre.distance(earlier.centre(second)) - far_m;
                if beyond_m > 0.0 {
                    partners.start += (beyond_m / link_m) as usize;
                } else if !extent.stays_apart(&earlier.extent(later, dragon, second), clearance_m)
                    && !earlier.keeps_apart(later, dragon, [first, second], clearance_m)
                {
                    pairs.push([first, second]);
                }
            }
        }
    }
}

/// Handle 1 at a parameter, and all behind it.
fn body_behind(dragon: &Dragon, parameter: f64) -> VecDeque<Place> {
    let front = Handle::new(parameter, dragon.route().point(parameter), 1.0);
    let behind = dragon.chain_behind(1, &front).map(|handle| Place {
        parameter: handle.parameter,
        position: handle.position,
        travel_m: dragon.route().travel(handle.parameter),
    });
    std::iter::once(Place::at(dragon, parameter)).chain(behind).collect()
}

fn places(pose: &Pose) -> impl Iterator<Item = Place> {
    let travels_m = pose.handle_travels_m.iter();
    pose.handles.iter().zip(travels_m).map(|(handle, &travel_m)| Place {
        parameter: handle.parameter,
        position: handle.position,
        travel_m,
    })
}

impl Place {
    fn at(dragon: &Dragon, parameter: f64) -> Self {
        let route = dragon.route();
        Self { parameter, position: route.point(parameter).position, travel_m: route.travel(parameter) }
    }
}
