//! Starts the children of a show, for the first time and after they have ended.

use std::net::{SocketAddr, TcpListener};

use anyhow::Context as _;
use serde::Serialize;

use super::Show;
use super::children::ChildRole;
use super::process::Launch;
use super::resumption::{Resumption, ResumptionSettings};
use super::wall_time::log;
use crate::cli::print::print_report;
use crate::cli::timecode::TimecodeArgs;
use crate::cli::web::{ListeningLine, TOKEN_VARIABLE, cannot_listen};
use crate::display::view::Token;
use crate::source::timecode::TimecodeInput;

/// Period of the monitor's progress reports, in seconds.
const PROGRESS_PERIOD_S: &str = "0.2";

impl Show<'_> {
    pub(super) fn start(&mut self, role: ChildRole) -> anyhow::Result<()> {
        let launch = match role {
            ChildRole::Serve => self.server(),
            ChildRole::Monitor => {
                let progress = ["--progress", PROGRESS_PERIOD_S].map(str::to_owned);
                let guard = self.is_guarded().then(|| "--guard".to_owned());
                self.launch("monitor", progress.into_iter().chain(guard).collect())
            }
            ChildRole::Record => {
                let recording = self.folder.free_recording().display().to_string();
                // The show finishes the recordings of killed recorders itself, and counts their frames.
                self.launch("record", vec![recording, "--no-repair".to_owned()])
            }
            ChildRole::View => self.page(),
            ChildRole::Also(number) => {
                let command = &self.also[number];
                let output = Some(self.folder.open_output(&command.name)?);
                Launch { args: command.args.clone(), environment: Vec::new(), output, reads_last_line: false }
            }
        };
        self.children.start(role, launch)
    }

    fn server(&self) -> Launch {
        let mut args = self.timecode_args();
        args.extend(["--config".to_owned(), self.folder.config().display().to_string()]);
        // The show itself is one more reader.
        args.extend(["--readers".to_owned(), (self.children.readers() + 1).to_string()]);
        args.push(format!("--reader-wait={}", self.args.wait.reader_wait));
        args.extend(self.args.run.pace.until.map(|until_s| format!("--until={until_s}")));
        args.extend(self.is_performance.then(|| "--stay".to_owned()));
        if let Some(resumption) = self.resumption() {
            args.extend(resumption.args());
        } else {
            args.extend(self.args.run.pace.start_at.map(|start_s| format!("--start-at={start_s}")));
            args.extend(self.args.manner.held.then(|| "--held".to_owned()));
        }
        self.launch("serve", args)
    }

    /// How a restarted server continues; `None` for the first server.
    fn resumption(&self) -> Option<Resumption> {
        let settings = ResumptionSettings {
            auto_resume: self.args.manner.auto_resume,
            follows_timecode: self.args.run.timecode.source.is_some(),
            has_timecode_run: self.reports.has_timecode_run,
        };
        self.seen.resumption(settings)
    }

    /// Logs that a restarted server holds the show.
    pub(super) fn announce_hold(&self) {
        let instance = self.domain.instance();
        let is_formation = self.config.named().is_some();
        let (what, on) = if is_formation { ("show", "go on") } else { ("dragon", "walk on") };
        log(&format!(
            "the {what} is held at its last position: `bench-dragon ctl release --instance {instance}` lets it {on}"
        ));
    }

    /// A command of the program that prints JSON for the show.
    pub(super) fn launch(&self, command: &str, args: Vec<String>) -> Launch {
        let instance = self.domain.instance().to_string();
        let common = ["--instance".to_owned(), instance, "--format".to_owned(), "json".to_owned()];
        let args = [vec![command.to_owned()], args, common.to_vec()].concat();
        Launch { args, environment: Vec::new(), output: None, reads_last_line: false }
    }

    fn timecode_args(&self) -> Vec<String> {
        let TimecodeArgs { source, offset_s, timeout_s, frame_rate } = &self.args.run.timecode;
        // The sender of timecode still sends to the address of the first server.
        let source = source.clone().map(|source| match (source, self.reports.timecode_listen) {
            (TimecodeInput::Network(source), Some(listen)) => TimecodeInput::Network(source.at(listen)),
            (source, _) => source,
        });
        [
            source.map(|source| format!("--timecode={source}")),
            offset_s.map(|offset_s| format!("--timecode-offset={offset_s}")),
            timeout_s.map(|timeout_s| format!("--timecode-timeout={timeout_s}")),
            frame_rate.map(|rate| format!("--timecode-fps={rate}")),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

/// The page: its address and its token.
pub(super) struct Page {
    /// The requested address; after the page has announced itself, its actual address.
    listen: SocketAddr,
    token: Token,
    pub(super) is_announced: bool,
}

impl Page {
    /// Returns a page at a free address.
    ///
    /// # Errors
    /// The address cannot be bound. The check here gives one line of error; without it the child and the show would each
    /// report one.
    pub(super) fn new(listen: SocketAddr) -> anyhow::Result<Self> {
        drop(TcpListener::bind(listen).map_err(|error| cannot_listen(listen, &error))?);
        let token = Token::random().context("cannot read random numbers from the kernel")?;
        Ok(Self { listen, token, is_announced: false })
    }
}

#[derive(Serialize)]
#[serde(tag = "type", rename = "view")]
struct ViewLine {
    url: String,
}

impl Show<'_> {
    pub(super) fn page(&self) -> Launch {
        let Page { listen, token, .. } = self.page.as_ref().expect("only a show with a page starts it");
        let args = ["--outcome-from-stdin".to_owned(), "--listen".to_owned(), listen.to_string()];
        let launch = self.launch("view", args.to_vec());
        let environment = vec![(TOKEN_VARIABLE, token.secret().to_owned())];
        Launch { environment, reads_last_line: true, ..launch }
    }

    /// Takes a line of the page, and announces the page's address once.
    pub(super) fn announce_page(&mut self, line: &str) -> anyhow::Result<()> {
        let Some(page) = self.page.as_mut().filter(|page| !page.is_announced) else { return Ok(()) };
        let listening: ListeningLine = serde_json::from_str(line).with_context(|| format!("view printed {line:?}"))?;
        let ListeningLine { url, address } = listening;
        (page.listen, page.is_announced) = (address, true);
        let text = url.clone();
        print_report(self.args.format.format, &ViewLine { url }, text)
    }
}
