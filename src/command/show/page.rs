//! The show's page: a `view` that keeps its address and its token when it is started again, so that browsers find it there.

use std::net::{SocketAddr, TcpListener};

use anyhow::{Context as _, bail};
use bench_dragon::stop::StopFlag;
use bench_dragon::view::Token;
use serde::Serialize;

use super::child::{Event, Role};
use super::{LOOK_PERIOD, Show};
use crate::cli::Format;
use crate::command::listening::{ListeningLine, cannot_listen};
use crate::command::output::{print_json, print_line};
use crate::command::view::TOKEN_VARIABLE;

/// Where the page is, and what it takes to steer.
#[derive(Debug)]
pub(super) struct Page {
    /// Where it was asked to listen; once it does, where that is.
    listen: SocketAddr,
    token: Token,
}

impl Page {
    pub(super) fn new(listen: SocketAddr) -> anyhow::Result<Self> {
        Ok(Self { listen, token: Token::random().context("the kernel has no random numbers")? })
    }
}

/// What a show with a page prints first.
#[derive(Serialize)]
#[serde(tag = "type", rename = "view")]
struct ViewLine {
    url: String,
}

impl Show<'_> {
    /// Starts the page, if one was asked for, waits until it can be opened, and tells where.
    pub(super) fn open_page(&mut self, stop: &StopFlag) -> anyhow::Result<()> {
        let Some(Page { listen, .. }) = self.page else { return Ok(()) };
        // Told here, a reason that is likely takes one line; the child would tell it, and the show that the child has ended.
        drop(TcpListener::bind(listen).map_err(|error| cannot_listen(listen, &error))?);
        self.start_page()?;
        while !stop.is_set() {
            match self.children.next_event(LOOK_PERIOD) {
                Some(Event::Line(Role::View, line)) => return self.tell_of_page(&line),
                Some(Event::Closed(Role::View)) => {
                    if let Some(status) = self.children.reap(Role::View)? {
                        bail!("the page does not start: it ended with {status}");
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Starts the page's process, for the first time or again.
    pub(super) fn start_page(&mut self) -> anyhow::Result<()> {
        let args = self.bus_args();
        let Some(Page { listen, token }) = &self.page else { return Ok(()) };
        let args = [args, vec!["--listen".to_owned(), listen.to_string()]].concat();
        self.children.start_in(Role::View, &args, &[(TOKEN_VARIABLE, token.secret())])
    }

    fn tell_of_page(&mut self, line: &str) -> anyhow::Result<()> {
        let listening: ListeningLine = serde_json::from_str(line).with_context(|| format!("view printed {line:?}"))?;
        let ListeningLine { url, address } = listening;
        if let Some(page) = &mut self.page {
            page.listen = address;
        }
        match self.args.format.format {
            Format::Json => print_json(&ViewLine { url }),
            Format::Text => Ok(print_line(url)?),
        }
    }
}
