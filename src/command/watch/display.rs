//! The terminal while it is drawn on, given back however that ends.

use std::io::{self, IsTerminal as _, Stdout, Write as _};
use std::panic;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::{Hide, MoveTo, Show};
use ratatui::crossterm::style::ResetColor;
use ratatui::crossterm::terminal::{
    Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::crossterm::{execute, queue};
use ratatui::{Frame, Terminal};
use signal_hook::consts::SIGTSTP;
use signal_hook::low_level::emulate_default_handler;

use crate::held_stderr::{hold_back, let_go};

/// Whether the terminal is ours.
static IS_OURS: AtomicBool = AtomicBool::new(false);

/// The terminal: without echo, on its other screen, with a log that leads to a terminal held back.
pub(super) struct Display {
    terminal: Terminal<CrosstermBackend<Stdout>>,
}

impl Display {
    /// Takes the terminal. It is given back when this is dropped, and at a panic of whatever thread.
    pub(super) fn open() -> io::Result<Self> {
        give_back_at_panics();
        let terminal = enter()?;
        Ok(Self { terminal })
    }

    /// Draws what has changed. An error also where a panic of another thread has given the terminal back.
    pub(super) fn draw(&mut self, draw: impl FnOnce(&mut Frame<'_>)) -> io::Result<()> {
        if !IS_OURS.load(Ordering::SeqCst) {
            return Err(io::Error::other("the terminal is no longer ours"));
        }
        self.terminal.draw(draw)?;
        Ok(())
    }

    /// Gives the terminal back, stops this process as Ctrl-Z does, and takes the terminal again when it is continued.
    pub(super) fn suspend(&mut self) -> io::Result<()> {
        leave();
        emulate_default_handler(SIGTSTP)?;
        self.resume()
    }

    /// Takes a terminal that may have been somebody else's meanwhile.
    pub(super) fn resume(&mut self) -> io::Result<()> {
        // The mode that was found at first may no longer be there: it is set anew.
        disable_raw_mode()?;
        self.terminal = enter()?;
        Ok(())
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        leave();
    }
}

/// Gives the terminal back, if it is ours: the cursor, the echo and what was on the screen before; then what the log had to
/// say.
pub(super) fn leave() {
    if !IS_OURS.swap(false, Ordering::SeqCst) {
        return;
    }
    // The mode first: that does not wait.
    restore_keys();
    let mut stdout = io::stdout().lock();
    // Terminals without another screen get an empty one.
    let _ = execute!(stdout, ResetColor, Clear(ClearType::All), MoveTo(0, 0), LeaveAlternateScreen, Show);
    drop(stdout);
    let_go();
}

/// Keys are echoed again. This does not wait for a terminal that takes nothing.
pub(super) fn restore_keys() {
    // One that is gone needs nothing.
    let _ = disable_raw_mode();
}

fn enter() -> io::Result<Terminal<CrosstermBackend<Stdout>>> {
    // Where the log goes elsewhere, it does not go across what is drawn.
    if io::stderr().is_terminal() {
        hold_back();
    }
    IS_OURS.store(true, Ordering::SeqCst);
    enable_raw_mode()?;
    let mut stdout = io::stdout();
    queue!(stdout, EnterAlternateScreen, Hide, Clear(ClearType::All))?;
    stdout.flush()?;
    Terminal::new(CrosstermBackend::new(stdout))
}

/// A panic tells its reason on a terminal that shows it; the next drawing then ends the watch.
fn give_back_at_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let tell = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            leave();
            tell(panic);
        }));
    });
}
