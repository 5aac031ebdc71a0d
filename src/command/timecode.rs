//! What `serve` does about timecode beside its loop: the socket, and the thread that reports what happens.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bench_dragon_ipc::TimecodeKind;
use clap::Args;
use rtrb::Consumer;

use crate::command::flags::{BadInput, Format, within};
use crate::command::print::print_notice;
use crate::command::serve::ServeLine;
use crate::config::Config;
use crate::source::server::{Server, TimecodeFollowing, TimecodeNews};
use crate::source::timecode::{
    FollowerEvent, FollowerSettings, FrameRate, SampleQueue, TimecodeReceiver, TimecodeSource,
};

/// Which timecode to follow, and how.
#[derive(Clone, Debug, Args)]
pub(crate) struct TimecodeArgs {
    /// Follow timecode: osc:[ADDRESS:]PORT[/MESSAGE] or artnet[:ADDRESS[:PORT]]; this machine's without an address.
    #[arg(long = "timecode", value_name = "SOURCE")]
    pub(crate) source: Option<TimecodeSource>,
    /// Show time minus the timecode's position [default: 0].
    #[arg(long = "timecode-offset", value_name = "SECONDS", requires = "source", allow_negative_numbers = true, value_parser = within(-1e6..=1e6))]
    pub(crate) offset_s: Option<f64>,
    /// Silence after which a timecode is lost and the show goes on by itself [default: 1].
    #[arg(long = "timecode-timeout", value_name = "SECONDS", requires = "source", allow_negative_numbers = true, value_parser = within(0.1..=3600.0))]
    pub(crate) timeout_s: Option<f64>,
    /// Frames a second of OSC messages that do not tell: 24, 25, 29.97 (drop-frame) or 30 [default: 25].
    #[arg(long = "timecode-fps", value_name = "FPS", requires = "source", value_parser = frame_rate)]
    pub(crate) frame_rate: Option<FrameRate>,
}

fn frame_rate(text: &str) -> Result<FrameRate, String> {
    text.parse().ok().and_then(FrameRate::of).ok_or_else(|| "must be 24, 25, 29.97 or 30".to_owned())
}

/// How often news are looked for.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
const DEFAULT_TIMEOUT_S: f64 = 1.0;

/// Timecode that is being received, and that nobody follows yet.
pub(super) struct AwaitedTimecode {
    receiver: TimecodeReceiver,
    inbox: SampleQueue,
    settings: FollowerSettings,
    kind: TimecodeKind,
    format: Format,
}

pub(super) struct FollowedTimecode {
    receiver: TimecodeReceiver,
    format: Format,
    /// Ends the thread that reports what happens.
    is_over: Arc<AtomicBool>,
    news_thread: JoinHandle<()>,
}

/// Refuses a pace that timecode would not keep, and what its source tells by itself.
pub(crate) fn check(args: &TimecodeArgs, config: &Config) -> Result<(), BadInput> {
    let time_scale = config.tables().serve.time_scale;
    if args.source.is_some() && time_scale != 1.0 {
        return Err(BadInput(format!("time_scale is {time_scale}, must be 1 with --timecode, which sets the pace")));
    }
    match (&args.source, args.frame_rate) {
        (Some(source), Some(_)) if source.kind() == TimecodeKind::ArtNet => {
            Err(BadInput("--timecode-fps is for osc: Art-Net timecode tells its own frames a second".to_owned()))
        }
        _ => Ok(()),
    }
}

impl AwaitedTimecode {
    /// Begins to listen, where timecode is to be followed.
    pub(super) fn start(
        args: &TimecodeArgs,
        config: &Config,
        until_s: Option<f64>,
        format: Format,
    ) -> anyhow::Result<Option<Self>> {
        check(args, config)?;
        let Some(source) = &args.source else { return Ok(None) };
        let timeout_ns = (args.timeout_s.unwrap_or(DEFAULT_TIMEOUT_S) * 1e9) as u64;
        let settings = FollowerSettings {
            offset_s: args.offset_s.unwrap_or(0.0),
            timeout_ns,
            first_s: config.start_s(),
            last_s: until_s.map_or(config.last_seek_s(), |until_s| until_s.min(config.last_seek_s())),
        };
        let (receiver, inbox) =
            TimecodeReceiver::start(source.clone(), args.frame_rate.unwrap_or_default(), timeout_ns)?;
        Ok(Some(Self { receiver, inbox, settings, kind: source.kind(), format }))
    }

    /// Has a server follow, and tells what happens from then on.
    pub(super) fn lead(self, server: &mut Server) -> anyhow::Result<FollowedTimecode> {
        let Self { receiver, inbox, settings, kind, format } = self;
        let (following, news) = TimecodeFollowing::new(settings, kind, inbox);
        let is_over = Arc::new(AtomicBool::new(false));
        let news_thread = report_news(news, Arc::clone(&is_over), format)?;
        server.follow(following);
        let listen = receiver.listen;
        print_listening(format, listen)?;
        Ok(FollowedTimecode { receiver, format, is_over, news_thread })
    }
}

impl FollowedTimecode {
    /// Tells what is left to tell, and what came in all.
    pub(super) fn finish(self) -> anyhow::Result<()> {
        self.is_over.store(true, Ordering::Relaxed);
        // It does not panic, and has nothing to return.
        let _ = self.news_thread.join();
        let counts = self.receiver.counts();
        let (malformed, of_others, floods) = (counts.malformed, counts.of_others, counts.floods);
        let text = format!(
            "{} timecodes; dropped: {malformed} malformed, {of_others} of other senders, {floods} floods",
            counts.taken
        );
        print_notice(self.format, &ServeLine::TimecodeSummary(counts), &text)
    }
}

/// Reports news in a thread, until the flag is set.
fn report_news(
    mut news: Consumer<TimecodeNews>,
    is_over: Arc<AtomicBool>,
    format: Format,
) -> io::Result<JoinHandle<()>> {
    thread::Builder::new().name("timecode-news".to_owned()).spawn(move || {
        loop {
            let is_last = is_over.load(Ordering::Relaxed);
            while let Ok(news) = news.pop() {
                // Where stdout is gone, the server's end reports it.
                let _ = print_notice(format, &ServeLine::Timecode(news), &news_text(&news));
            }
            if is_last {
                return;
            }
            thread::sleep(LOOK_PERIOD);
        }
    })
}

/// What people read of news.
pub(super) fn news_text(news: &TimecodeNews) -> String {
    let time_s = news.sim_time_s;
    let (timecode, show) = match news.event {
        FollowerEvent::Follows { position_s } => {
            (format!("timecode {position_s:.3} s runs"), format!("the show follows from {time_s:.3} s"))
        }
        FollowerEvent::Stands { position_s } => {
            (format!("timecode {position_s:.3} s stands"), "so does the show".to_owned())
        }
        FollowerEvent::Lost { position_s } => (
            format!("timecode is lost, last at {position_s:.3} s"),
            format!("the show is by itself from {time_s:.3} s"),
        ),
    };
    let show = if news.is_stopped { format!("the show stays paused or held at {time_s:.3} s") } else { show };
    format!("{timecode}: {show}")
}

/// Reports where timecode has to be sent.
pub(super) fn print_listening(format: Format, listen: SocketAddr) -> anyhow::Result<()> {
    let text = format!("listening for timecode on {listen}; the show stands until the first one");
    print_notice(format, &ServeLine::Listening { listen }, &text)
}
