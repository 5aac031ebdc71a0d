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

/// Exit status of a process that a second signal ends, as shells number it.
const FORCED_EXIT_STATUS: i32 = 130;
/// A signal this soon after the first is the same wish: some tools signal a process and its group.
const GRACE: Duration = Duration::from_secs(1);
/// How long a terminal may take the last few bytes, where it may take none.
const FAREWELL: Duration = Duration::from_millis(200);

/// Hands them over. One to end that comes a second after the end was first asked for ends the process, whatever the screen or
/// a command waits for.
pub(super) fn send_to(mailbox: Arc<Mailbox>) -> io::Result<()> {
    let mut signals = Signals::new([SIGCONT, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP])?;
    let send = move || {
        for signal in signals.forever() {
            match signal {
                SIGTSTP => mailbox.suspend(),
                SIGCONT => mailbox.go_on(),
                _ => {
                    if mailbox.end() > GRACE {
                        force_end();
                    }
                }
            }
        }
    };
    thread::Builder::new().name("signals".to_owned()).spawn(send)?;
    Ok(())
}

/// Ends the process although the terminal may take nothing: then what was drawn stays, but keys are echoed again.
fn force_end() -> ! {
    // Not by the thread: on a busy machine it may not run before the process ends.
    display::restore_keys();
    thread::spawn(display::leave);
    thread::sleep(FAREWELL);
    process::exit(FORCED_EXIT_STATUS);
}
