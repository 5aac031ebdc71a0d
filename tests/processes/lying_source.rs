//! A source inside the test, whose frames may contradict its description.

use std::sync::Arc;

use bench_dragon::config::Config;
use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_geometry::dragon::ChainSolver;
use bench_dragon_ipc::service::{
    AlertService, CommandService, EventService, FrameService, MAX_DESCRIPTION_LEN, Member, Role, Service, StatusService,
};
use bench_dragon_ipc::source::SourceLock;
use bench_dragon_ipc::{Command, CommandReply, Domain, FrameHeader, HandleState, Request, ShowState};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::server::Server;
use iceoryx2::port::update_connections::UpdateConnections as _;

const RUN_ID: u64 = 7;
const BENCHES: usize = 223;

/// Publishes the guarded paper's dragon at its start, held, in any size.
pub(crate) struct LyingSource {
    // The fields are dropped in this order: ports, services, node, lock.
    frames: Publisher<Service, [HandleState], FrameHeader>,
    description: Publisher<Service, [u8], u64>,
    commands: Server<Service, Command, (), CommandReply, ()>,
    _services: (FrameService, EventService, StatusService, AlertService, EventService, CommandService),
    _member: Member,
    _lock: SourceLock,
    handles: Vec<HandleState>,
    tick: u64,
}

impl LyingSource {
    pub(crate) fn start(domain: &Domain) -> Self {
        let lock = SourceLock::take(domain).expect("the instance has no other source");
        let member = Member::join(domain, "liar", Role::Source { handle_count: BENCHES + 1 }).expect("a domain");
        let config = Config::from_toml("[monitor]\nguard = true\n").expect("a valid configuration");
        let services = (
            member.frames().expect("a service"),
            member.frame_events().expect("a service"),
            member.status().expect("a service"),
            member.alerts().expect("a service"),
            member.alert_events().expect("a service"),
            member.commands().expect("a service"),
        );
        let frames = services.0.publisher_builder().initial_max_slice_len(BENCHES + 1).create().expect("a port");
        let descriptions = member.description().expect("a service");
        let description =
            descriptions.publisher_builder().initial_max_slice_len(MAX_DESCRIPTION_LEN).create().expect("a port");
        let toml = config.to_toml();
        let mut sample = description.loan_slice(toml.len()).expect("memory");
        sample.payload_mut().copy_from_slice(toml.as_bytes());
        *sample.user_header_mut() = RUN_ID;
        sample.send().expect("the send succeeds");
        let commands = services.5.server_builder().create().expect("a port");
        let dragon = Arc::clone(config.lead());
        let mut solver = ChainSolver::new(&dragon);
        let solved = solver.solve(&dragon, 0.0).expect("the start is in the run");
        let handles = solved
            .iter()
            .map(|handle| HandleState {
                position_m: [handle.position.x, handle.position.y, 0.0],
                velocity_mps: [0.0; 3],
            })
            .collect();
        Self { frames, description, commands, _services: services, _member: member, _lock: lock, handles, tick: 0 }
    }

    /// Publishes a frame with all positions multiplied by this size. Accepts and returns all requests of clients.
    pub(crate) fn publish(&mut self, size: f64) -> Vec<Request> {
        self.description.update_connections().expect("readers can be served");
        let now_ns = monotonic_ns();
        let header = FrameHeader {
            run_id: RUN_ID,
            tick: self.tick,
            show_time_ns: 0,
            scheduled_ns: now_ns,
            published_ns: now_ns,
            head_travel_m: 0.0,
            head_speed_mps: 0.0,
            time_scale: 1.0,
            bench_count: BENCHES as u32,
            state: ShowState::Held.to_wire(),
            ..FrameHeader::default()
        }
        .of_one_dragon();
        let mut sample = self.frames.loan_slice(self.handles.len()).expect("memory");
        for (published, handle) in sample.payload_mut().iter_mut().zip(&self.handles) {
            *published = HandleState { position_m: handle.position_m.map(|metres| size * metres), ..*handle };
        }
        *sample.user_header_mut() = header;
        sample.send().expect("the send succeeds");
        self.tick += 1;
        std::iter::from_fn(|| self.commands.receive().expect("the bus is readable"))
            .map(|active| {
                active.send_copy(CommandReply::accepted(RUN_ID, header.tick)).expect("the send succeeds");
                Request::from_wire(active.payload()).expect("a request that this version knows")
            })
            .collect()
    }
}
