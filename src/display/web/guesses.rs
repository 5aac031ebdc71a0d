//! Wrong tokens: counted for each address, slowed and reported. Pure: the time is an argument.
//!
//! An address may show [`BURST`] different wrong tokens, and one more each second. Beyond that, tokens from there are not
//! compared at all, so no number of parallel requests guesses faster. A token that is wrong twice is one guess: a page with the
//! token of an earlier view asks again and again. This machine is never refused, since a proxy on it stands for many machines;
//! its guesses are answered late.

use std::collections::{HashMap, VecDeque};
use std::hash::{BuildHasher as _, RandomState};
use std::net::{IpAddr, Ipv6Addr};
use std::time::{Duration, Instant};

/// Wrong tokens that an address may show at once.
pub(super) const BURST: u32 = 20;
/// Time until an address may show one more.
const PERIOD: Duration = Duration::from_secs(1);
/// Delay of the answer to a guess.
pub(super) const ANSWER_DELAY: Duration = Duration::from_secs(1);
/// Wrong tokens of an address that are recognised when they are shown again.
const REMEMBERED: usize = 32;
/// Addresses that are counted at a time. The one that has been silent the longest is forgotten first.
const MAX_ORIGINS: usize = 1024;
/// Shortest time between two reports about an address.
const REPORT_PERIOD: Duration = Duration::from_secs(10);

/// The guesses of all addresses.
#[derive(Debug, Default)]
pub(super) struct Guesses {
    origins: HashMap<IpAddr, Origin>,
    hasher: RandomState,
}

/// The guesses of one address.
#[derive(Debug)]
struct Origin {
    /// The instant from which all of the burst is allowed again.
    calm: Instant,
    /// Hashes of the last wrong tokens.
    tokens: VecDeque<u64>,
    last: Instant,
    unreported: u64,
    reported: Option<Instant>,
}

/// The reaction to a wrong token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wrong {
    /// The address has shown it before.
    Known,
    /// A guess. The number of guesses since the last report has to be reported, if any.
    Guess(Option<u64>),
}

impl Guesses {
    /// Whether a token from an address may be compared now.
    pub(super) fn allows(&self, address: IpAddr, now: Instant) -> bool {
        let is_local = address.to_canonical().is_loopback();
        is_local || self.origins.get(&network(address)).is_none_or(|origin| origin.allows(now))
    }

    /// Counts a wrong token of an address.
    pub(super) fn note(&mut self, address: IpAddr, token: &str, now: Instant) -> Wrong {
        let (network, hash) = (network(address), self.hasher.hash_one(token));
        if !self.origins.contains_key(&network) && self.origins.len() >= MAX_ORIGINS {
            let silent = self.origins.iter().min_by_key(|(_, origin)| origin.last).map(|(&network, _)| network);
            if let Some(silent) = silent {
                self.origins.remove(&silent);
            }
        }
        self.origins.entry(network).or_insert_with(|| Origin::new(now)).note(hash, now)
    }
}

impl Origin {
    fn new(now: Instant) -> Self {
        Self { calm: now, tokens: VecDeque::new(), last: now, unreported: 0, reported: None }
    }

    fn allows(&self, now: Instant) -> bool {
        self.calm.saturating_duration_since(now) + PERIOD <= PERIOD * BURST
    }

    fn note(&mut self, hash: u64, now: Instant) -> Wrong {
        self.last = now;
        if self.tokens.contains(&hash) {
            return Wrong::Known;
        }
        if self.tokens.len() == REMEMBERED {
            self.tokens.pop_front();
        }
        self.tokens.push_back(hash);
        self.calm = self.calm.max(now) + PERIOD;
        self.unreported += 1;
        let is_due = self.reported.is_none_or(|reported| now.saturating_duration_since(reported) >= REPORT_PERIOD);
        Wrong::Guess(is_due.then(|| {
            self.reported = Some(now);
            std::mem::take(&mut self.unreported)
        }))
    }
}

/// The network of an address: a machine has 2⁶⁴ addresses of IPv6.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V4(address) => IpAddr::V4(address),
        IpAddr::V6(address) => IpAddr::V6(Ipv6Addr::from_bits(address.to_bits() & !u128::from(u64::MAX))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAR: &str = "10.0.0.66";

    fn address(text: &str) -> IpAddr {
        text.parse().expect("an address")
    }

    /// Returns guesses after so many different wrong tokens of an address.
    fn after(count: u32, from: &str, now: Instant) -> Guesses {
        let mut guesses = Guesses::default();
        for number in 0..count {
            guesses.note(address(from), &format!("wrong-{number}"), now);
        }
        guesses
    }

    #[test]
    fn after_a_burst_an_address_may_guess_once_a_second_and_others_are_free() {
        let now = Instant::now();
        assert!(after(BURST - 1, FAR, now).allows(address(FAR), now));
        let mut guesses = after(BURST, FAR, now);
        assert!(!guesses.allows(address(FAR), now) && guesses.allows(address("10.0.0.7"), now));
        let later = now + PERIOD;
        assert!(guesses.allows(address(FAR), later));
        guesses.note(address(FAR), "another", later);
        assert!(!guesses.allows(address(FAR), later) && guesses.allows(address(FAR), later + PERIOD));
    }

    #[test]
    fn this_machine_is_never_refused() {
        let now = Instant::now();
        for here in ["127.0.0.1", "::1", "::ffff:127.0.0.1"] {
            assert!(after(1000, here, now).allows(address(here), now), "{here}");
        }
    }

    #[test]
    fn addresses_of_one_network_share_their_guesses() {
        let now = Instant::now();
        let guesses = after(BURST, "2001:db8::1", now);
        assert!(!guesses.allows(address("2001:db8::2"), now) && guesses.allows(address("2001:db8:0:1::1"), now));
        assert!(!after(BURST, "::ffff:10.0.0.66", now).allows(address(FAR), now));
    }

    #[test]
    fn a_page_with_the_token_of_an_earlier_view_is_one_guess() {
        let (mut guesses, now) = (Guesses::default(), Instant::now());
        assert_eq!(guesses.note(address(FAR), "yesterday", now), Wrong::Guess(Some(1)));
        assert!((0..1000).all(|_| guesses.note(address(FAR), "yesterday", now) == Wrong::Known));
        assert!(guesses.allows(address(FAR), now));
    }

    #[test]
    fn guesses_are_reported_at_once_and_then_every_ten_seconds() {
        let (mut guesses, now) = (Guesses::default(), Instant::now());
        let mut note = |token: &str, now| guesses.note(address(FAR), token, now);
        assert_eq!(note("a", now), Wrong::Guess(Some(1)));
        assert_eq!([note("b", now), note("c", now)], [Wrong::Guess(None); 2]);
        assert_eq!(note("d", now + REPORT_PERIOD), Wrong::Guess(Some(3)));
    }

    #[test]
    fn the_number_of_addresses_is_bounded() {
        let (mut guesses, now) = (Guesses::default(), Instant::now());
        for number in 0..3 * MAX_ORIGINS as u32 {
            guesses.note(IpAddr::V4(number.into()), "wrong", now + Duration::from_millis(number.into()));
        }
        assert_eq!(guesses.origins.len(), MAX_ORIGINS);
    }
}
