//! A frame that a reader has read to its last handle.

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_geometry::dragon::{ChainSolver, Dragon};
use bench_dragon_ipc::{FrameHeader, HandleState};

/// Sums over all handles of x, y and z, of position and then of velocity.
type Sums = [f64; 6];

/// How far a handle may be off, in metres and in metres a second: ten times what the server's frames are allowed, and a
/// hundred-thousandth of what a tick moves it.
const TOLERANCE: f64 = 1e-8;

/// What a reader keeps of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    pub(crate) header: FrameHeader,
    /// The instant at which every handle had been read.
    pub(crate) read_ns: u64,
    handles: usize,
    sums: Sums,
}

impl Arrival {
    /// Reads all handles, then takes the time.
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

    /// Fails unless the frame shows the dragon where its header says that it is.
    pub(crate) fn assert_right(&self, dragon: &Dragon, solver: &mut ChainSolver) {
        let Self { header, read_ns, handles, sums } = self;
        let chain = solver.solve(dragon, header.head_travel_m).expect("the run has hardly begun");
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
