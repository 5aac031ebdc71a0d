//! All that an operator enters at a desk, or checks there, as one line of text.

use std::fmt::Display;
use std::net::SocketAddrV4;
use std::ops::RangeInclusive;

use super::bench_selection::BenchSelection;
use super::osc::{AngleUnit, OscSettings};
use super::psn::{PsnSettings, TrackersError};

/// The transport of Open Sound Control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OscTransport {
    /// Datagrams.
    Udp,
    /// A connection, with packets framed by SLIP.
    Tcp,
}

/// Returns the settings for PosiStageNet, for a dragon with `benches` benches.
///
/// # Errors
/// The chosen benches do not fit into one frame, or an id is too high.
pub fn psn(settings: &PsnSettings, to: SocketAddrV4, benches: usize) -> Result<String, TrackersError> {
    settings.tracker_count(benches)?;
    let PsnSettings { system_name, transform, .. } = settings;
    Ok(format!(
        "PosiStageNet: {} {}, system \"{system_name}\", {}, axes {}, metres and radians, at the centre of each \
         board",
        cast(to),
        host(to),
        trackers(settings, benches),
        transform.axes().in_words()
    ))
}

/// Returns the settings for Open Sound Control, for a dragon with `benches` benches.
pub fn osc(settings: &OscSettings, to: SocketAddrV4, transport: OscTransport, benches: usize) -> String {
    let OscSettings { show_address, angle, transform, .. } = settings;
    let transport = match transport {
        OscTransport::Udp => format!("UDP {} {}", cast(to), host(to)),
        OscTransport::Tcp => format!("TCP {}, SLIP", host(to)),
    };
    let bundles = if settings.is_bundled { ", in bundles" } else { "" };
    let [first, second] = transform.axes().horizontal_letters();
    let unit = match angle {
        AngleUnit::Degrees => "degrees",
        AngleUnit::Radians => "radians",
    };
    format!(
        "Open Sound Control: {transport}{bundles}, {show_address} (time, state, time scale, tick, fresh), {}, axes {}, metres, \
         at the centre of each board, heading in {unit} from {first} to {second}",
        bench_messages(settings, benches),
        transform.axes().in_words()
    )
}

fn cast(to: SocketAddrV4) -> &'static str {
    match to.ip() {
        ip if ip.is_multicast() => "multicast",
        ip if ip.is_broadcast() => "broadcast",
        _ => "unicast",
    }
}

fn host(to: SocketAddrV4) -> String {
    format!("{} port {}", to.ip(), to.port())
}

/// The ids of the trackers, with the first and the last name.
fn trackers(settings: &PsnSettings, benches: usize) -> String {
    let chosen = &settings.benches;
    let (Some(first), Some(last)) = (chosen.indices(benches).next(), chosen.indices(benches).next_back()) else {
        return "no trackers".to_owned();
    };
    let ids = listed(chosen, benches, |index| settings.id_of_bench(index));
    let name = |index| format!("\"{}\"", settings.tracker_name.of_tracker(index, settings.id_of_bench(index)));
    let noun = if first == last { "tracker" } else { "trackers" };
    format!("{noun} {ids} {}", span(&name(first), &name(last)))
}

fn bench_messages(OscSettings { benches: chosen, bench_address, .. }: &OscSettings, benches: usize) -> String {
    if chosen.count(benches) == 0 {
        return "no benches".to_owned();
    }
    format!("{} (x, y, z, heading, speed)", listed(chosen, benches, |index| bench_address.of_bench(index)))
}

/// Lists a text of each chosen bench. Ranges of benches are shortened to their ends.
fn listed<T: Display>(chosen: &BenchSelection, benches: usize, text: impl Fn(usize) -> T) -> String {
    let ends = |range: RangeInclusive<usize>| {
        let [first, last] = [*range.start(), *range.end()].map(|index| text(index).to_string());
        span(&first, &last)
    };
    chosen.ranges(benches).map(ends).collect::<Vec<_>>().join(", ")
}

fn span(first: &str, last: &str) -> String {
    if first == last { first.to_owned() } else { format!("{first} to {last}") }
}
