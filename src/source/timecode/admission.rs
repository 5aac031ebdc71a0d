//! Whose timecode is taken. Pure: the present is an argument.

use std::net::IpAddr;

/// Keeps to one sender at a time: the first that is heard, until it has been silent for long enough to be lost.
///
/// A sender is a host: one that opens a socket for each message has another port each time.
#[derive(Clone, Copy, Debug)]
pub struct Admission {
    timeout_ns: u64,
    followed: Option<(IpAddr, u64)>,
}

impl Admission {
    /// Nobody is followed yet; silence of so many nanoseconds loses a sender.
    pub fn new(timeout_ns: u64) -> Self {
        Self { timeout_ns, followed: None }
    }

    /// Whether timecode that this sender sent, and that arrived now, is taken.
    pub fn admits(&mut self, sender: IpAddr, now_ns: u64) -> bool {
        let is_other = self.followed.is_some_and(|(followed, heard_ns)| {
            followed != sender && now_ns.saturating_sub(heard_ns) <= self.timeout_ns
        });
        if !is_other {
            self.followed = Some((sender, now_ns));
        }
        !is_other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_sender_is_heard_when_the_first_is_lost() {
        let [one, other] = [1, 2].map(|last| IpAddr::from([127, 0, 0, last]));
        let mut admission = Admission::new(1_000);
        assert!(admission.admits(one, 0));
        assert!(!admission.admits(other, 900));
        assert!(admission.admits(one, 1_000));
        assert!(!admission.admits(other, 2_000));
        assert!(admission.admits(other, 2_001));
        assert!(!admission.admits(one, 2_002), "now it is the second one's turn");
    }
}
