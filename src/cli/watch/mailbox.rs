//! The queue of a watch's events: keys, signals, replies and snapshots.

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

/// Most keys that wait while the screen is drawn. The terminal buffers further keys.
const INPUT_ROOM: usize = 64;

pub(super) enum WatchEvent {
    /// A key press, or a new size of the terminal.
    Input(Input),
    /// A signal that suspends the process.
    Suspend,
    /// The process continues after a stop.
    Continue,
    /// A signal that ends the process.
    End,
    /// The terminal cannot be read any longer.
    Failed(io::Error),
    /// The outcome of a command.
    Outcome(CommandOutcome),
    /// A snapshot of the observer.
    Snapshot(Box<Snapshot>),
}

/// Keeps events until the screen, which may wait for its terminal, takes them.
///
/// Each kind of event has its own bounded place: the newest snapshot, the combined effect of the signals, and one reply per
/// command in flight. A thread with a key waits for room.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    mail: Mutex<Mail>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Mail {
    inputs: VecDeque<Input>,
    /// The last signal that suspends (true) or continues (false). Each cancels the other.
    suspends: Option<bool>,
    /// Instant of the first request to end.
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

    /// Stores a snapshot. It replaces one that has not been taken yet.
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

    /// Requests the end. Returns the time since the first such request.
    pub(super) fn end(&self) -> Duration {
        let mut since = Duration::ZERO;
        self.put(|mail| since = mail.end.get_or_insert_with(Instant::now).elapsed());
        since
    }

    pub(super) fn is_ending(&self) -> bool {
        self.mail().end.is_some()
    }

    /// Closes the mailbox: a thread with a key no longer waits for room. Snapshots and keys are no longer used.
    pub(super) fn close(&self) {
        self.put(|mail| {
            mail.is_closed = true;
            mail.end.get_or_insert_with(Instant::now);
        });
    }

    pub(super) fn replies(&self) -> VecDeque<CommandOutcome> {
        std::mem::take(&mut self.mail().replies)
    }

    /// Adds a key; waits for room. Returns false if the mailbox is closed.
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

    /// Locks the mail, also after a panic of another thread: every change leaves the mail in a valid state.
    fn mail(&self) -> MutexGuard<'_, Mail> {
        self.mail.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Mail {
    /// Takes the next event. Keys come before the end, so that a hold is sent even if its terminal closes directly after the
    /// key. The end is not removed.
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

/// Ends the watch when the thread that owns this ends, also by a panic.
pub(super) struct EndsWith(pub(super) Arc<Mailbox>);

impl Drop for EndsWith {
    fn drop(&mut self) {
        self.0.end();
    }
}

/// Starts a thread that passes the terminal's input to the mailbox, until the process ends.
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
/// A signal within this time after the first counts as the same request: some tools signal both a process and its group.
const GRACE: Duration = Duration::from_secs(1);

/// Starts a thread that passes signals to the mailbox. A signal to end that arrives more than [`GRACE`] after the first request
/// ends the process at once, even while the screen or a command waits. A terminal that does not accept output keeps its last
/// picture; it echoes keys again.
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
                        // Keys first: another thread may have left the screen without having restored the keys yet.
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
    fn signals_are_kept_and_only_the_newest_snapshot_is() {
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
        assert!(matches!(mailbox.take(), WatchEvent::End), "the request to end stays");
        let mailbox = Mailbox {
            mail: Mutex::new(Mail { end: None, ..mailbox.mail.into_inner().expect("no panic") }),
            ..Mailbox::default()
        };
        let WatchEvent::Snapshot(snapshot) = mailbox.take() else { panic!("a snapshot") };
        assert_eq!(snapshot.statistics.lost, 999);
        assert!(mailbox.take_waiting().is_none());
    }

    #[test]
    fn a_continue_cancels_the_suspension_before_it() {
        let mailbox = Mailbox::default();
        mailbox.suspend();
        mailbox.go_on();
        assert!(matches!(mailbox.take_waiting(), Some(WatchEvent::Continue)));
        assert!(mailbox.take_waiting().is_none());
    }

    #[test]
    fn a_key_from_before_the_end_is_taken_before_the_end() {
        let mailbox = Mailbox::default();
        assert!(mailbox.type_in(key('h')));
        mailbox.end();
        assert!(matches!(mailbox.take(), WatchEvent::Input(input) if input == key('h')));
        assert!(matches!(mailbox.take(), WatchEvent::End));
    }

    #[test]
    fn a_key_waits_for_room_until_the_mailbox_is_closed() {
        let mailbox = Mailbox::default();
        (0..INPUT_ROOM).for_each(|_| assert!(mailbox.type_in(key('f'))));
        thread::scope(|scope| {
            let typing = scope.spawn(|| mailbox.type_in(key('h')));
            mailbox.close();
            assert!(!typing.join().expect("no panic"));
        });
    }
}
