//! The state of the screen: the user's choices, and the past that it shows.

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::{AlertKind, CommandEvent, FrameHeader, Sender, Status};

use super::alerts::{AlertFilter, pair_in_short};
use super::camera::Camera;
use super::charts::LatenessHistory;
use super::footer::CommandOutcome;
use super::look::{Look, Tone};
use super::prompt::{Confirmation, NumberEntry};
use super::speed_steps::SpeedSteps;
use crate::display::observe::{
    GuardSituation, Lamp, LeastClearance, ShowForecast, Snapshot, SourcePresence, Standing, lamps,
};
use crate::output::command_words::CommandWords;

/// All that is drawn beside the snapshot, and its appearance.
#[derive(Clone, Debug, Default)]
pub struct Screen {
    pub(super) instance: String,
    pub(super) look: Look,
    pub(super) is_read_only: bool,
    pub(super) camera: Camera,
    pub(super) lateness: LatenessHistory,
    pub(super) speed_steps: SpeedSteps,
    pub(super) entry: Option<NumberEntry>,
    pub(super) confirmation: Option<Confirmation>,
    pub(super) reply: Option<CommandOutcome>,
    pub(super) overlay: Option<Overlay>,
    pub(super) alert_filter: AlertFilter,
    /// The last unacknowledged contact, in words.
    pub(super) past_contact: Option<String>,
    /// Whether benches touched in the last snapshot.
    touches: bool,
    /// Numbers of alerts and of commands that the screen has handled.
    seen_alerts: u64,
    seen_commands: u64,
}

/// A box that is drawn over the plan until a key is pressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Overlay {
    Help,
    Lamps,
}

impl Screen {
    /// Returns a screen for an instance. Its keys send commands, unless `is_read_only`.
    pub fn new(instance: &str, look: Look, is_read_only: bool) -> Self {
        Self { instance: instance.to_owned(), look, is_read_only, ..Self::default() }
    }

    /// Handles a snapshot at an instant of a monotonic clock, and records what the screen shows of the past. Returns whether
    /// the screen's own parts look different now.
    pub fn see(&mut self, snapshot: &Snapshot, now_ns: u64) -> bool {
        self.speed_steps.see(snapshot);
        self.see_contacts(snapshot);
        self.see_commands(snapshot);
        if let Some(status) = &snapshot.status {
            self.lateness.note(status);
        }
        self.withdraw_confirmation(snapshot, now_ns)
    }

    /// Withdraws the confirmation if it is no longer valid, and shows the reason. Returns whether it withdrew one.
    pub(super) fn withdraw_confirmation(&mut self, snapshot: &Snapshot, now_ns: u64) -> bool {
        let Some(confirmation) = self.confirmation else { return false };
        let Some(reason) = confirmation.withdrawn_because(snapshot, now_ns) else { return false };
        self.confirmation = None;
        self.reply = Some(confirmation.withdrawal(reason));
        true
    }

    /// Keeps a contact until it is acknowledged. A monitor or this program has found it.
    fn see_contacts(&mut self, snapshot: &Snapshot) {
        let touching = snapshot.nearest.filter(|pair| pair.clearance_m <= 0.0);
        if let (Some(pair), false, Some(header)) = (touching, self.touches, snapshot.header()) {
            self.past_contact = Some(contact(snapshot, pair.benches.map(|bench| bench as u32), header.show_time_s()));
        }
        self.touches = touching.is_some();
        let found =
            snapshot.alerts.log.since(self.seen_alerts).filter(|it| it.event.alert_kind() == Some(AlertKind::Contact));
        if let Some(alert) = found.last().map(|numbered| numbered.event) {
            self.past_contact = alert.pair().map(|pair| contact(snapshot, pair, alert.show_time_ns as f64 / 1e9));
        }
        self.seen_alerts = snapshot.alerts.log.total;
    }

    /// Shows the newest command, unless this process sent it, or sent a later one: then the reply is shown.
    fn see_commands(&mut self, snapshot: &Snapshot) {
        let is_own = |event: &CommandEvent| event.sent_by() == Some(Sender::Watch) && event.pid == std::process::id();
        let newest = snapshot.commands.log.since(self.seen_commands).filter(|command| !is_own(&command.event)).last();
        let replied = self.reply.as_ref();
        if let Some(command) = newest.filter(|command| !replied.is_some_and(|reply| reply.is_after(&command.event))) {
            let words = CommandWords::from(&command.event);
            self.reply = Some(CommandOutcome::new(format!("{} {}", words.clock, words.text), Tone::Calm));
        }
        self.seen_commands = snapshot.commands.log.total;
    }

    /// Shows the outcome of a command.
    pub fn answer(&mut self, reply: CommandOutcome) {
        if let Some(answer) = reply.speed {
            self.speed_steps.answer(answer);
        }
        self.reply = Some(reply);
    }
}

fn contact(snapshot: &Snapshot, pair: [u32; 2], time_s: f64) -> String {
    format!("CONTACT {} at {} s", pair_in_short(snapshot, pair), Fixed::<3>(time_s))
}

