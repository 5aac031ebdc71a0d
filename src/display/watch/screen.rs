//! The state of the screen: what its user has chosen, and what it keeps of the past.

use bench_dragon_ipc::{AlertKind, CommandEvent, FrameHeader, Sender};

use super::alerts::AlertFilter;
use super::camera::Camera;
use super::charts::LatenessHistory;
use super::footer::CommandOutcome;
use super::look::Look;
use super::prompt::{Confirmation, NumberEntry};
use super::speed_steps::SpeedSteps;
use crate::display::observe::{GuardSituation, Lamp, LeastClearance, ShowForecast, Snapshot, SourcePresence, lamps};

/// All that is shown beside the snapshot, and how.
#[derive(Clone, Debug)]
pub struct Screen {
    instance: String,
    look: Look,
    read_only: bool,
    pub(super) camera: Camera,
    pub(super) lateness: LatenessHistory,
    pub(super) speed_steps: SpeedSteps,
    pub(super) entry: Option<NumberEntry>,
    pub(super) confirmation: Option<Confirmation>,
    pub(super) reply: Option<CommandOutcome>,
    pub(super) overlay: Option<Overlay>,
    pub(super) alert_filter: AlertFilter,
    /// The last contact that has not been acknowledged, in words.
    pub(super) past_contact: Option<String>,
    /// Whether benches touched in the last snapshot.
    touches: bool,
    /// How many alerts, and how many commands, have been seen.
    seen_alerts: u64,
    seen_commands: u64,
}

/// What is drawn over the plan until a key is hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Overlay {
    Help,
    Lamps,
}

impl Screen {
    /// A screen for an instance, whose keys give commands unless it is `read_only`.
    pub fn new(instance: &str, look: Look, read_only: bool) -> Self {
        Self {
            instance: instance.to_owned(),
            look,
            read_only,
            camera: Camera::default(),
            lateness: LatenessHistory::default(),
            speed_steps: SpeedSteps::default(),
            entry: None,
            confirmation: None,
            reply: None,
            overlay: None,
            alert_filter: AlertFilter::default(),
            past_contact: None,
            touches: false,
            seen_alerts: 0,
            seen_commands: 0,
        }
    }

    /// Takes note of a snapshot, at this instant of a clock that never goes back: what is shown of the past is kept from here on.
    /// Whether the screen now looks different beside the snapshot.
    pub fn see(&mut self, snapshot: &Snapshot, now_ns: u64) -> bool {
        self.speed_steps.see(snapshot);
        self.see_contacts(snapshot);
        self.see_commands(snapshot);
        if let Some(status) = &snapshot.status {
            self.lateness.note(status);
        }
        self.confirmation.take_if(|confirmation| !confirmation.stands(snapshot, now_ns)).is_some()
    }

    /// Keeps a contact until it is acknowledged, whether a monitor has found it or this program.
    fn see_contacts(&mut self, snapshot: &Snapshot) {
        let touching = snapshot.nearest.filter(|pair| pair.clearance_m <= 0.0);
        if let (Some(pair), false, Some(header)) = (touching, self.touches, snapshot.header()) {
            self.past_contact = Some(contact(pair.benches, header.sim_time_s()));
        }
        self.touches = touching.is_some();
        let found =
            snapshot.alerts.log.since(self.seen_alerts).filter(|it| it.event.alert_kind() == Some(AlertKind::Contact));
        if let Some(alert) = found.last().map(|numbered| numbered.event) {
            self.past_contact = alert.pair().map(|pair| contact(pair, alert.sim_time_ns as f64 * 1e-9));
        }
        self.seen_alerts = snapshot.alerts.log.total();
    }

    /// Shows the newest command, unless it was given here: of that there is a reply.
    fn see_commands(&mut self, snapshot: &Snapshot) {
        let is_own = |event: &CommandEvent| event.sent_by() == Some(Sender::Watch) && event.pid == std::process::id();
        let newest = snapshot.commands.log.since(self.seen_commands).filter(|command| !is_own(&command.event)).last();
        if let Some(command) = newest {
            self.reply = Some(CommandOutcome::of_others(&command.event));
        }
        self.seen_commands = snapshot.commands.log.total();
    }

    /// Shows what became of a command.
    pub fn answer(&mut self, reply: CommandOutcome) {
        if let Some(answer) = reply.speed {
            self.speed_steps.answer(answer);
        }
        self.reply = Some(reply);
    }

    pub(super) fn instance(&self) -> &str {
        &self.instance
    }

    pub(super) fn look(&self) -> Look {
        self.look
    }

    pub(super) fn is_read_only(&self) -> bool {
        self.read_only
    }
}

fn contact(benches: [impl std::fmt::Display; 2], time_s: f64) -> String {
    let [one, another] = benches;
    format!("CONTACT {one}-{another} at {time_s:.3} s")
}

/// All of a snapshot that a screen shows and that changes, to the digits that it shows. Two snapshots with the same look alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Appearance {
    presence: &'static str,
    age_tenths: u64,
    header: FrameHeader,
    forecast: ShowForecast,
    least: Option<LeastClearance>,
    run: Option<u64>,
    statistics: [u64; 4],
    lateness_ns: [u64; 5],
    alerts: u64,
    guard: GuardSituation,
    lamps: Vec<Lamp>,
    commands: u64,
    /// What keeps the head from walking, and the kind of source.
    stops: [u32; 2],
}

impl Appearance {
    /// The appearance of a snapshot.
    pub fn of(snapshot: &Snapshot) -> Self {
        let header = snapshot.header().copied().unwrap_or_default();
        let (statistics, status) = (&snapshot.statistics, snapshot.status.as_ref());
        Self {
            presence: match &snapshot.presence {
                SourcePresence::Live => "",
                other => other.name(),
            },
            age_tenths: (snapshot.presence.age_s().unwrap_or_default() * 10.0) as u64,
            // A head that stands is the same from tick to tick.
            header: FrameHeader { tick: 0, scheduled_ns: 0, published_ns: 0, ..header },
            forecast: snapshot.forecast,
            least: snapshot.least,
            run: snapshot.run.as_ref().map(|run| run.run_id),
            statistics: [
                statistics.lost,
                statistics.restarts,
                statistics.rate_hz.to_bits(),
                statistics.latency.count(),
            ],
            lateness_ns: status.map_or([0; 5], |status| {
                let [p50_ns, p99_ns, max_ns] = [status.lateness_p50_ns, status.lateness_p99_ns, status.lateness_max_ns];
                [status.overruns, status.behind_ns, p50_ns, p99_ns, max_ns]
            }),
            alerts: snapshot.alerts.log.total(),
            guard: snapshot.guard,
            lamps: lamps(snapshot, snapshot.seen_ns),
            commands: snapshot.commands.log.total(),
            stops: status.map_or([0; 2], |status| [status.stops, status.source]),
        }
    }
}
