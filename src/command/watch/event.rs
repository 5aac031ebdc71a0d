//! What a watch waits for.

use std::io;
use std::sync::mpsc::SyncSender;
use std::thread;

use bench_dragon::observe::Scene;
use bench_dragon::watch::Reply;
use ratatui::crossterm::event::{Event as Input, read};

/// Something has happened.
#[derive(Debug)]
pub(super) enum Event {
    /// The observer shows a scene.
    Scene(Box<Scene>),
    /// A key was hit, or the terminal has another size.
    Input(Input),
    /// A command was answered.
    Reply(Reply),
    /// A signal suspends the process.
    Suspend,
    /// The process goes on after it was stopped.
    Continue,
    /// A signal ends the process.
    End,
    /// The terminal cannot be read any more.
    Failed(io::Error),
}

/// Ends the watch with the thread that holds this, also where that panics.
#[derive(Debug)]
pub(super) struct EndsWith(pub(super) SyncSender<Event>);

impl Drop for EndsWith {
    fn drop(&mut self) {
        // Where nobody listens, it has ended already.
        let _ = self.0.send(Event::End);
    }
}

/// Sends what the terminal says, for the rest of the process.
pub(super) fn send_input_to(sender: SyncSender<Event>) -> io::Result<()> {
    let send = move || {
        loop {
            let (event, is_last) = match read() {
                Ok(input) => (Event::Input(input), false),
                Err(error) => (Event::Failed(error), true),
            };
            if sender.send(event).is_err() || is_last {
                return;
            }
        }
    };
    thread::Builder::new().name("input".to_owned()).spawn(send)?;
    Ok(())
}
