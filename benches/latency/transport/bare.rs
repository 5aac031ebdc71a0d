//! Bare iceoryx2: a publisher and subscribers as in its own examples, with our payload and our buffer size. For woken readers
//! the publisher sends an event after each frame.

use std::fs;
use std::path::Path;

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_ipc::service::frame_buffer;
use bench_dragon_ipc::{FrameHeader, HandleState};
use iceoryx2::config::Config;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{
    FileName, LogLevel, Node, NodeBuilder, PortFactory as _, SemanticString as _, SignalHandlingMode, ipc,
    set_log_level,
};
use iceoryx2::service::port_factory::{event, publish_subscribe};
use tempfile::TempDir;

use crate::arrival::Arrival;
use crate::frame_source::{BENCHES, HANDLES};
use crate::publishing::{Sender, announce};
use crate::reading::{Receiver, WAIT};
use crate::setting::{Mode, Setting};

type Service = ipc::Service;
type FrameService = publish_subscribe::PortFactory<Service, [HandleState], FrameHeader>;

pub(crate) struct BareSender {
    // Dropped in this order: the ports before their node, and all before the folder.
    publisher: Publisher<Service, [HandleState], FrameHeader>,
    notifier: Option<Notifier<Service>>,
    _node: Node<Service>,
    _domain: Domain,
}

/// The folder of one domain. Its name is the prefix of the domain's files in shared memory.
pub(crate) struct Domain(TempDir);

impl Domain {
    pub(crate) fn new() -> Self {
        Self(tempfile::Builder::new().prefix("latency-").tempdir().expect("a folder"))
    }

    /// The folder, by which other processes join.
    pub(crate) fn place(&self) -> &str {
        self.0.path().to_str().expect("temporary folders have plain names")
    }
}

impl BareSender {
    /// Opens a publisher and waits for all readers.
    pub(crate) fn open(setting: Setting) -> Self {
        let domain = Domain::new();
        let node = node(Path::new(domain.place()));
        let (frames, events) = (frames(&node), events(&node));
        let publisher = frames.publisher_builder().initial_max_slice_len(HANDLES).create().expect("the only publisher");
        let notifier =
            (setting.mode != Mode::Polling).then(|| events.notifier_builder().create().expect("the only notifier"));
        announce(domain.place());
        while frames.dynamic_config().number_of_subscribers() < setting.readers {
            std::thread::yield_now();
        }
        Self { publisher, notifier, _node: node, _domain: domain }
    }
}

impl Sender for BareSender {
    fn send(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader) {
        let mut sample = self.publisher.loan_slice(HANDLES).expect("readers hold one frame each");
        let header = fill(sample.payload_mut());
        *sample.user_header_mut() = FrameHeader { published_ns: monotonic_ns(), ..header };
        sample.send().expect("memory for every reader is reserved");
        if let Some(notifier) = &self.notifier {
            notifier.notify().expect("the readers are connected");
        }
    }
}

impl Drop for Domain {
    /// Removes the files that iceoryx2 leaves in shared memory. All readers have ended by now.
    fn drop(&mut self) {
        let prefix = prefix(self.0.path());
        for entry in fs::read_dir("/dev/shm").expect("/dev/shm is readable").flatten() {
            if entry.file_name().to_string_lossy().starts_with(&prefix) {
                fs::remove_file(entry.path()).expect("the file belongs to this bench");
            }
        }
    }
}

pub(crate) struct BareReceiver {
    subscriber: Subscriber<Service, [HandleState], FrameHeader>,
    listener: Option<Listener<Service>>,
    _node: Node<Service>,
}

impl BareReceiver {
    pub(crate) fn open(setting: Setting, place: &str) -> Self {
        let node = node(Path::new(place));
        let listener = (setting.mode != Mode::Polling)
            .then(|| events(&node).listener_builder().create().expect("room for every reader"));
        let subscriber = frames(&node).subscriber_builder().create().expect("room for every reader");
        Self { subscriber, listener, _node: node }
    }

    fn read_next(&self) -> Option<Arrival> {
        let sample = self.subscriber.receive().expect("the publisher's memory is readable")?;
        Some(Arrival::read(*sample.user_header(), sample.payload().iter().copied()))
    }
}

impl Receiver for BareReceiver {
    fn receive(&mut self) -> Option<Arrival> {
        match (self.read_next(), &self.listener) {
            (None, Some(listener)) => {
                listener.timed_wait(|_| (), WAIT).expect("the listener is ours");
                self.read_next()
            }
            (arrival, _) => arrival,
        }
    }
}

/// Creates a node of a separate domain, whose root is a new temporary folder.
pub(crate) fn node(folder: &Path) -> Node<Service> {
    set_log_level(LogLevel::Error);
    let mut config = Config::default();
    config.global.set_root_path(
        &iceoryx2::prelude::Path::new(folder.as_os_str().as_encoded_bytes())
            .expect("temporary folders have short names"),
    );
    config.global.prefix = FileName::new(prefix(folder).as_bytes()).expect("a folder's name is a valid file name");
    NodeBuilder::new()
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create()
        .expect("the folder belongs to this bench")
}

fn prefix(folder: &Path) -> String {
    let name = folder.file_name().expect("a temporary folder has a name");
    format!("{}_", name.to_str().expect("temporary folders have plain names"))
}

fn frames(node: &Node<Service>) -> FrameService {
    node.service_builder(&"frames".try_into().expect("a valid name"))
        .publish_subscribe::<[HandleState]>()
        .user_header::<FrameHeader>()
        .subscriber_max_buffer_size(frame_buffer(BENCHES + 1))
        .open_or_create()
        .expect("both sides request the same settings")
}

fn events(node: &Node<Service>) -> event::PortFactory<Service> {
    node.service_builder(&"frames".try_into().expect("a valid name"))
        .event()
        .open_or_create()
        .expect("both sides request the same settings")
}
