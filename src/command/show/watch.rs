//! Watching the children: which one has fallen silent, and how often each is started again.

use std::time::{Duration, Instant};

use super::child::Role;
use super::patience::Patience;

/// How long a child may show no sign of life: a server no frame after its first one, a monitor no line while frames come.
/// A recorder and a page give none.
pub(super) const LONGEST_SILENCE: Duration = Duration::from_secs(5);
/// The longest time between two looks that counts. A show that was itself suspended blames nobody.
const LONGEST_LOOK: Duration = Duration::from_millis(200);

/// The longest time between two frames: the lowest rate is 1 Hz.
const LONGEST_PERIOD: Duration = Duration::from_millis(1500);

/// What the show knows of its children's lives.
#[derive(Debug)]
pub(super) struct Watch {
    lives: [Life; 4],
    looked: Instant,
}

/// One child's life, over its restarts.
#[derive(Debug, Default)]
struct Life {
    patience: Patience,
    /// How long it has been silent; `None` before its first sign of life.
    silence: Option<Duration>,
}

impl Watch {
    /// Nobody has shown a sign of life yet.
    pub(super) fn new(now: Instant) -> Self {
        Self { lives: Default::default(), looked: now }
    }

    /// Takes note of a sign of life: of a server, a frame.
    pub(super) fn hear(&mut self, role: Role) {
        self.lives[role as usize].silence = Some(Duration::ZERO);
    }

    /// Takes note of a child's end. How long to wait before it is started again, unless it has ended too often.
    pub(super) fn after_end(&mut self, role: Role, now: Instant) -> Option<Duration> {
        let life = &mut self.lives[role as usize];
        life.silence = None;
        life.patience.after_end(now)
    }

    /// The children that have been silent for too long by now. Each is named once.
    pub(super) fn silent(&mut self, now: Instant) -> Vec<Role> {
        let awake = now.duration_since(self.looked).min(LONGEST_LOOK);
        self.looked = now;
        let has_frames = self.lives[Role::Serve as usize].silence.is_some_and(|silence| silence < LONGEST_PERIOD);
        if !has_frames {
            // A monitor without frames may wait for a server, and says nothing meanwhile.
            self.lives[Role::Monitor as usize].silence = None;
        }
        let mut silent = Vec::new();
        for role in [Role::Serve, Role::Monitor] {
            let silence = &mut self.lives[role as usize].silence;
            *silence = silence.map(|silence| silence + awake);
            if silence.is_some_and(|silence| silence > LONGEST_SILENCE) {
                *silence = None;
                silent.push(role);
            }
        }
        silent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks ten times a second, for so long, at children of which some are heard.
    fn look(watch: &mut Watch, now: &mut Instant, seconds: u32, heard: &[Role]) -> Vec<Role> {
        let mut silent = Vec::new();
        for _ in 0..seconds * 10 {
            *now += Duration::from_millis(100);
            for &role in heard {
                watch.hear(role);
            }
            silent.extend(watch.silent(*now));
        }
        silent
    }

    #[test]
    fn a_server_without_frames_is_silent_and_named_once() {
        let mut now = Instant::now();
        let mut watch = Watch::new(now);
        assert_eq!(look(&mut watch, &mut now, 20, &[]), [], "it has not begun");
        assert_eq!(look(&mut watch, &mut now, 20, &[Role::Serve]), []);
        assert_eq!(look(&mut watch, &mut now, 20, &[]), [Role::Serve]);
    }

    #[test]
    fn a_monitor_is_silent_only_where_there_are_frames() {
        let mut now = Instant::now();
        let mut watch = Watch::new(now);
        assert_eq!(look(&mut watch, &mut now, 1, &[Role::Serve, Role::Monitor]), []);
        assert_eq!(look(&mut watch, &mut now, 20, &[Role::Serve]), [Role::Monitor]);
        assert_eq!(look(&mut watch, &mut now, 1, &[Role::Serve, Role::Monitor]), []);
        assert_eq!(look(&mut watch, &mut now, 20, &[]), [Role::Serve]);
    }

    #[test]
    fn a_show_that_was_suspended_blames_nobody() {
        let mut now = Instant::now();
        let mut watch = Watch::new(now);
        assert_eq!(look(&mut watch, &mut now, 1, &[Role::Serve, Role::Monitor]), []);
        now += Duration::from_hours(1);
        assert_eq!(watch.silent(now), []);
    }
}
