//! The terminal while it is drawn on, given back however that ends.

use std::io::{self, IsTerminal as _, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Once};
use std::{env, panic};

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

use super::mailbox::Mailbox;
use crate::command::flags::BadInput;
use crate::display::watch::{Glyphs, Look, Theme};
use crate::output::{Screen, hold_terminal, release_terminal};

/// Whether the terminal is ours.
static IS_OURS: AtomicBool = AtomicBool::new(false);

/// The terminal: without echo, on its other screen, with a log that leads to a terminal held back.
pub(super) struct Display {
    terminal: Terminal<CrosstermBackend<Screen>>,
    mailbox: Arc<Mailbox>,
}

impl Display {
    /// Takes the terminal. It is given back when this is dropped, and at a panic of whatever thread. Once the mailbox has an end,
    /// a terminal that takes nothing is waited for no more.
    pub(super) fn open(mailbox: Arc<Mailbox>) -> io::Result<Self> {
        give_back_at_panics();
        let terminal = enter(&mailbox)?;
        Ok(Self { terminal, mailbox })
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
        self.terminal = enter(&self.mailbox)?;
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
    let mut screen = Screen::new(|| true);
    // Terminals without another screen get an empty one.
    let _ = execute!(screen, ResetColor, Clear(ClearType::All), MoveTo(0, 0), LeaveAlternateScreen, Show);
    release_terminal();
}

/// Keys are echoed again. This does not wait for a terminal that takes nothing.
pub(super) fn restore_keys() {
    // One that is gone needs nothing.
    let _ = disable_raw_mode();
}

fn enter(mailbox: &Arc<Mailbox>) -> io::Result<Terminal<CrosstermBackend<Screen>>> {
    hold_terminal();
    IS_OURS.store(true, Ordering::SeqCst);
    enable_raw_mode()?;
    let mailbox = Arc::clone(mailbox);
    let mut screen = Screen::new(move || mailbox.is_ending());
    queue!(screen, EnterAlternateScreen, Hide, Clear(ClearType::All))?;
    screen.flush()?;
    Terminal::new(CrosstermBackend::new(screen))
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

/// How this process's terminal is drawn on, with the characters that were asked for.
pub(super) fn look(asked: Option<Glyphs>) -> Result<Look, BadInput> {
    let (name, is_terminal) = (variable("TERM"), io::stdin().is_terminal() && io::stdout().is_terminal());
    if !is_terminal {
        return Err(BadInput(
            "watch needs a terminal; in a pipe use `bench-dragon hz` or `bench-dragon echo`".to_owned(),
        ));
    }
    if name.is_empty() || name == "dumb" {
        let told = if name.is_empty() { "TERM is not set".to_owned() } else { format!("TERM is {name}") };
        return Err(BadInput(format!(
            "watch needs a terminal that can be drawn on, and {told}; `bench-dragon hz` and `bench-dragon echo` need none"
        )));
    }
    let glyphs = asked.unwrap_or_else(|| Glyphs::of_terminal(&name, is_utf8()));
    let theme = if variable("NO_COLOR").is_empty() { Theme::Coloured } else { Theme::Plain };
    Ok(Look { theme, glyphs })
}

/// Whether characters are UTF-8, by the first of the locale's variables that says something.
fn is_utf8() -> bool {
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"].map(variable).into_iter().find(|locale| !locale.is_empty());
    locale.is_some_and(|locale| {
        let locale = locale.to_ascii_lowercase();
        locale.contains("utf-8") || locale.contains("utf8")
    })
}

fn variable(name: &str) -> String {
    env::var_os(name).unwrap_or_default().to_string_lossy().into_owned()
}
