//! Signals, of which none may leave the terminal as it is drawn on.

use std::io;
use std::process;
use std::sync::mpsc::SyncSender;
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP};
use signal_hook::iterator::Signals;

use super::display;
use super::event::Event;

/// Exit status of a process that a second signal ends, as shells number it.
const FORCED_EXIT_STATUS: i32 = 130;
/// A signal this soon after the first is the same wish: some tools signal a process and its group.
const GRACE: Duration = Duration::from_secs(1);
/// How long a terminal may take the last few bytes, where it may take none.
const FAREWELL: Duration = Duration::from_millis(200);

/// Sends them on. One to end that comes a second after the first ends the process, whatever the screen waits for.
pub(super) fn send_to(sender: SyncSender<Event>) -> io::Result<()> {
    let mut signals = Signals::new([SIGCONT, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP])?;
    let send = move || {
        let mut first = None;
        for signal in signals.forever() {
            let event = match signal {
                SIGTSTP => Event::Suspend,
                SIGCONT => Event::Continue,
                _ => Event::End,
            };
            if matches!(event, Event::End) && first.get_or_insert_with(Instant::now).elapsed() > GRACE {
                force_end();
            }
            // Where there is no room, the screen waits for the terminal; where nobody listens, it is over already.
            let _ = sender.try_send(event);
        }
    };
    thread::Builder::new().name("signals".to_owned()).spawn(send)?;
    Ok(())
}

/// Ends the process although the terminal may take nothing: then what was drawn stays, but keys are echoed again.
fn force_end() -> ! {
    thread::spawn(display::leave);
    thread::sleep(FAREWELL);
    process::exit(FORCED_EXIT_STATUS);
}
