//! A frame of which a reader has read every handle.

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_geometry::dragon::{ChainSolver, Dragon};
use bench_dragon_ipc::{FrameHeader, HandleState};

/// Sums over all handles: x, y and z of the positions, then of the velocities.
type Sums = [f64; 6];

/// Largest allowed error of a handle, in metres and in metres per second: ten times the limit of the server's frames, and a
/// hundred-thousandth of a handle's movement per tick.
const TOLERANCE: f64 = 1e-8;

/// Data of a frame that a reader keeps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    pub(crate) header: FrameHeader,
    /// Instant at which every handle had been read, in nanoseconds of `CLOCK_MONOTONIC`.
    pub(crate) read_ns: u64,
    handles: usize,
    sums: Sums,
}

impl Arrival {
    /// Reads all handles, then reads the clock.
    pub(crate) fn read(header: FrameHeader, handles: impl ExactSizeIterator<Item = HandleState>) -> Self {
        let count = handles.len();
        let mut sums = Sums::default();
        for HandleState { position_m: [x, y, z], velocity_mps: [u, v, w] } in handles {
            for (sum, value) in sums.iter_mut().zip([x, y, z, u, v, w]) {
                *sum += value;
            }
        }
        Self { header, read_ns: monotonic_ns(), handles: count, sums }
    }

    /// Panics unless the handles match the travel and the speed in the frame's header.
    pub(crate) fn assert_right(&self, dragon: &Dragon, solver: &mut ChainSolver) {
        let Self { header, read_ns, handles, sums } = self;
        let chain = solver.solve(dragon, header.head_travel_m).expect("the travel is within the run");
        assert_eq!((*handles, header.bench_count as usize + 1), (chain.len(), chain.len()), "tick {}", header.tick);
        let expected = chain.iter().fold(Sums::default(), |[x, y, z, u, v, w], handle| {
            let velocity = handle.tangent * (handle.speed_ratio * header.head_speed_mps);
            [x + handle.position.x, y + handle.position.y, z, u + velocity.x, v + velocity.y, w]
        });
        for (sum, expected) in sums.iter().zip(expected) {
            let error = (sum - expected).abs();
            assert!(error <= TOLERANCE * *handles as f64, "tick {}: {sums:?} is not {expected:?}", header.tick);
        }
        assert!(header.scheduled_ns <= header.published_ns && header.published_ns <= *read_ns, "{header:?}");
    }
}
