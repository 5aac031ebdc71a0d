//! Where the show is, how near the benches are, and whether they will touch.

use bench_dragon_ipc::{FrameHeader, ShowState};
use prometheus::proto::MetricFamily;

use super::family::{gauge, gauges};
use crate::display::observe::{GuardSituation, Outlook, Scene};

/// The metrics of the show.
pub(super) fn families(scene: &Scene) -> Vec<MetricFamily> {
    let header = scene.frame.as_ref().map(|still| &still.header);
    [motion(header), clearance(scene), outlook(scene, header), guard(scene)].concat()
}

fn motion(header: Option<&FrameHeader>) -> Vec<MetricFamily> {
    let of = |value: fn(&FrameHeader) -> f64| header.map(value);
    let states = header.into_iter().flat_map(|header| {
        let is_now = |state| f64::from(u8::from(header.show_state() == Some(state)));
        ShowState::ALL.map(|state| (vec![("state", state.name())], is_now(state)))
    });
    vec![
        gauges("show_state", "1 for the state that the show is in, 0 for the others.", states),
        gauge("show_time_seconds", "Show time of the last frame.", of(FrameHeader::sim_time_s)),
        gauge("time_scale_ratio", "Show seconds a second of wall time.", of(|header| header.time_scale)),
        gauge(
            "head_speed_meters_per_second",
            "Speed of the head in metres a show second; 0 where it stands.",
            of(|header| header.head_speed_mps),
        ),
        gauge(
            "head_travel_meters",
            "Arc length that the head has walked since show time 0.",
            of(|header| header.head_travel_m),
        ),
        gauge("benches", "Benches of the dragon.", of(|header| header.bench_count.into())),
    ]
}

/// The guard's situation, where a guard is waited for.
fn guard(scene: &Scene) -> Vec<MetricFamily> {
    let all = ["waiting", "working", "at_end", "missing"];
    let is_guarded = scene.guard != GuardSituation::None;
    let samples = all
        .into_iter()
        .filter(|_| is_guarded)
        .map(|name| (vec![("situation", name)], f64::from(u8::from(scene.guard.name() == name))));
    vec![gauges(
        "guard_situation",
        "1 for what the guard of a guarded show does, 0 for the others; missing where none runs.",
        samples,
    )]
}

fn clearance(scene: &Scene) -> Vec<MetricFamily> {
    vec![
        gauge(
            "clearance_meters",
            "Clearance of the nearest pair of benches, neighbours left out; negative where they overlap.",
            scene.nearest.map(|pair| pair.clearance_m),
        ),
        gauge(
            "least_clearance_meters",
            "Least clearance that this process has seen in this show, also before a restart of its server. It looks some times a second; alerts are the monitor's, \
             which misses nothing.",
            scene.least.map(|(clearance_m, _)| clearance_m),
        ),
    ]
}

fn outlook(scene: &Scene, header: Option<&FrameHeader>) -> Vec<MetricFamily> {
    let contact_s = scene.outlook.contact_s();
    let remaining_s = contact_s.zip(header).map(|(contact_s, header)| contact_s - header.sim_time_s());
    let wall_s = scene.outlook.arrival().map(|at| at.wall_s);
    let free_s = match scene.outlook {
        Outlook::Free { to, .. } => Some(to.time_s),
        Outlook::Unknown | Outlook::Contact { .. } | Outlook::GuardStop { .. } | Outlook::Rest { .. } => None,
    };
    vec![
        gauge(
            "forecast_contact_time_seconds",
            "Show time of the next contact, at the present speed, or where the head stands, at the one that it last walked at; \
             none where no contact lies ahead, or none is known yet.",
            contact_s,
        ),
        gauge("forecast_contact_remaining_seconds", "Show seconds until the next contact.", remaining_s),
        gauge(
            "forecast_contact_wall_seconds",
            "Seconds of wall time until the next contact; where the head stands, from when it walks on.",
            wall_s.filter(|_| contact_s.is_some()),
        ),
        gauge(
            "forecast_guard_stop_wall_seconds",
            "Seconds of wall time until the guard stops the head; where the head stands, from when it walks on.",
            wall_s.filter(|_| matches!(scene.outlook, Outlook::GuardStop { .. })),
        ),
        gauge(
            "forecast_free_time_seconds",
            "Show time up to which it is proved that no benches touch, where no contact is known ahead.",
            free_s,
        ),
    ]
}
