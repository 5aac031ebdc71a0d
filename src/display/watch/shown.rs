//! Whether a scene looks like the one before.

use bench_dragon_ipc::FrameHeader;

use crate::display::observe::{GuardSituation, Lamp, Link, Outlook, Scene, lamps};

/// All of a scene that a screen shows and that changes, to the digits that it shows. Two scenes with the same look alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    link: &'static str,
    age_tenths: u64,
    header: FrameHeader,
    outlook: Outlook,
    least: Option<(f64, f64)>,
    run: Option<u64>,
    traffic: [u64; 4],
    lateness_ns: [u64; 5],
    alerts: u64,
    guard: GuardSituation,
    lamps: Vec<Lamp>,
    commands: u64,
    /// What keeps the head from walking, and the kind of source.
    stops: [u32; 2],
}

impl Shown {
    /// What is shown of a scene.
    pub fn of(scene: &Scene) -> Self {
        let header = scene.frame.as_ref().map_or_else(FrameHeader::default, |still| still.header);
        let (traffic, status) = (&scene.traffic, scene.status.as_ref());
        Self {
            link: match &scene.link {
                Link::Live => "",
                other => other.name(),
            },
            age_tenths: scene.link.age_ns().unwrap_or_default() / 100_000_000,
            // A head that stands is the same from tick to tick.
            header: FrameHeader { tick: 0, scheduled_ns: 0, published_ns: 0, ..header },
            outlook: scene.outlook,
            least: scene.least,
            run: scene.run.as_ref().map(|run| run.run_id),
            traffic: [traffic.lost, traffic.restarts, traffic.rate_hz.to_bits(), traffic.latency.count()],
            lateness_ns: status.map_or([0; 5], |status| {
                let [p50_ns, p99_ns, max_ns] = [status.lateness_p50_ns, status.lateness_p99_ns, status.lateness_max_ns];
                [status.overruns, status.behind_ns, p50_ns, p99_ns, max_ns]
            }),
            alerts: scene.alerts.total(),
            guard: scene.guard,
            lamps: lamps(scene, scene.seen_ns),
            commands: scene.commands.total(),
            stops: status.map_or([0; 2], |status| [status.stops, status.source]),
        }
    }
}
