//! What the one who looks has chosen.

use bench_dragon_ipc::{AlertKind, CommandEvent, Sender};

use super::alert_filter::AlertFilter;
use super::camera::Camera;
use super::entry::Entry;
use super::glyphs::Glyphs;
use super::lateness_history::LatenessHistory;
use super::pace::Pace;
use super::question::Question;
use super::reply::Reply;
use super::theme::Theme;
use crate::display::observe::Scene;

/// How a terminal is drawn on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// With colours or without.
    pub theme: Theme,
    /// With which characters.
    pub glyphs: Glyphs,
}

/// All that is shown beside the scene, and how.
#[derive(Clone, Debug)]
pub struct Screen {
    instance: String,
    look: Look,
    read_only: bool,
    pub(super) camera: Camera,
    pub(super) lateness: LatenessHistory,
    pub(super) pace: Pace,
    pub(super) entry: Option<Entry>,
    pub(super) question: Option<Question>,
    pub(super) reply: Option<Reply>,
    pub(super) overlay: Option<Overlay>,
    pub(super) alert_filter: AlertFilter,
    /// The last contact that has not been acknowledged, in words.
    pub(super) past_contact: Option<String>,
    /// Whether benches touched in the last scene.
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
            pace: Pace::default(),
            entry: None,
            question: None,
            reply: None,
            overlay: None,
            alert_filter: AlertFilter::default(),
            past_contact: None,
            touches: false,
            seen_alerts: 0,
            seen_commands: 0,
        }
    }

    /// Takes note of a scene, at this instant of a clock that never goes back: what is shown of the past is kept from here on.
    /// Whether the screen now looks different beside the scene.
    pub fn see(&mut self, scene: &Scene, now_ns: u64) -> bool {
        self.pace.see(scene);
        self.see_contacts(scene);
        self.see_commands(scene);
        if let Some(status) = &scene.status {
            self.lateness.note(status);
        }
        self.question.take_if(|question| !question.stands(scene, now_ns)).is_some()
    }

    /// Keeps a contact until it is acknowledged, whether a monitor has found it or this program.
    fn see_contacts(&mut self, scene: &Scene) {
        let touching = scene.nearest.filter(|pair| pair.clearance_m <= 0.0);
        if let (Some(pair), false, Some(still)) = (touching, self.touches, &scene.frame) {
            let [one, another] = pair.benches;
            self.past_contact = Some(contact([one, another], still.header.sim_time_s()));
        }
        self.touches = touching.is_some();
        let found = scene.alerts.since(self.seen_alerts).filter(|it| it.alert.alert_kind() == Some(AlertKind::Contact));
        if let Some(alert) = found.last().map(|numbered| numbered.alert) {
            self.past_contact = alert.pair().map(|pair| contact(pair, alert.sim_time_ns as f64 * 1e-9));
        }
        self.seen_alerts = scene.alerts.total();
    }

    /// Shows the newest command, unless it was given here: of that there is a reply.
    fn see_commands(&mut self, scene: &Scene) {
        let is_own = |event: &CommandEvent| event.sent_by() == Some(Sender::Watch) && event.pid == std::process::id();
        let newest = scene.commands.since(self.seen_commands).filter(|command| !is_own(&command.event)).last();
        if let Some(command) = newest {
            self.reply = Some(Reply::of_others(&command.event));
        }
        self.seen_commands = scene.commands.total();
    }

    /// Shows what became of a command.
    pub fn answer(&mut self, reply: Reply) {
        if let Some(answer) = reply.speed {
            self.pace.answer(answer);
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
