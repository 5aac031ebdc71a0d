//! Strides after which the body repeats earlier positions, so that the chain is not solved anew at each.
//!
//! All body links are alike: the handles behind a handle depend only on its parameter, whichever body handle it is. If handle 2
//! is where handle 1 was at an earlier pose, then each handle from 2 on is where the handle before it was. So a stride ends
//! where handle 2 reaches handle 1 of one of the latest poses, in turn. A stride takes two searches for a front handle, for any
//! number of benches.
//!
//! The places are exact to about 10⁻¹² m for each link that the dragon has walked. They serve to rule out pairs. Pairs that may
//! be near are placed by the chain rule again.

use std::collections::VecDeque;

use glam::DVec2;

use super::pose::Pose;
use super::stride_extent::{StrideExtent, WalkedArc};
use crate::dragon::{Dimensions, Dragon};

/// Bound on the error of a place, in metres.
const ERROR_M: f64 = 1e-5;

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
    /// The places of handle 1 and all behind it at the latest poses. At each, handle 1 is ahead of handle 2 of the last.
    bodies: VecDeque<VecDeque<Place>>,
    /// Parameters of the head and of handle 1 at the latest pose.
    leaders: [f64; 2],
    /// Parameters of handles 1 and 2 at the end of the run, if they were calculated.
    end: Option<[f64; 2]>,
    earlier: Stand,
    later: Stand,
}

/// All handles at one pose.
#[derive(Clone, Debug, Default)]
struct Stand(Vec<Place>);

impl Stand {
    fn set(&mut self, places: impl Iterator<Item = Place>) {
        self.0.clear();
        self.0.extend(places);
    }

    /// Sets the head and all handles behind it.
    fn set_body(&mut self, head: Place, body: &VecDeque<Place>) {
        let (front, rear) = body.as_slices();
        self.0.clear();
        self.0.push(head);
        self.0.extend_from_slice(front);
        self.0.extend_from_slice(rear);
    }

    fn benches(&self) -> usize {
        self.0.len() - 1
    }

    /// The middle of a link.
    fn centre(&self, bench: usize) -> DVec2 {
        0.5 * (self.0[bench].position + self.0[bench + 1].position)
    }

    /// How far a handle walks up to a later pose.
    fn walked_m(&self, later: &Self, handle: usize) -> f64 {
        later.0[handle].travel_m - self.0[handle].travel_m
    }

    /// The longest way of a handle up to a later pose.
    fn longest_walked_m(&self, later: &Self) -> f64 {
        self.0.iter().zip(&later.0).map(|(from, to)| to.travel_m - from.travel_m).fold(0.0, f64::max)
    }

    /// Where a bench may be up to a later pose.
    fn extent(&self, later: &Self, dragon: &Dragon, bench: usize) -> StrideExtent {
        let arc = |handle: usize| {
            let ends = [self, later].map(|stand| stand.0[handle].position);
            WalkedArc::new(ends, self.walked_m(later, handle) + 4.0 * ERROR_M)
        };
        StrideExtent::new(dragon, bench, [arc(bench), arc(bench + 1)])
    }
}

impl RepeatedWalk {
    /// Forgets all poses.
    pub(super) fn clear(&mut self) {
        self.bodies.clear();
    }

    /// Adds a pose with all its handles, later than the others.
    pub(super) fn add(&mut self, pose: &Pose) {
        self.stand(pose);
        self.advance();
        let last = pose.handles[2].parameter;
        self.bodies.retain(|body| body[0].parameter > last);
        self.bodies.push_back(places(pose).skip(1).collect());
    }

    /// Walks the next stride after which the body repeats. Returns the head's travel there; `None`, without a stride, if that
    /// is beyond `to_m`.
    pub(super) fn stride(&mut self, dragon: &Dragon, to_m: f64) -> Option<f64> {
        let [end, led_end] = *self.end.get_or_insert_with(|| {
            let mut chain = dragon.chain(dragon.end_travel_m()).expect("the run's end is in it").skip(1);
            [(); 2].map(|()| chain.next().expect("every handle has a position throughout the run").parameter)
        });
        let led = self.bodies.front()?[0].parameter;
        if led > led_end {
            return None;
        }
        let [head_begin, begin] = self.leaders;
        let arc_m = |bench: usize| self.earlier.0[bench].travel_m - self.earlier.0[bench + 1].travel_m;
        let (parameter, _) = dragon.front_near(1, led, [begin, end], arc_m(1));
        let (head_parameter, _) = dragon.front_near(0, parameter, [head_begin, dragon.end_parameter()], arc_m(0));
        let head = Place::at(dragon, head_parameter);
        if head.travel_m > to_m {
            return None;
        }
        self.leaders = [head_parameter, parameter];
        let mut body = self.bodies.pop_front()?;
        body.pop_back();
        body.push_front(Place::at(dragon, parameter));
        self.later.set_body(head, &body);
        self.bodies.push_back(body);
        Some(head.travel_m)
    }

    /// Stands at a pose with all its handles, which does not repeat an earlier one.
    pub(super) fn stand(&mut self, pose: &Pose) {
        self.leaders = [0, 1].map(|handle: usize| pose.handles[handle].parameter);
        self.later.set(places(pose));
    }

    /// Makes the later pose the earlier one.
    pub(super) fn advance(&mut self) {
        std::mem::swap(&mut self.earlier, &mut self.later);
    }

    /// Replaces `pairs` by those pairs with a leading bench that may come within a clearance between the earlier and the later
    /// pose.
    ///
    /// The middles of two links behind each other are at most a link apart. So benches far behind one that is far away are passed over.
    pub(super) fn find_pairs(&self, dragon: &Dragon, clearance_m: f64, pairs: &mut Vec<[usize; 2]>) {
        let Self { earlier, later, .. } = self;
        let radius_m = |bench: usize| dragon.board_radius_m(bench) + 4.0 * ERROR_M;
        let (link_m, walked_m) = (dragon.dimensions().link_m(1), earlier.longest_walked_m(later));
        pairs.clear();
        for first in 0..Dimensions::LEADING.min(earlier.benches()) {
            let (centre, extent) = (earlier.centre(first), earlier.extent(later, dragon, first));
            let far_m = clearance_m + radius_m(first) + radius_m(1) + 2.0 * walked_m;
            let mut partners = Dimensions::partners(first, earlier.benches());
            while let Some(second) = partners.next() {
                let beyond_m = centre.distance(earlier.centre(second)) - far_m;
                if beyond_m > 0.0 {
                    partners.start += (beyond_m / link_m) as usize;
                } else if !extent.stays_apart(&earlier.extent(later, dragon, second), clearance_m) {
                    pairs.push([first, second]);
                }
            }
        }
    }
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
