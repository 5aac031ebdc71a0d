//! Timecode for `serve`, outside of its loop: the arguments, the socket, and the thread that reports changes.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::TimecodeKind;
use clap::Args;
use rtrb::Consumer;

use crate::cli::flags::{BadInput, Format, within};
use crate::cli::print::print_notice;
use crate::cli::serve::ServeLine;
use crate::config::Config;
use crate::source::server::{Server, TimecodeFollowing, TimecodeNews};
use crate::source::timecode::ltc::LtcReceiver;
use crate::source::timecode::{
    FollowerEvent, FollowerSettings, FrameRate, SampleQueue, TimecodeCounts, TimecodeInput, TimecodeReceiver,
};

/// Arguments for the timecode to follow.
#[derive(Clone, Debug, Args)]
pub(crate) struct TimecodeArgs {
    /// Timecode to follow: osc:[ADDRESS:]PORT[/MESSAGE] or artnet[:ADDRESS[:PORT]], without ADDRESS only from this machine; or, for
    /// serve alone, sound in WAV: ltc:- from stdin or ltc:FILE.wav.
    #[arg(long = "timecode", value_name = "SOURCE")]
    pub(crate) source: Option<TimecodeInput>,
    /// Show time minus the timecode's position, in seconds from -1000000 to 1000000 [default: 0].
    #[arg(long = "timecode-offset", value_name = "SECONDS", requires = "source", allow_negative_numbers = true, value_parser = within(-1e6..=1e6))]
    pub(crate) offset_s: Option<f64>,
    /// Silence in seconds after which the timecode is lost and the show goes on without it, 0.1 to 3600 [default: 1].
    #[arg(long = "timecode-timeout", value_name = "SECONDS", requires = "source", allow_negative_numbers = true, value_parser = within(0.1..=3600.0))]
    pub(crate) timeout_s: Option<f64>,
    /// Frames per second of OSC messages and of sound, if these do not contain it: 24, 25, 29.97 (drop-frame), 29.97ndf
    /// or 30 [default: 25].
    #[arg(long = "timecode-fps", value_name = "FPS", requires = "source")]
    pub(crate) frame_rate: Option<FrameRate>,
}

/// Period at which the thread looks for news.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
const DEFAULT_TIMEOUT_S: f64 = 1.0;

/// Timecode that is being received, and that no server follows yet.
pub(super) struct AwaitedTimecode {
    receiver: Receiver,
    inbox: SampleQueue,
    settings: FollowerSettings,
    kind: TimecodeKind,
    format: Format,
}

/// A running receiver.
enum Receiver {
    Network(TimecodeReceiver),
    Ltc(LtcReceiver),
}

impl Receiver {
    fn counts(&self) -> TimecodeCounts {
        match self {
            Self::Network(receiver) => receiver.counts(),
            Self::Ltc(receiver) => receiver.counts(),
        }
    }
}

pub(super) struct FollowedTimecode {
    receiver: Receiver,
    format: Format,
    /// Ends the thread that reports news.
    is_over: Arc<AtomicBool>,
    news_thread: JoinHandle<()>,
}

/// Refuses sound for a show, whose server starts again without it. Else as [`check`].
pub(crate) fn check_show(args: &TimecodeArgs, config: &Config) -> Result<(), BadInput> {
    match &args.source {
        Some(source @ TimecodeInput::Ltc(_)) => {
            let instead =
                format!("start `bench-dragon serve --timecode {source}`, with `monitor` and `record` beside it");
            Err(BadInput(format!("--timecode is {source}, must be osc or artnet in a show: for sound, {instead}")))
        }
        _ => check(args, config),
    }
}

/// Refuses a time scale, because timecode sets it, and a frame rate for Art-Net, whose packets contain it.
pub(crate) fn check(args: &TimecodeArgs, config: &Config) -> Result<(), BadInput> {
    let time_scale = config.tables().serve.time_scale;
    if args.source.is_some() && time_scale != 1.0 {
        return Err(BadInput(format!("time_scale is {time_scale}, must be 1 with --timecode, which sets the pace")));
    }
    if let Some(cue) = config.cues().iter().find(|cue| args.source.is_some() && cue.waits) {
        let name = &cue.name;
        return Err(BadInput(format!(
            "[[cues]] \"{name}\" waits for GO, must not wait with --timecode, which leads the show"
        )));
    }
    match (&args.source, args.frame_rate) {
        (Some(source), Some(_)) if source.kind() == TimecodeKind::ArtNet => {
            Err(BadInput("--timecode-fps is only for osc and ltc: Art-Net timecode contains its frame rate".to_owned()))
        }
        _ => Ok(()),
    }
}

