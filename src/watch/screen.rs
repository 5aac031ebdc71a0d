//! What the one who looks has chosen.

use super::camera::Camera;
use super::entry::Entry;
use super::glyphs::Glyphs;
use super::lateness_history::LatenessHistory;
use super::pace::Pace;
use super::question::Question;
use super::reply::Reply;
use super::theme::Theme;
use crate::observe::Scene;

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
    pub(super) helps: bool,
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
            helps: false,
        }
    }

    /// Takes note of a scene, at this instant of a clock that never goes back: what is shown of the past is kept from here on.
    /// Whether the screen now looks different beside the scene.
    pub fn see(&mut self, scene: &Scene, now_ns: u64) -> bool {
        self.pace.see(scene);
        if let Some(status) = &scene.status {
            self.lateness.note(status);
        }
        self.question.take_if(|question| !question.stands(scene, now_ns)).is_some()
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
