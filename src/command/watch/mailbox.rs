//! What a watch waits for: keys, signals, replies and snapshots.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use std::{io, process, thread};

use ratatui::crossterm::event::{Event as Input, read};
use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP};
use signal_hook::iterator::Signals;

use super::terminal;
use crate::display::observe::Snapshot;
use crate::display::watch::CommandOutcome;
use crate::system::stop::is_hangup_ignored;

/// Keys that may wait while the screen is drawn; more of them stay with the terminal.
const INPUT_ROOM: usize = 64;

pub(super) enum WatchEvent {
    /// A key was hit, or the terminal has another size.
    Input(Input),
    /// A signal suspends the process.
    Suspend,
    /// The process goes on after it was stopped.
    Continue,
    /// A signal ends the process.
    End,
    /// The terminal cannot be read any more.
    Failed(io::Error),
    /// A command was answered.
    Outcome(CommandOutcome),
    /// The observer shows a snapshot.
    Snapshot(Box<Snapshot>),
}

/// Where it lies until the screen, which may wait for its terminal, is ready for it.
///
/// Nothing takes the room of anything else: of snapshots there is the newest, of signals what they come to, and of replies as many
/// as there are commands under way. Those who have a key wait for its room.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    mail: Mutex<Mail>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Mail {
    inputs: VecDeque<Input>,
    /// The last of the signals that suspend and continue: each undoes the other.
    suspends: Option<bool>,
    /// Since when the end is asked for.
    end: Option<Instant>,
    failure: Option<io::Error>,
    replies: VecDeque<CommandOutcome>,
    snapshot: Option<Box<Snapshot>>,
    is_closed: bool,
}

impl Mailbox {
    pub(super) fn take(&self) -> WatchEvent {
        let mut mail = self.mail();
        loop {
            if let Some(event) = mail.next() {
                self.changed.notify_all();
                return event;
            }
            mail = self.changed.wait(mail).unwrap_or_else(PoisonError::into_inner);
        }
    }

    pub(super) fn take_waiting(&self) -> Option<WatchEvent> {
        let event = self.mail().next();
        self.changed.notify_all();
        event
    }

    /// Shows a snapshot, instead of one that has not been taken yet.
    pub(super) fn show(&self, snapshot: Snapshot) {
        self.put(|mail| mail.snapshot = Some(Box::new(snapshot)));
    }

    pub(super) fn answer(&self, reply: CommandOutcome) {
        self.put(|mail| mail.replies.push_back(reply));
    }

    pub(super) fn suspend(&self) {
        self.put(|mail| mail.suspends = Some(true));
    }

    pub(super) fn go_on(&self) {
        self.put(|mail| mail.suspends = Some(false));
    }

    /// Asks for the end. Returns how long ago that was asked for first.
    pub(super) fn end(&self) -> Duration {
        let mut since = Duration::ZERO;
        self.put(|mail| since = mail.end.get_or_insert_with(Instant::now).elapsed());
        since
    }

    pub(super) fn is_ending(&self) -> bool {
        self.mail().end.is_some()
    }

    /// Closes it: none who has something to say waits any more. Scenes and keys are over.
    pub(super) fn close(&self) {
        self.put(|mail| {
            mail.is_closed = true;
            mail.end.get_or_insert_with(Instant::now);
        });
    }

    pub(super) fn replies(&self) -> VecDeque<CommandOutcome> {
        std::mem::take(&mut self.mail().replies)
    }

    /// Hands over a key; waits for its room. False where nobody will take it.
    fn type_in(&self, input: Input) -> bool {
        let has_no_room = |mail: &mut Mail| mail.inputs.len() >= INPUT_ROOM && !mail.is_closed;
        let mut mail = self.changed.wait_while(self.mail(), has_no_room).unwrap_or_else(PoisonError::into_inner);
        mail.inputs.push_back(input);
        self.changed.notify_all();
        !mail.is_closed
    }

    fn put(&self, put: impl FnOnce(&mut Mail)) {
        put(&mut self.mail());
        self.changed.notify_all();
    }

