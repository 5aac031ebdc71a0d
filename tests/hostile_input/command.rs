//! Commands and replies as they lie in shared memory, where any process of this user can write them.

use bench_dragon::server::motion::{Motion, MotionPlan};
use bench_dragon_ipc::{Command, CommandReply, Request};

/// Bytes of a command: kind, reserved, value. A last byte is a number of ticks.
const COMMAND_BYTES: usize = 17;

/// The head stays within its run, whatever it is asked for and when; a reply of any bits has an outcome that can be told.
pub(crate) fn check(input: &[u8]) {
    let plan = plan();
    let mut motion = Motion::new(plan);
    for bytes in input.chunks_exact(COMMAND_BYTES) {
        let command =
            Command { kind: u32_at(bytes, 0), reserved: u32_at(bytes, 4), value: f64::from_bits(u64_at(bytes, 8)) };
        if let Some(request) = Request::from_wire(&command) {
            assert_eq!(request.to_wire().kind, command.kind);
            let before = motion.head();
            if let Err(refusal) = motion.request(request) {
                assert_eq!(motion.head(), before, "a refused command changes nothing");
                assert!(!refusal.to_string().contains('\n'));
            }
        }
        for _ in 0..=bytes[16] {
            motion.advance();
            let head = motion.head();
            assert!((0.0..=plan.end_travel_m).contains(&head.travel_m), "{head:?}");
            assert!((0.0..=Request::MAX_SPEED_MPS).contains(&head.speed_mps), "{head:?}");
        }
    }
    check_reply(input);
}

fn check_reply(input: &[u8]) {
    let mut bytes = [0; 40];
    let length = input.len().min(bytes.len());
    bytes[..length].copy_from_slice(&input[..length]);
    let reply = CommandReply {
        run_id: u64_at(&bytes, 0),
        tick: u64_at(&bytes, 8),
        lowest: f64::from_bits(u64_at(&bytes, 16)),
        highest: f64::from_bits(u64_at(&bytes, 24)),
        refusal: u32_at(&bytes, 32),
        reserved: u32_at(&bytes, 36),
    };
    match reply.outcome() {
        Ok(tick) => assert_eq!((reply.refusal, tick), (0, reply.tick)),
        Err(refusal) => assert!(!refusal.to_string().is_empty()),
    }
}

/// The paper's run, at one metre a second.
fn plan() -> MotionPlan {
    MotionPlan {
        speed_mps: 1.0,
        tick_s: 0.02,
        start_s: 0.0,
        start_travel_m: 0.0,
        start_speed_mps: 1.0,
        first_s: 0.0,
        last_s: 432.75,
        end_travel_m: 432.75,
        until_s: None,
        held: false,
        paused: false,
    }
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
}
