//! Commands on their way to the server, which may take seconds: the screen does not wait for them.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use bench_dragon_ipc::{Domain, Request, Sender};

use super::mailbox::Mailbox;
use crate::command::output::complain;
use crate::command_queue::{CommandQueue, HOLD_PATIENCE};
use crate::display::watch::Reply;

/// After so long the one who has left is told what is waited for.
const MOMENT: Duration = Duration::from_millis(300);

/// Submits commands to a queue, and puts the answers into the mailbox.
#[derive(Debug)]
pub(super) struct Clerk {
    commands: CommandQueue,
    mailbox: Arc<Mailbox>,
}

impl Clerk {
    /// A clerk for an instance.
    pub(super) fn start(domain: &Domain, mailbox: &Arc<Mailbox>) -> io::Result<Self> {
        Ok(Self {
            commands: CommandQueue::open(domain.clone(), "watch-command", Sender::Watch)?,
            mailbox: Arc::clone(mailbox),
        })
    }

    /// Sends a command.
    pub(super) fn send(&self, request: Request) {
        let mailbox = Arc::clone(&self.mailbox);
        self.commands.submit(request, move |outcome| mailbox.answer(Reply::to(request, outcome)));
    }

    /// Waits until what is under way has been answered, and a hold that was asked for is, though their screen is gone; other
    /// commands that have not been sent are given up. Who waits longer than a moment is told for what.
    pub(super) fn finish(self) {
        for request in self.commands.close(MOMENT, |_| true) {
            complain(&format!("{}, waiting for the server's answer", Reply::sent(request).text()));
        }
        self.commands.close(HOLD_PATIENCE, |_| true);
    }
}
