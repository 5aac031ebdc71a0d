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
    /// How far the boards reach from their centres at the earlier pose, up to the later one.
    reaches_m: Vec<f64>,
}

/// All benches at one pose.
#[derive(Clone, Debug, Default)]
struct Stand {
    centres: Vec<DVec2>,
    /// Travels of the handles.
    travels_m: Vec<f64>,
}

impl Stand {
    fn set(&mut self, places: impl Iterator<Item = Place>) {
        self.centres.clear();
        self.travels_m.clear();
        let mut front: Option<DVec2> = None;
        for Place { position, travel_m, .. } in places {
            self.centres.extend(front.map(|front| 0.5 * (front + position)));
            self.travels_m.push(travel_m);
            front = Some(position);
        }
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
        let (parameter, _) = dragon.front_before(1, led, [begin, end]);
        let (head_parameter, _) = dragon.front_before(0, parameter, [head_begin, dragon.end_parameter()]);
        let head = Place::at(dragon, head_parameter);
        if head.travel_m > to_m {
            return None;
        }
        self.leaders = [head_parameter, parameter];
        let mut body = self.bodies.pop_front()?;
        body.pop_back();
        body.push_front(Place::at(dragon, parameter));
        self.later.set(std::iter::once(head).chain(body.iter().copied()));
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
    pub(super) fn find_pairs(&mut self, dragon: &Dragon, clearance_m: f64, pairs: &mut Vec<[usize; 2]>) {
        let Self { earlier, later, reaches_m, .. } = self;
        let radii_m = [0, 1].map(|bench| dragon.board_radius_m(bench) + 2.0 * ERROR_M);
        let walked_m = |handle: usize| later.travels_m[handle] - earlier.travels_m[handle];
        reaches_m.clear();
        reaches_m.extend(
            (0..earlier.centres.len()).map(|bench| radii_m[bench.min(1)] + walked_m(bench).max(walked_m(bench + 1))),
        );
        let meet = |&[first, second]: &[usize; 2]| {
            let far_m = clearance_m + reaches_m[first] + reaches_m[second];
            earlier.centres[first].distance_squared(earlier.centres[second]) <= far_m * far_m
        };
        pairs.clear();
        pairs.extend(Dimensions::leading_pairs(earlier.centres.len()).filter(meet));
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
