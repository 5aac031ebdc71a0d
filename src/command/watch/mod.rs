//! `watch`: the show in the terminal.

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

use crate::command::flags::BusArgs;
use crate::command::print::complain;
use crate::command_queue::{CommandQueue, HOLD_PATIENCE};
use crate::display::observe::{Observer, Snapshot};
use crate::display::watch::{Appearance, CommandOutcome, Glyphs, KeyAction, Screen, draw};
use crate::system::clock::monotonic_ns;

mod mailbox;
mod terminal;

use mailbox::{EndsWith, Mailbox, WatchEvent};
use terminal::Display;

/// Watch the show in the terminal: the dragon, its clearance, alerts; keys give commands.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon watch
  bench-dragon watch --instance main --read-only
  ssh -t stage bench-dragon watch

? shows all keys. Without colours under NO_COLOR. Where there is no terminal, `hz` and `echo` tell in lines.")]
pub(crate) struct WatchArgs {
    /// Take no commands: keys change only what is shown.
    #[arg(long)]
    pub(crate) read_only: bool,
    /// What the plan is drawn with; by default what TERM and the locale allow.
    #[arg(long, value_enum, value_name = "GLYPHS")]
    pub(crate) glyphs: Option<Glyphs>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
}

/// Snapshots a second. The eye sees a walk at this rate, and a terminal far away can follow.
const SNAPSHOTS_HZ: u32 = 15;

pub(crate) fn run(args: &WatchArgs) -> anyhow::Result<ExitCode> {
    let look = terminal::look(args.glyphs)?;
    let domain = args.bus.domain()?;
    let mailbox = Arc::new(Mailbox::default());
    mailbox::send_signals_to(Arc::clone(&mailbox))?;
    let screen = Screen::new(domain.instance().as_str(), look, args.read_only);
    let commands = CommandSender::start(&domain, &mailbox)?;
    let display = Display::open(Arc::clone(&mailbox)).context("cannot draw on this terminal")?;
    mailbox::send_input_to(Arc::clone(&mailbox))?;
    let stop = Arc::new(AtomicBool::new(false));
    let observing = observe(domain, Arc::clone(&stop), Arc::clone(&mailbox))?;
    let mut session = WatchSession { display, screen, commands, snapshot: Snapshot::default(), shown: None };
    let watched = session.follow(&mailbox);
    stop.store(true, Ordering::Relaxed);
    mailbox.close();
    let WatchSession { display, commands, .. } = session;
    drop(display);
    commands.finish();
    for reply in mailbox.replies() {
        complain(&reply.text);
    }
    observing.join().map_err(|_| anyhow::anyhow!("the observer panicked"))?;
    watched.map(|()| ExitCode::SUCCESS)
}

fn observe(domain: Domain, stop: Arc<AtomicBool>, mailbox: Arc<Mailbox>) -> anyhow::Result<thread::JoinHandle<()>> {
    let ends = EndsWith(Arc::clone(&mailbox));
    let observe = move || {
        let _ends = ends;
        // A screen that is drawn more slowly than snapshots come gets fewer.
        Observer::new(domain, "watch", SNAPSHOTS_HZ).with_plan().run(&stop, |snapshot| mailbox.show(snapshot));
    };
    Ok(thread::Builder::new().name("observer".to_owned()).spawn(observe)?)
}

/// What goes on between the terminal, the bus and the screen.
struct WatchSession {
    display: Display,
    screen: Screen,
    commands: CommandSender,
    snapshot: Snapshot,
    /// How the snapshot looked that is on the screen, unless something else has changed since.
    shown: Option<Appearance>,
}

impl WatchSession {
    fn follow(&mut self, mailbox: &Mailbox) -> anyhow::Result<()> {
        self.display.draw(|frame| draw(frame, &self.snapshot, &self.screen))?;
        while self.take(mailbox.take())? {
            // What has come meanwhile is drawn together.
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

    /// Takes note of an event; false for the one that ends it all.
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
            // A resize is seen by the drawing.
            WatchEvent::Input(_) => {}
            WatchEvent::Outcome(reply) => self.screen.answer(reply),
            WatchEvent::Suspend => self.display.suspend()?,
            WatchEvent::Continue => self.display.resume()?,
            WatchEvent::End => return Ok(false),
            // The terminal is closed.
            WatchEvent::Failed(error) if error.raw_os_error() == Some(Errno::IO.raw_os_error()) => return Ok(false),
            WatchEvent::Failed(error) => return Err(error).context("cannot read the terminal's keys"),
        }
        self.shown = None;
        Ok(true)
    }
}

/// After so long the one who has left is told what is waited for.
const MOMENT: Duration = Duration::from_millis(300);

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

    /// Waits until what is under way has been answered, and a hold that was asked for is, though their screen is gone; other
    /// commands that have not been sent are given up. Who waits longer than a moment is told for what.
    fn finish(self) {
        for request in self.commands.close(MOMENT, |_| true) {
            complain(&format!("{}, waiting for the server's answer", CommandOutcome::sent(request).text));
        }
        self.commands.close(HOLD_PATIENCE, |_| true);
    }
}
