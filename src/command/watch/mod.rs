//! `watch`: the show in the terminal.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use std::{io, thread};

use anyhow::Context as _;
use bench_dragon_ipc::{Domain, Request, Sender};
use ratatui::crossterm::event::Event as Input;
use rustix::io::Errno;

use crate::cli::WatchArgs;
use crate::command::print::complain;
use crate::command_queue::{CommandQueue, HOLD_PATIENCE};
use crate::display::observe::{Observer, Scene};
use crate::display::watch::{Action, Reply, Screen, Shown, draw};
use crate::system::clock::monotonic_ns;

mod mailbox;
mod terminal;

use mailbox::{EndsWith, Event, Mailbox};
use terminal::Display;

/// Scenes a second. The eye sees a walk at this rate, and a terminal far away can follow.
const SCENES_HZ: u32 = 15;

pub(crate) fn run(args: &WatchArgs) -> anyhow::Result<ExitCode> {
    let look = terminal::look(args.glyphs)?;
    let domain = Domain::new(args.bus.instance.clone())?;
    let mailbox = Arc::new(Mailbox::default());
    mailbox::send_signals_to(Arc::clone(&mailbox))?;
    let screen = Screen::new(domain.instance().as_str(), look, args.read_only);
    let commands = CommandSender::start(&domain, &mailbox)?;
    let display = Display::open(Arc::clone(&mailbox)).context("cannot draw on this terminal")?;
    mailbox::send_input_to(Arc::clone(&mailbox))?;
    let stop = Arc::new(AtomicBool::new(false));
    let observing = observe(domain, Arc::clone(&stop), Arc::clone(&mailbox))?;
    let mut watch = Watch { display, screen, commands, scene: Scene::default(), shown: None };
    let watched = watch.follow(&mailbox);
    stop.store(true, Ordering::Relaxed);
    mailbox.close();
    let Watch { display, commands, .. } = watch;
    drop(display);
    commands.finish();
    for reply in mailbox.replies() {
        complain(reply.text());
    }
    observing.join().map_err(|_| anyhow::anyhow!("the observer panicked"))?;
    watched.map(|()| ExitCode::SUCCESS)
}

fn observe(domain: Domain, stop: Arc<AtomicBool>, mailbox: Arc<Mailbox>) -> anyhow::Result<thread::JoinHandle<()>> {
    let ends = EndsWith(Arc::clone(&mailbox));
    let observe = move || {
        let _ends = ends;
        // A screen that is drawn more slowly than scenes come gets fewer.
        Observer::new(domain, "watch", SCENES_HZ).with_plan().run(&stop, |scene| mailbox.show(scene));
    };
    Ok(thread::Builder::new().name("observer".to_owned()).spawn(observe)?)
}

/// What goes on between the terminal, the bus and the screen.
struct Watch {
    display: Display,
    screen: Screen,
    commands: CommandSender,
    scene: Scene,
    /// How the scene looked that is on the screen, unless something else has changed since.
    shown: Option<Shown>,
}

impl Watch {
    /// Draws whatever changes, until the end is asked for.
    fn follow(&mut self, mailbox: &Mailbox) -> anyhow::Result<()> {
        self.display.draw(|frame| draw(frame, &self.scene, &self.screen))?;
        while self.take(mailbox.take())? {
            // What has come meanwhile is drawn together.
            while let Some(event) = mailbox.take_waiting() {
                if !self.take(event)? {
                    return Ok(());
                }
            }
            let shown = Shown::of(&self.scene);
            if self.shown.as_ref() != Some(&shown) {
                self.display.draw(|frame| draw(frame, &self.scene, &self.screen))?;
                self.shown = Some(shown);
            }
        }
        Ok(())
    }

    /// Takes note of an event; false for the one that ends it all.
    fn take(&mut self, event: Event) -> anyhow::Result<bool> {
        match event {
            Event::Scene(scene) => {
                let is_other = self.screen.see(&scene, monotonic_ns());
                self.scene = *scene;
                if !is_other {
                    return Ok(true);
                }
            }
            Event::Input(Input::Key(key)) => match self.screen.press(key, &self.scene, monotonic_ns()) {
                Action::None => {}
                Action::Command(request) => self.commands.send(request),
                Action::Suspend => self.display.suspend()?,
                Action::Quit => return Ok(false),
            },
            // A resize is seen by the drawing.
            Event::Input(_) => {}
            Event::Reply(reply) => self.screen.answer(reply),
            Event::Suspend => self.display.suspend()?,
            Event::Continue => self.display.resume()?,
            Event::End => return Ok(false),
            // The terminal is closed.
            Event::Failed(error) if error.raw_os_error() == Some(Errno::IO.raw_os_error()) => return Ok(false),
            Event::Failed(error) => return Err(error).context("cannot read the terminal's keys"),
        }
        self.shown = None;
        Ok(true)
    }
}

/// After so long the one who has left is told what is waited for.
const MOMENT: Duration = Duration::from_millis(300);

/// Submits commands to a queue, and puts the answers into the mailbox.
#[derive(Debug)]
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

    /// Sends a command.
    fn send(&self, request: Request) {
        let mailbox = Arc::clone(&self.mailbox);
        self.commands.submit(request, move |outcome| mailbox.answer(Reply::to(request, outcome)));
    }

    /// Waits until what is under way has been answered, and a hold that was asked for is, though their screen is gone; other
    /// commands that have not been sent are given up. Who waits longer than a moment is told for what.
    fn finish(self) {
        for request in self.commands.close(MOMENT, |_| true) {
            complain(&format!("{}, waiting for the server's answer", Reply::sent(request).text()));
        }
        self.commands.close(HOLD_PATIENCE, |_| true);
    }
}
