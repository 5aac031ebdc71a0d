//! The mapping from the clock of another host to that of this host. Pure: the time is an argument.
//!
//! A frame arrives after its due instant by the difference of the two clocks and its delay on the way. The delay is never
//! negative, so the least difference of recent frames is the best estimate of the clocks' own, and it does not depend on how
//! late a single frame is. Two windows of ten seconds let the estimate follow clocks that drift apart, and a host that slept.

/// Length of a window. Two quartz clocks drift apart by less than a millisecond in it.
const WINDOW_NS: u64 = 10_000_000_000;

/// The clock of another host, in terms of this host's `CLOCK_MONOTONIC`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RemoteClock {
    window: Option<Window>,
    /// Least difference of the window before.
    before_ns: Option<i128>,
    last_ns: u64,
}

#[derive(Clone, Copy, Debug)]
struct Window {
    ends_ns: u64,
    /// Least difference of arrival here and due instant there.
    least_ns: i128,
}

impl RemoteClock {
    /// Returns the instant on this host's clock at which a frame was due that arrived at `arrived_ns`: never after its arrival,
    /// and never before the frame before it. Call it for frames in their order.
    pub(super) fn due_here_ns(&mut self, due_there_ns: u64, arrived_ns: u64) -> u64 {
        let difference_ns = i128::from(arrived_ns) - i128::from(due_there_ns);
        let window = match &mut self.window {
            Some(window) if arrived_ns < window.ends_ns => window,
            window => {
                let next = Window { ends_ns: arrived_ns.saturating_add(WINDOW_NS), least_ns: difference_ns };
                self.before_ns = window.replace(next).map(|window| window.least_ns);
                window.as_mut().expect("the window was set just now")
            }
        };
        window.least_ns = window.least_ns.min(difference_ns);
        let least_ns = self.before_ns.map_or(window.least_ns, |before_ns| before_ns.min(window.least_ns));
        // The least difference is not above this frame's own, so the instant is not after the arrival.
        let due_ns = u64::try_from(i128::from(due_there_ns) + least_ns).unwrap_or(0);
        self.last_ns = self.last_ns.max(due_ns).min(arrived_ns);
        self.last_ns
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::*;

    const MILLISECOND_NS: u64 = 1_000_000;
    /// Due instant of the first frame there.
    const THERE_NS: u64 = 77_000_000_000_000;
    /// The same instant here.
    const HERE_NS: u64 = 5_000_000_000;

    /// Due instants here, in milliseconds since `HERE_NS`, of frames that are due every 20 ms and have these delays.
    fn dues_ms(clock: &mut RemoteClock, delays_ms: &[u64]) -> Vec<u64> {
        let due = |(index, delay_ms): (u64, &u64)| {
            let at_ns = index * 20 * MILLISECOND_NS;
            let arrived_ns = HERE_NS + at_ns + delay_ms * MILLISECOND_NS;
            (clock.due_here_ns(THERE_NS + at_ns, arrived_ns) - HERE_NS) / MILLISECOND_NS
        };
        (0..).zip(delays_ms).map(due).collect()
    }

    #[test]
    fn late_frames_are_due_a_period_apart() {
        let dues = dues_ms(&mut RemoteClock::default(), &[3, 3, 19, 240, 250, 4, 3]);
        assert_eq!(dues, [3, 23, 43, 63, 83, 103, 123]);
    }

    #[test]
    fn a_delayed_first_frame_does_not_delay_the_later_ones() {
        let dues = dues_ms(&mut RemoteClock::default(), &[50, 30, 10, 12, 40]);
        assert_eq!(dues, [50, 50, 50, 70, 90]);
    }

    #[test]
    fn a_host_that_slept_is_followed_after_two_windows() {
        let mut clock = RemoteClock::default();
        clock.due_here_ns(THERE_NS, HERE_NS);
        let slept_ns = 5_000_000_000;
        let late_ns = |clock: &mut RemoteClock, since_ns: u64| {
            let arrived_ns = HERE_NS + since_ns;
            arrived_ns - clock.due_here_ns(THERE_NS + since_ns - slept_ns, arrived_ns)
        };
        assert_eq!(late_ns(&mut clock, 6_000_000_000), slept_ns);
        assert_eq!(late_ns(&mut clock, 11_000_000_000), slept_ns);
        assert_eq!(late_ns(&mut clock, 22_000_000_000), 0);
    }

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn no_numbers_give_an_instant_after_the_arrival_or_before_the_last(frames: Vec<(u64, u32)>) {
            let (mut clock, mut arrived_ns, mut last_ns) = (RemoteClock::default(), 0, 0);
            for (due_there_ns, since_ns) in frames {
                arrived_ns += u64::from(since_ns);
                let due_ns = clock.due_here_ns(due_there_ns, arrived_ns);
                prop_assert!((last_ns..=arrived_ns).contains(&due_ns));
                last_ns = due_ns;
            }
        }
    }
}
