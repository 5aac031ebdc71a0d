//! `watch`: shows and steers the show in the terminal.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use std::{io, thread};

use anyhow::Context as _;
use bench_dragon_ipc::{Domain, Request, Sender};
use clap::Args;
use ratatui::crossterm::event::Event as Input;
use rustix::io::Errno;

use crate::cli::flags::BusArgs;
use crate::cli::print::print_to_stderr;
use crate::command_queue::{CommandQueue, HOLD_PATIENCE};
use crate::display::observe::{Observer, Snapshot};
use crate::display::watch::{Appearance, CommandOutcome, Glyphs, KeyAction, Screen, draw};
use crate::system::clock::monotonic_ns;

mod mailbox;
mod terminal;

use mailbox::{EndsWith, Mailbox, WatchEvent};
use terminal::Display;

/// Show the dragon, its clearance and its alerts in the terminal; keys send commands.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon watch
  bench-dragon watch --instance main --read-only
  ssh -t stage bench-dragon watch

The key ? shows all keys. NO_COLOR=1 turns colours off. Without a terminal, use `hz` and `echo`, which print lines.")]
pub(crate) struct WatchArgs {
    /// Send no commands: keys change only the display.
    #[arg(long)]
    pub(crate) read_only: bool,
    /// Characters that draw the plan [default: the best that TERM and the locale allow].
    #[arg(long, value_enum, value_name = "GLYPHS")]
    pub(crate) glyphs: Option<Glyphs>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
}

/// Snapshots per second. At this rate motion looks continuous, and a remote terminal keeps up.
const SNAPSHOTS_HZ: u32 = 15;

pub(crate) fn run(args: &WatchArgs) -> anyhow::Result<ExitCode> {
    let look = terminal::look(args.glyphs)?;
    let domain = args.bus.domain()?.for_operators();
    let mailbox = Arc::new(Mailbox::default());
    mailbox::send_signals_to(Arc::clone(&mailbox))?;
    let screen = Screen::new(domain.instance().as_str(), look, args.read_only);
    let commands = CommandSender::start(&domain, &mailbox)?;
    let display = Display::open(Arc::clone(&mailbox)).context("cannot draw on this terminal")?;
    mailbox::send_input_to(Arc::clone(&mailbox))?;
    let stop = Arc::new(AtomicBool::new(false));
    let observing = observe(domain, Arc::clone(&stop), Arc::clone(&mailbox))?;
    let mut session = WatchSession { display, screen, commands, snapshot: Snapshot::default(), shown: None };
    let watched = session.take_events(&mailbox);
    stop.store(true, Ordering::Relaxed);
    mailbox.close();
    let WatchSession { display, commands, .. } = session;
    drop(display);
    commands.finish();
    for reply in mailbox.replies() {
        print_to_stderr(&reply.text);
    }
    observing.join().map_err(|_| anyhow::anyhow!("the observer panicked"))?;
    watched.map(|()| ExitCode::SUCCESS)
}

fn observe(domain: Domain, stop: Arc<AtomicBool>, mailbox: Arc<Mailbox>) -> anyhow::Result<thread::JoinHandle<()>> {
    let ends = EndsWith(Arc::clone(&mailbox));
    let observe = move || {
        let _ends = ends;
        // If drawing is slower than this rate, the mailbox keeps only the newest snapshot.
        Observer::new(domain, "watch", SNAPSHOTS_HZ).with_plan().run(&stop, |snapshot| mailbox.show(snapshot));
    };
    Ok(thread::Builder::new().name("observer".to_owned()).spawn(observe)?)
}

/// Connects the terminal, the bus and the screen.
struct WatchSession {
    display: Display,
    screen: Screen,
    commands: CommandSender,
    snapshot: Snapshot,
    /// Appearance of the snapshot on the screen. `None` if the screen must be drawn again for another reason.
    shown: Option<Appearance>,
}

impl WatchSession {
    /// Takes events and draws, until an event ends the watch.
    fn take_events(&mut self, mailbox: &Mailbox) -> anyhow::Result<()> {
        self.display.draw(|frame| draw(frame, &self.snapshot, &self.screen))?;
        while self.take(mailbox.take())? {
            // All waiting events are drawn together.
            while let Some(event) = mailbox.take_waiting() {
                if !self.take(event)? {
                    return Ok(());
                }
            }
            let shown = Appearance::of(&self.snapshot);
            if self.shown.as_ref() != Some(&shown) {
                self.display.draw(|frame| draw(frame, &self.snapshot, &self.screen))?;
                self.shown = Some(shown);
            }
        }
        Ok(())
    }

    /// Handles an event. Returns false if the event ends the watch.
    fn take(&mut self, event: WatchEvent) -> anyhow::Result<bool> {
        match event {
            WatchEvent::Snapshot(snapshot) => {
                let is_other = self.screen.see(&snapshot, monotonic_ns());
                self.snapshot = *snapshot;
                if !is_other {
                    return Ok(true);
                }
            }
            WatchEvent::Input(Input::Key(key)) => match self.screen.press(key, &self.snapshot, monotonic_ns()) {
                KeyAction::None => {}
                KeyAction::Command(request) => self.commands.send(request),
                KeyAction::Suspend => self.display.suspend()?,
                KeyAction::Quit => return Ok(false),
            },
            // The next drawing adapts to a resize.
            WatchEvent::Input(_) => {}
            WatchEvent::Outcome(reply) => self.screen.answer(reply),
            WatchEvent::Suspend => self.display.suspend()?,
            WatchEvent::Continue => self.display.resume()?,
            WatchEvent::End => return Ok(false),
            // The terminal has been closed.
            WatchEvent::Failed(error) if error.raw_os_error() == Some(Errno::IO.raw_os_error()) => return Ok(false),
            WatchEvent::Failed(error) => return Err(error).context("cannot read the terminal's keys"),
        }
        self.shown = None;
        Ok(true)
    }
}

/// Delay, after the end of the watch, before unanswered commands are printed.
const ANSWER_DELAY: Duration = Duration::from_millis(300);

struct CommandSender {
    commands: CommandQueue,
    mailbox: Arc<Mailbox>,
}

impl CommandSender {
    fn start(domain: &Domain, mailbox: &Arc<Mailbox>) -> io::Result<Self> {
        Ok(Self {
            commands: CommandQueue::open(domain.clone(), "watch-command", Sender::Watch)?,
            mailbox: Arc::clone(mailbox),
        })
    }

    fn send(&self, request: Request) {
        let mailbox = Arc::clone(&self.mailbox);
        self.commands.submit(request, move |outcome| mailbox.answer(CommandOutcome::to(request, outcome)));
    }

    /// Waits until the server has answered all commands in flight and all requested holds; cancels other unsent commands.
    /// Commands that are unanswered after [`ANSWER_DELAY`] are printed.
    fn finish(self) {
        for request in self.commands.close(ANSWER_DELAY, |_| true) {
            print_to_stderr(&format!("{}, waiting for the server's answer", CommandOutcome::sent(request).text));
        }
        self.commands.close(HOLD_PATIENCE, |_| true);
    }
}
