//! Signals, of which none may leave the terminal as it is drawn on.

use std::io;
use std::process;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP};
use signal_hook::iterator::Signals;

use super::display;
use super::mailbox::Mailbox;
use crate::system::stop::is_hangup_ignored;

/// Exit status of a process that a second signal ends, as shells number it.
const FORCED_EXIT_STATUS: i32 = 130;
/// A signal this soon after the first is the same wish: some tools signal a process and its group.
const GRACE: Duration = Duration::from_secs(1);

/// Hands them over. One to end that comes a second after the end was first asked for ends the process, whatever the screen or
/// a command waits for. A terminal that takes nothing keeps what was drawn; its keys are echoed again.
pub(super) fn send_to(mailbox: Arc<Mailbox>) -> io::Result<()> {
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
                        display::restore_keys();
                        display::leave();
                        process::exit(FORCED_EXIT_STATUS);
                    }
                }
            }
        }
    };
    thread::Builder::new().name("signals".to_owned()).spawn(send)?;
    Ok(())
}
