//! Derivatives of the first contact of two dragons, compared with differences of contacts that are searched anew.

mod common;

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use bench_dragon_geometry::clearance::first_between;
use bench_dragon_geometry::dragon::{Dimensions, Dragon};
use bench_dragon_geometry::formation::{Formation, Planned, Timetable};
use bench_dragon_geometry::ground::Ground;
use bench_dragon_geometry::planner::{MeetingParameter, Parameter, Setting, meeting_sensitivity};
use bench_dragon_geometry::route::{PathSegment, Placement, RouteShape, RouteSpec, SpiralSpec};
use glam::DVec2;
use test_support::hills::{hills_every, plane};

use common::{path, straight};

/// The plan of a dragon, and when it leaves.
#[derive(Clone)]
struct Plan {
    setting: Setting,
    start_s: f64,
}

impl Plan {
    fn of(route: RouteSpec, start_s: f64, speed_mps: f64, accel_mps2: Option<f64>) -> Self {
        let dimensions = Dimensions::new(6, 1.3, 0.9, 0.25, 0.1).expect("small benches");
        Self { setting: Setting { dimensions, route, speed_mps, accel_mps2 }, start_s }
    }

    fn planned(&self) -> Planned {
        let Setting { dimensions, route, speed_mps, accel_mps2 } = &self.setting;
        let curve = route.build(*speed_mps, dimensions.links_m()).expect("a valid route");
        let dragon = Dragon::new(*dimensions, Arc::new(curve)).expect("the dragon stands");
        let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let timetable = Timetable::leaving(self.start_s, start_m, *speed_mps, *accel_mps2, end_m);
        Planned { dragon: Arc::new(dragon), timetable }
    }

    fn changed(&self, parameter: MeetingParameter, by: f64) -> Self {
        match parameter {
            MeetingParameter::Start => Self { start_s: self.start_s + by, ..self.clone() },
            MeetingParameter::Plan(parameter) => {
                let setting = self.setting.with(parameter, self.setting.value(parameter) + by).expect("a small change");
                Self { setting, ..self.clone() }
            }
        }
    }
}

fn contact_s(plans: &[Plan; 2]) -> f64 {
    let formation = Formation::new(plans.iter().map(Plan::planned).collect());
    first_between(&formation, 0.0, 0.0, 60.0).expect("little work").expect("they meet").time_s
}

fn assert_derivatives(plans: &[Plan; 2]) {
    const STEP: f64 = 1e-5;
    let formation = Formation::new(plans.iter().map(Plan::planned).collect());
    let settings = plans.each_ref().map(|plan| plan.setting.clone());
    let found = meeting_sensitivity(&formation, &settings, [0.0, 60.0]).expect("little work").expect("they meet");
    assert!((found.meeting.time_s - contact_s(plans)).abs() < 1e-9);
    let has = |plan: &Plan| Parameter::ALL.into_iter().filter(|parameter| plan.setting.has(*parameter)).count();
    assert_eq!(found.rates.len(), 2 + has(&plans[0]) + has(&plans[1]));
    for rate in &found.rates {
        let moved = |by: f64| {
            let mut plans = plans.clone();
            plans[rate.dragon] = plans[rate.dragon].changed(rate.parameter, by);
            contact_s(&plans)
        };
        let expected = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
        let derivative = rate.derivative.expect("one pair touches");
        let (dragon, key) = (rate.dragon, rate.parameter.key());
        assert!(
            (derivative - expected).abs() < 1e-4 * (1.0 + expected.abs()),
            "{dragon} {key}: {derivative} is not {expected}"
        );
    }
}

#[test]
fn derivatives_of_a_contact_are_those_of_differences() {
    let slanted = |x_m: f64| straight(DVec2::new(x_m, -11.0), FRAC_PI_2 + 0.4, 40.0);
    let along = straight(DVec2::ZERO, 0.0, 40.0);
    assert_derivatives(&[Plan::of(along.clone(), 0.0, 1.0, None), Plan::of(slanted(17.5), 1.5, 0.9, Some(0.3))]);
    let bend = path(
        vec![
            PathSegment::Line { length_m: 4.0 },
            PathSegment::Arc { radius_m: 5.0, turn: 2.0 },
            PathSegment::Line { length_m: 20.0 },
        ],
        Placement { position: DVec2::new(2.0, -6.0), heading: 0.1 },
    );
    assert_derivatives(&[Plan::of(along, 0.7, 1.0, None), Plan::of(bend, 0.0, 1.2, None)]);
    let spiral = RouteSpec {
        shape: RouteShape::Spiral(SpiralSpec { pitch_m: 1.6, start_turns: 3.0 }),
        placement: Placement { position: DVec2::new(9.0, 1.0), heading: 0.3 },
        start_s: 0.0,
        end_s: None,
        ground: None,
    };
    assert_derivatives(&[Plan::of(spiral, 0.0, 0.8, None), Plan::of(slanted(15.0), 0.0, 1.0, Some(0.5))]);
}

#[test]
fn derivatives_of_a_contact_on_ground_are_those_of_differences() {
    for ground in [plane(0.35, -0.2), Ground::map(hills_every(5.0, [0.4, 1.3, 2.9], 0.3))] {
        let ground = Some(Arc::new(ground));
        let slanted = straight(DVec2::new(15.0, -11.0), FRAC_PI_2 + 0.4, 40.0);
        let spiral = RouteSpec {
            shape: RouteShape::Spiral(SpiralSpec { pitch_m: 1.6, start_turns: 3.0 }),
            placement: Placement { position: DVec2::new(9.0, 1.0), heading: 0.3 },
            start_s: 0.0,
            end_s: None,
            ground: ground.clone(),
        };
        let slanted = RouteSpec { ground, ..slanted };
        assert_derivatives(&[Plan::of(spiral, 0.0, 0.8, None), Plan::of(slanted, 0.0, 1.0, Some(0.5))]);
    }
}

#[test]
fn dragons_that_do_not_meet_have_no_sensitivity() {
    let apart = [straight(DVec2::ZERO, 0.0, 9.0), straight(DVec2::new(0.0, 5.0), 0.0, 9.0)];
    let plans = apart.map(|route| Plan::of(route, 0.0, 1.0, None));
    let formation = Formation::new(plans.iter().map(Plan::planned).collect());
    let settings = plans.each_ref().map(|plan| plan.setting.clone());
    assert_eq!(meeting_sensitivity(&formation, &settings, [0.0, 20.0]), Ok(None));
}
