//! The terminal that `watch` draws on. It is restored after every kind of end.

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
use crate::cli::flags::BadInput;
use crate::display::watch::{Glyphs, Look, Theme};
use crate::output::{Screen, hold_terminal, release_terminal};

/// Whether this process currently draws on the terminal.
static IS_OURS: AtomicBool = AtomicBool::new(false);

/// The terminal, without echo and on its alternate screen. Log lines to a terminal are held back until it is restored.
pub(super) struct Display {
    terminal: Terminal<CrosstermBackend<Screen>>,
    mailbox: Arc<Mailbox>,
}

impl Display {
    /// Takes over the terminal. It is restored when this is dropped, and at a panic of any thread. Once the mailbox has a
    /// request to end, drawing no longer waits for a terminal that does not accept output.
    pub(super) fn open(mailbox: Arc<Mailbox>) -> io::Result<Self> {
        give_back_at_panics();
        let terminal = enter(&mailbox)?;
        Ok(Self { terminal, mailbox })
    }

    /// Draws the changes. Fails also if a panic of another thread has restored the terminal.
    pub(super) fn draw(&mut self, draw: impl FnOnce(&mut Frame<'_>)) -> io::Result<()> {
        if !IS_OURS.load(Ordering::SeqCst) {
            return Err(io::Error::other("the terminal has already been restored"));
        }
        self.terminal.draw(draw)?;
        Ok(())
    }

    /// Restores the terminal and stops this process, as Ctrl-Z does. Takes over the terminal again when the process continues.
    pub(super) fn suspend(&mut self) -> io::Result<()> {
        leave();
        emulate_default_handler(SIGTSTP)?;
        self.resume()
    }

    /// Takes over the terminal again, after another process may have used it.
    pub(super) fn resume(&mut self) -> io::Result<()> {
        // The terminal's mode may have changed since, so it is reset first and saved again.
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

/// Restores the terminal, if this process draws on it: the cursor, the echo and the previous screen. Then prints the held log
/// lines.
pub(super) fn leave() {
    if !IS_OURS.swap(false, Ordering::SeqCst) {
        return;
    }
    // The mode first, because this does not wait for the terminal.
    restore_keys();
    let mut screen = Screen::new(|| true);
    // A terminal without an alternate screen is cleared.
    let _ = execute!(screen, ResetColor, Clear(ClearType::All), MoveTo(0, 0), LeaveAlternateScreen, Show);
    release_terminal();
}

/// Turns the echo of keys on again. Does not wait for a terminal that does not accept output.
pub(super) fn restore_keys() {
    // A closed terminal needs no restoring.
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

/// Restores the terminal at a panic, so that the panic's message is visible. The next drawing then ends the watch.
fn give_back_at_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let print = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            leave();
            print(panic);
        }));
    });
}

/// Colours and characters for this process's terminal. `asked` are the characters that the user chose.
pub(super) fn look(asked: Option<Glyphs>) -> Result<Look, BadInput> {
    let (name, is_terminal) = (variable("TERM"), io::stdin().is_terminal() && io::stdout().is_terminal());
    if !is_terminal {
        return Err(BadInput(
            "watch needs a terminal; in a pipe use `bench-dragon hz` or `bench-dragon echo`".to_owned(),
        ));
    }
    if name.is_empty() || name == "dumb" {
        let problem = if name.is_empty() { "TERM is not set".to_owned() } else { format!("TERM is {name}") };
        return Err(BadInput(format!(
            "watch needs a terminal that can draw, but {problem}; use `bench-dragon hz` or `bench-dragon echo`"
        )));
    }
    let glyphs = asked.unwrap_or_else(|| Glyphs::of_terminal(&name, is_utf8()));
    let theme = if variable("NO_COLOR").is_empty() { Theme::Coloured } else { Theme::Plain };
    Ok(Look { theme, glyphs })
}

/// Whether characters are UTF-8, by the first of the locale's variables that is set.
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