/// The changing values of a snapshot that a screen shows, with the displayed precision. Equal appearances look alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Appearance {
    presence: &'static str,
    header: FrameHeader,
    forecast: ShowForecast,
    least: Option<LeastClearance>,
    guard: GuardSituation,
    standing: Standing,
    lamps: Vec<Lamp>,
    /// All other values, as numbers.
    figures: [u64; 15],
}

impl Appearance {
    /// Returns the appearance of a snapshot.
    pub fn of(snapshot: &Snapshot) -> Self {
        let (header, no_status) = (snapshot.header().copied().unwrap_or_default(), Status::default());
        let (statistics, status) = (&snapshot.statistics, snapshot.status.as_deref().unwrap_or(&no_status));
        Self {
            presence: if snapshot.presence == SourcePresence::Live { "" } else { snapshot.presence.name() },
            // While the head stands, only these fields differ between frames.
            header: FrameHeader { tick: 0, scheduled_ns: 0, published_ns: 0, ..header },
            forecast: snapshot.forecast,
            least: snapshot.least,
            guard: snapshot.guard,
            standing: Standing::of(snapshot, snapshot.seen_ns),
            lamps: lamps(snapshot, snapshot.seen_ns),
            figures: [
                (snapshot.presence.age_s().unwrap_or_default() * 10.0) as u64,
                snapshot.run.as_ref().map_or(u64::MAX, |run| run.run_id),
                statistics.lost,
                statistics.restarts,
                statistics.rate_hz.to_bits(),
                statistics.latency.count(),
                status.overruns,
                status.behind_ns,
                status.lateness_p50_ns,
                status.lateness_p99_ns,
                status.lateness_max_ns,
                status.stops.into(),
                status.source.into(),
                snapshot.alerts.log.total,
                snapshot.commands.log.total,
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bench_dragon_geometry::clearance::PairClearance;
    use bench_dragon_ipc::{Alert, CommandReply, Request, ShowState};
    use glam::DVec2;
    use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

    use super::*;
    use crate::display::watch::sample::{drawn, new_screen, rows, screen_after, snapshot, type_keys, walking};
    use crate::safety::monitor::run_alert;

    #[test]
    fn a_reply_outlasts_events_from_before_it() {
        let mut snapshot = walking(ShowState::Paused, 0.0);
        let mut screen = new_screen(false);
        let reply = CommandReply { run_id: 1, tick: 28, ..CommandReply::default() };
        screen.answer(CommandOutcome::to(Request::Pause, Ok(reply)));
        let shown = |screen: &Screen| screen.reply.as_ref().expect("a line").text.clone();
        let replied = "pause: accepted, from tick 28 on";
        let see = |tick, screen: &mut Screen, snapshot: &mut Snapshot| {
            let event = CommandEvent { run_id: 1, number: tick, tick, ..CommandEvent::default() };
            Arc::make_mut(&mut snapshot.commands).push(event);
            screen.see(snapshot, 0);
        };
        see(27, &mut screen, &mut snapshot);
        assert_eq!(shown(&screen), replied);
        see(28, &mut screen, &mut snapshot);
        assert_ne!(shown(&screen), replied);
    }

    #[test]
    fn a_past_contact_stays_until_it_is_acknowledged() {
        let mut touching = walking(ShowState::Running, 1.0);
        touching.nearest = Some(PairClearance { benches: [0, 8], clearance_m: -0.001, point: DVec2::ZERO });
        let parted = walking(ShowState::Running, 1.0);
        let mut watching = new_screen(true);
        watching.see(&touching, 0);
        watching.see(&parted, 0);
        assert_eq!(watching.past_contact.as_deref(), Some("CONTACT 0-8 at 0.000 s"));
        type_keys(&mut watching, "a", &parted);
        assert_eq!(watching.past_contact, None);
        let mut alerted = walking(ShowState::Running, 1.0);
        let header = alerted.frame.as_ref().expect("a frame").header;
        let alert = Alert { bench_a: 3, bench_b: 9, ..run_alert(&header, AlertKind::Contact) };
        Arc::make_mut(&mut alerted.alerts).push(alert);
        watching.see(&alerted, 0);
        watching.see(&alerted, 0);
        assert_eq!(watching.past_contact.as_deref(), Some("CONTACT 3-9 at 0.000 s"));
    }

    #[test]
    fn a_past_contact_is_shown_on_every_screen_until_a_is_pressed() {
        let mut touching = snapshot(ShowState::Running, 300.0);
        touching.nearest.as_mut().expect("a pair").clearance_m = -0.001;
        let parted = snapshot(ShowState::Running, 301.0);
        for (width, height) in [(80, 24), (60, 14), (40, 12)] {
            let mut screen = screen_after(Look::default(), "", &touching);
            screen.see(&parted, 0);
            let text = |screen: &Screen| rows(&drawn(&parted, screen, width, height)).join("\n");
            assert!(text(&screen).contains("CONTACT 0-21 at 300.000 s"), "{width} by {height}");
            screen.press(KeyEvent::new(KeyCode::Char('a'), KeyModifiers::NONE), &parted, 0);
            assert!(!text(&screen).contains("CONTACT"), "{width} by {height}");
        }
    }
}