impl AwaitedTimecode {
    /// Begins to listen, if the arguments name a timecode.
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
            // The time scale is 1.
            period_s: config.tick_s(),
            first_s: config.start_s(),
            last_s: until_s.map_or(config.last_seek_s(), |until_s| until_s.min(config.last_seek_s())),
        };
        let rate = args.frame_rate.unwrap_or_default();
        let (receiver, inbox) = match source {
            TimecodeInput::Network(source) => {
                let (receiver, inbox) = TimecodeReceiver::start(source.clone(), rate, timeout_ns)?;
                (Receiver::Network(receiver), inbox)
            }
            TimecodeInput::Ltc(input) => {
                let started = LtcReceiver::start(input, rate);
                let (receiver, inbox) = started.map_err(|error| BadInput(format!("--timecode ltc:{input} {error}")))?;
                (Receiver::Ltc(receiver), inbox)
            }
        };
        Ok(Some(Self { receiver, inbox, settings, kind: source.kind(), format }))
    }

    /// Makes a server follow the timecode, and reports news from then on.
    pub(super) fn lead(self, server: &mut Server) -> anyhow::Result<FollowedTimecode> {
        let Self { receiver, inbox, settings, kind, format } = self;
        let (following, news) = TimecodeFollowing::new(settings, kind, inbox);
        let is_over = Arc::new(AtomicBool::new(false));
        let news_thread = report_news(news, Arc::clone(&is_over), format)?;
        server.follow(following);
        if let Receiver::Network(receiver) = &receiver {
            print_listening(format, receiver.listen)?;
        }
        Ok(FollowedTimecode { receiver, format, is_over, news_thread })
    }
}

impl FollowedTimecode {
    /// Reports the remaining news, and the counts of all received timecode.
    pub(super) fn finish(self) -> anyhow::Result<()> {
        self.is_over.store(true, Ordering::Relaxed);
        // The thread does not panic, and returns nothing.
        let _ = self.news_thread.join();
        let counts = self.receiver.counts();
        let (malformed, of_others, floods) = (counts.malformed, counts.of_others, counts.floods);
        let text = format!(
            "{} timecodes; dropped: {malformed} malformed, {of_others} from other senders, {floods} floods",
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
                // If stdout is closed, the server reports this at its end.
                let _ = print_notice(format, &ServeLine::Timecode(news), &news_text(&news));
            }
            if is_last {
                return;
            }
            thread::sleep(LOOK_PERIOD);
        }
    })
}

/// News in words.
pub(super) fn news_text(news: &TimecodeNews) -> String {
    let time_s = news.show_time_s;
    let (timecode, show) = match news.event {
        FollowerEvent::Follows { position_s } => (
            format!("timecode runs at {} s", Fixed::<3>(position_s)),
            format!("the show follows from {} s", Fixed::<3>(time_s)),
        ),
        FollowerEvent::Stands { position_s } => {
            (format!("timecode stands still at {} s", Fixed::<3>(position_s)), "so does the show".to_owned())
        }
        FollowerEvent::Lost { position_s } => (
            format!("timecode is lost, last at {} s", Fixed::<3>(position_s)),
            format!("the show no longer follows, from {} s", Fixed::<3>(time_s)),
        ),
    };
    let show =
        if news.is_stopped { format!("the show stays paused or held at {} s", Fixed::<3>(time_s)) } else { show };
    format!("{timecode}: {show}")
}

/// Reports the address to which timecode must be sent.
pub(super) fn print_listening(format: Format, listen: SocketAddr) -> anyhow::Result<()> {
    let text = format!("listening for timecode on {listen}; the show stands still until the first one");
    print_notice(format, &ServeLine::Listening { listen }, &text)
}
