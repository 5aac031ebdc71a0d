//! zenoh, peer to peer, without scouting, otherwise with its default settings: over TCP on loopback, and with frames written
//! in place into zenoh's shared memory.

use bench_dragon_ipc::{FrameHeader, HandleState};
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::sample::Sample;
use zenoh::shm::{
    BlockOn, GarbageCollect, PosixShmProviderBackend, ShmProvider, ShmProviderBuilder, cleanup_orphaned_shm_segments,
};
use zenoh::{Config, Session, Wait as _};

use crate::arrival::Arrival;
use crate::frame_bytes::{self, Encoder, FRAME_BYTES};
use crate::publishing::{Sender, announce, publish};
use crate::reading::{Receiver, read};
use crate::setting::{Mode, Setting};
use crate::transport::Transport;

pub(crate) const TCP: Transport = Transport {
    name: "zenoh_tcp",
    title: "zenoh, TCP",
    publish: Some(|_| publish(TcpSender::open())),
    only_polling: false,
    read: |setting, place| read(setting, ZenohReceiver::open(setting, place, Way::Tcp)),
};
pub(crate) const SHARED_MEMORY: Transport = Transport {
    name: "zenoh_shm",
    title: "zenoh, shared memory",
    publish: Some(|_| publish(ShmSender::open())),
    only_polling: false,
    read: |setting, place| read(setting, ZenohReceiver::open(setting, place, Way::SharedMemory)),
};

/// Transport of the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Tcp,
    SharedMemory,
}

const KEY: &str = "bench-dragon/frames";
/// Frames that the shared memory holds: as many as our own server buffers for a reader.
const SHM_FRAMES: usize = 256;

struct TcpSender {
    encoder: Encoder,
    publisher: Publisher<'static>,
    _session: Session,
}

impl TcpSender {
    fn open() -> Self {
        let session = listen(Way::Tcp);
        Self { encoder: Encoder::new(), publisher: publisher(&session), _session: session }
    }
}

impl Sender for TcpSender {
    fn send(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader) {
        let mut bytes = vec![0; FRAME_BYTES];
        self.encoder.encode(fill, &mut bytes);
        self.publisher.put(bytes).wait().expect("the session is open");
    }
}

struct ShmSender {
    encoder: Encoder,
    publisher: Publisher<'static>,
    provider: ShmProvider<PosixShmProviderBackend>,
    _session: Session,
}

impl ShmSender {
    fn open() -> Self {
        let backend = PosixShmProviderBackend::builder(SHM_FRAMES * FRAME_BYTES).wait().expect("/dev/shm has room");
        let provider = ShmProviderBuilder::backend(backend).wait();
        let session = listen(Way::SharedMemory);
        Self { encoder: Encoder::new(), publisher: publisher(&session), provider, _session: session }
    }
}

impl Sender for ShmSender {
    fn send(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader) {
        let allocation = self.provider.alloc(FRAME_BYTES).with_policy::<BlockOn<GarbageCollect>>();
        let mut bytes = allocation.wait().expect("readers release frames");
        self.encoder.encode(fill, &mut bytes);
        self.publisher.put(bytes).wait().expect("the session is open");
    }
}

struct ZenohReceiver {
    subscriber: Subscriber<FifoChannelHandler<Sample>>,
    mode: Mode,
    is_shared: bool,
    _session: Session,
}

impl ZenohReceiver {
    fn open(setting: Setting, place: &str, way: Way) -> Self {
        let mut config = config(way);
        set(&mut config, "connect/endpoints", &format!("[\"{place}\"]"));
        let session = zenoh::open(config).wait().expect("the publisher listens");
        let subscriber = session.declare_subscriber(KEY).wait().expect("the session is open");
        let is_shared = way == Way::SharedMemory;
        Self { subscriber, mode: setting.mode, is_shared, _session: session }
    }
}

impl Receiver for ZenohReceiver {
    fn receive(&mut self) -> Option<Arrival> {
        let sample = match self.mode {
            Mode::Polling => self.subscriber.try_recv().expect("the session is open")?,
            Mode::Woken | Mode::Clock => self.subscriber.recv().expect("the session is open"),
        };
        let payload = sample.payload();
        let arrival = frame_bytes::read(&payload.to_bytes());
        assert_eq!(payload.as_shm().is_some(), self.is_shared, "frames arrive by the transport that is measured");
        Some(arrival)
    }
}

/// Removes shared memory of processes that ended while readers still used it.
pub(crate) fn clear_up() {
    cleanup_orphaned_shm_segments();
}

fn publisher(session: &Session) -> Publisher<'static> {
    session.declare_publisher(KEY).wait().expect("the session is open")
}

/// Opens a session that listens on a free port of loopback, and announces its endpoint.
fn listen(way: Way) -> Session {
    let mut config = config(way);
    set(&mut config, "listen/endpoints", "[\"tcp/127.0.0.1:0\"]");
    let session = zenoh::open(config).wait().expect("a port is free");
    let locators = session.info().locators().wait();
    announce(locators.first().expect("the session listens").as_str());
    session
}

fn config(way: Way) -> Config {
    let mut config = Config::default();
    set(&mut config, "mode", "\"peer\"");
    set(&mut config, "listen/endpoints", "[]");
    set(&mut config, "scouting/multicast/enabled", "false");
    set(&mut config, "scouting/gossip/enabled", "false");
    set(&mut config, "transport/shared_memory/enabled", &(way == Way::SharedMemory).to_string());
    config
}

fn set(config: &mut Config, key: &str, json5: &str) {
    config.insert_json5(key, json5).unwrap_or_else(|error| panic!("{key}: {error}"));
}