    /// A thread that panicked while it held this has left whole values all the same.
    fn mail(&self) -> MutexGuard<'_, Mail> {
        self.mail.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Mail {
    /// Keys come before the end, so that a hold is sent whose terminal is closed at once. The end stays.
    fn next(&mut self) -> Option<WatchEvent> {
        let input = self.inputs.pop_front().map(WatchEvent::Input);
        input
            .or_else(|| Some(if self.suspends.take()? { WatchEvent::Suspend } else { WatchEvent::Continue }))
            .or_else(|| self.end.map(|_| WatchEvent::End))
            .or_else(|| self.failure.take().map(WatchEvent::Failed))
            .or_else(|| self.replies.pop_front().map(WatchEvent::Outcome))
            .or_else(|| self.snapshot.take().map(WatchEvent::Snapshot))
    }
}

/// Ends the watch with the thread that holds this, also where that panics.
pub(super) struct EndsWith(pub(super) Arc<Mailbox>);

impl Drop for EndsWith {
    fn drop(&mut self) {
        self.0.end();
    }
}

/// Hands over what the terminal says, for the rest of the process.
pub(super) fn send_input_to(mailbox: Arc<Mailbox>) -> io::Result<()> {
    let send = move || {
        loop {
            match read() {
                Ok(input) => {
                    if !mailbox.type_in(input) {
                        return;
                    }
                }
                Err(error) => return mailbox.put(|mail| mail.failure = Some(error)),
            }
        }
    };
    thread::Builder::new().name("input".to_owned()).spawn(send)?;
    Ok(())
}

/// Exit status of a process that a second signal ends, as shells number it.
const FORCED_EXIT_STATUS: i32 = 130;
/// A signal this soon after the first is the same wish: some tools signal a process and its group.
const GRACE: Duration = Duration::from_secs(1);

/// Hands them over. One to end that comes a second after the end was first asked for ends the process, whatever the screen or
/// a command waits for. A terminal that takes nothing keeps what was drawn; its keys are echoed again.
pub(super) fn send_signals_to(mailbox: Arc<Mailbox>) -> io::Result<()> {
    let mut signals = Signals::new([SIGCONT, SIGINT, SIGQUIT, SIGTERM, SIGTSTP])?;
    if !is_hangup_ignored() {
        signals.add_signal(SIGHUP)?;
    }
    let send = move || {
        for signal in signals.forever() {
            match signal {
                SIGTSTP => mailbox.suspend(),
                SIGCONT => mailbox.go_on(),
                SIGHUP => {
                    mailbox.end();
                }
                _ => {
                    if mailbox.end() > GRACE {
                        // First, for the screen may be left already by a thread that has not come to the keys.
                        terminal::restore_keys();
                        terminal::leave();
                        process::exit(FORCED_EXIT_STATUS);
                    }
                }
            }
        }
    };
    thread::Builder::new().name("signals".to_owned()).spawn(send)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use ratatui::crossterm::event::{KeyCode, KeyModifiers};

    use super::*;

    fn key(character: char) -> Input {
        Input::Key(ratatui::crossterm::event::KeyEvent::new(KeyCode::Char(character), KeyModifiers::NONE))
    }

    #[test]
    fn no_signal_is_lost_however_many_scenes_wait_and_of_scenes_there_is_the_newest() {
        let mailbox = Mailbox::default();
        for lost in 0..1_000 {
            let mut snapshot = Snapshot::default();
            snapshot.statistics.lost = lost;
            mailbox.show(snapshot);
        }
        mailbox.suspend();
        mailbox.end();
        assert!(matches!(mailbox.take(), WatchEvent::Suspend));
        assert!(matches!(mailbox.take(), WatchEvent::End));
        assert!(matches!(mailbox.take(), WatchEvent::End), "it stays asked for");
        let mailbox = Mailbox {
            mail: Mutex::new(Mail { end: None, ..mailbox.mail.into_inner().expect("no panic") }),
            ..Mailbox::default()
        };
        let WatchEvent::Snapshot(snapshot) = mailbox.take() else { panic!("a snapshot") };
        assert_eq!(snapshot.statistics.lost, 999);
        assert!(mailbox.take_waiting().is_none());
    }

    #[test]
    fn of_a_suspension_that_is_over_already_nothing_is_left() {
        let mailbox = Mailbox::default();
        mailbox.suspend();
        mailbox.go_on();
        assert!(matches!(mailbox.take_waiting(), Some(WatchEvent::Continue)));
        assert!(mailbox.take_waiting().is_none());
    }

    #[test]
    fn a_key_that_was_hit_before_the_end_is_taken_before_it() {
        let mailbox = Mailbox::default();
        assert!(mailbox.type_in(key('h')));
        mailbox.end();
        assert!(matches!(mailbox.take(), WatchEvent::Input(input) if input == key('h')));
        assert!(matches!(mailbox.take(), WatchEvent::End));
    }

    #[test]
    fn a_key_waits_for_its_room_and_no_longer_than_there_is_a_screen() {
        let mailbox = Mailbox::default();
        (0..INPUT_ROOM).for_each(|_| assert!(mailbox.type_in(key('f'))));
        thread::scope(|scope| {
            let typing = scope.spawn(|| mailbox.type_in(key('h')));
            mailbox.close();
            assert!(!typing.join().expect("no panic"));
        });
    }
}
