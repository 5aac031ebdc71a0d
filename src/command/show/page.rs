//! The show's page: a `view` that keeps its address and its token when it is started again, so that browsers find it there.

use std::net::{SocketAddr, TcpListener};

use anyhow::Context as _;
use serde::Serialize;

use super::Show;
use super::process::Launch;
use crate::cli::Format;
use crate::command::listening::{ListeningLine, cannot_listen};
use crate::command::output::{print_json, print_line};
use crate::command::view::TOKEN_VARIABLE;
use crate::display::view::Token;

/// Where the page is, and what it takes to steer.
#[derive(Debug)]
pub(super) struct Page {
    /// Where it was asked to listen; once it does, where that is.
    listen: SocketAddr,
    token: Token,
    /// Whether people know where it is.
    is_announced: bool,
}

impl Page {
    /// A page at a free address.
    ///
    /// # Errors
    /// An address that cannot be had: here it takes one line, where the child would report it, and the show the child's end.
    pub(super) fn new(listen: SocketAddr) -> anyhow::Result<Self> {
        drop(TcpListener::bind(listen).map_err(|error| cannot_listen(listen, &error))?);
        let token = Token::random().context("the kernel has no random numbers")?;
        Ok(Self { listen, token, is_announced: false })
    }

    /// Whether people know where it is.
    pub(super) fn is_announced(&self) -> bool {
        self.is_announced
    }
}

/// What a show with a page prints first.
#[derive(Serialize)]
#[serde(tag = "type", rename = "view")]
struct ViewLine {
    url: String,
}

impl Show<'_> {
    pub(super) fn page(&self) -> Launch {
        let Page { listen, token, .. } = self.page.as_ref().expect("only a show with a page starts it");
        let launch = self.launch("view", vec!["--listen".to_owned(), listen.to_string()]);
        Launch { environment: vec![(TOKEN_VARIABLE, token.secret().to_owned())], ..launch }
    }

    /// Takes a page's line, and announces where it is once.
    pub(super) fn announce_page(&mut self, line: &str) -> anyhow::Result<()> {
        let Some(page) = self.page.as_mut().filter(|page| !page.is_announced) else { return Ok(()) };
        let listening: ListeningLine = serde_json::from_str(line).with_context(|| format!("view printed {line:?}"))?;
        let ListeningLine { url, address } = listening;
        (page.listen, page.is_announced) = (address, true);
        match self.args.format.format {
            Format::Json => print_json(&ViewLine { url }),
            Format::Text => Ok(print_line(url)?),
        }
    }
}
