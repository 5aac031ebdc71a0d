//! Commands and replies in shared memory, where any process of this user can write them.

use bench_dragon::source::server::motion::{Motion, MotionPlan, MotionSettings};
use bench_dragon_ipc::{Command, CommandReply, Request};

/// Bytes of a command: kind, reserved, run, two values. A last byte is a number of ticks.
const COMMAND_BYTES: usize = 33;
const RUN_ID: u64 = 0;

/// Fails unless the head stays within its run, and a guarded head within its grant, for any commands at any time, and a reply
/// of any bits has an outcome with a text.
pub(crate) fn check(input: &[u8]) {
    let kind = input.first().copied().unwrap_or_default();
    let plan = MotionSettings {
        guarded_run: (kind & 1 == 1).then_some(RUN_ID),
        accel_mps2: (kind & 2 == 2).then_some(0.25),
        ..MotionSettings::plain(0.02, 0.0, 432.75)
    };
    let mut motion = Motion::new(MotionPlan::new(plan.clone()).expect("the settings are sound"));
    for bytes in input.get(1..).unwrap_or_default().chunks_exact(COMMAND_BYTES) {
        let command = Command {
            kind: u32_at(bytes, 0),
            sender: u32_at(bytes, 4),
            run_id: u64_at(bytes, 8),
            values: [16, 24].map(|at| f64::from_bits(u64_at(bytes, at))),
            flags: u32_at(bytes, 4),
            ..Command::default()
        };
        if let Some(request) = Request::from_wire(&command) {
            assert_eq!(request.to_wire().kind, command.kind);
            let before = motion.head();
            if let Err(refusal) = motion.request(request) {
                assert_eq!(motion.head(), before, "a refused command changes nothing");
                assert!(!refusal.to_string().contains('\n'));
            }
        }
        for _ in 0..=bytes[32] {
            motion.advance();
            let head = motion.head();
            assert!((0.0..=plan.end_travel_m).contains(&head.travel_m), "{head:?}");
            assert!((0.0..=Request::MAX_SPEED_MPS).contains(&head.speed_mps), "{head:?}");
            assert!(motion.limits().granted_to_m.is_none_or(|granted_to_m| head.travel_m <= granted_to_m), "{head:?}");
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

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
}
