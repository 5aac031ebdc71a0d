//! A bench of a frame, computed from its two handles.

use core::mem::MaybeUninit;

use bench_dragon_ipc::BenchState;

use crate::frame::bd_frame_t;
use crate::result::{Failure, answer, bd_result_t};

/// Position and motion of one bench.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct bd_bench_state_t {
    /// Centre of the board in metres.
    pub centre_m: [f64; 3],
    /// Direction from the rear handle to the front one, in radians counter-clockwise from +x, -pi to pi.
    pub heading_rad: f64,
    /// Velocity of the centre in metres per show second; 0 while the head stands.
    pub velocity_mps: [f64; 3],
    /// Rate of the heading in radians per show second, counter-clockwise.
    pub turn_rate_radps: f64,
    /// Angle by which the front handle is above the rear one, seen from there, in radians: 0 on level ground.
    pub pitch_rad: f64,
}

/// Computes bench `index` of a frame from its two handles. Index 0 is the head of the leading dragon. Benches are numbered on from
/// dragon to dragon: those of `dragons[i]` of the header begin at its `first_handle` - i.
///
/// `BD_INVALID_ARGUMENT` if `index` is not under the number of benches, or a pointer is NULL.
#[unsafe(no_mangle)]
pub extern "C" fn bd_frame_bench(
    frame: Option<&bd_frame_t>,
    index: usize,
    bench: Option<&mut MaybeUninit<bd_bench_state_t>>,
) -> bd_result_t {
    answer(|| {
        let frame = frame.ok_or_else(|| Failure::missing("frame"))?;
        let bench = bench.ok_or_else(|| Failure::missing("bench"))?;
        let benches = frame.bench_count();
        if index >= benches {
            let text = format!("index is {index}, must be under the number of benches, {benches}");
            return Err(Failure::new(bd_result_t::BD_INVALID_ARGUMENT, text));
        }
        let BenchState { centre_m, heading_rad, velocity_mps, turn_rate_radps, pitch_rad } = frame.bench(index);
        bench.write(bd_bench_state_t { centre_m, heading_rad, velocity_mps, turn_rate_radps, pitch_rad });
        Ok(Some(()))
    })
}
