//! Every error between a client and the bus has its own variant and a clear message.

use std::fs;
use std::sync::atomic::{AtomicU32, Ordering};

use bench_dragon_ipc::service::{FRAMES, Member, Role};
use bench_dragon_ipc::source::SourceLock;
use bench_dragon_ipc::{BusError, CommandClient, Domain, FrameSubscriber, Instance};
use iceoryx2::prelude::{Node, NodeBuilder, ServiceName, SignalHandlingMode, ZeroCopySend, ipc};

static DOMAINS: AtomicU32 = AtomicU32::new(0);

/// Returns a domain that no other test uses.
fn own_domain() -> Domain {
    let number = DOMAINS.fetch_add(1, Ordering::Relaxed);
    let instance = Instance::new(&format!("e{}-{number}", std::process::id())).expect("the name is valid");
    Domain::new(instance).expect("the domain is usable")
}

fn assert_left_empty(domain: &Domain) {
    assert!(!domain.root().exists(), "{} remains", domain.root().display());
    let shared = fs::read_dir("/dev/shm").expect("/dev/shm is readable").flatten();
    let left: Vec<_> =
        shared.filter(|entry| entry.file_name().to_string_lossy().starts_with(&domain.prefix())).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn without_a_server_a_client_fails_with_no_server_and_leaves_no_files() {
    let domain = own_domain();
    let error = FrameSubscriber::open(&domain, "test").expect_err("nothing is published");
    assert!(error.is_absent(), "{error}");
    assert_eq!(
        error.to_string(),
        format!(
            "no server runs on instance \"{instance}\": start the show, or by hand \
             `bench-dragon serve --config FILE --held --instance {instance}`",
            instance = domain.instance()
        )
    );
    assert_left_empty(&domain);
}

#[test]
fn frames_of_another_layout_are_a_version_mismatch() {
    #[repr(C)]
    #[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
    #[type_name("bench_dragon.HandleState.v99")]
    struct OtherHandle {
        position_m: [f64; 6],
    }
    let domain = own_domain();
    domain.create_directory().expect("the directory can be made");
    let node: Node<ipc::Service> = NodeBuilder::new()
        .config(&domain.iceoryx2_config())
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create()
        .expect("a node can be made");
    let other = node
        .service_builder(&ServiceName::new(FRAMES).expect("a valid name"))
        .publish_subscribe::<[OtherHandle]>()
        .create()
        .expect("the service can be made");
    let error = FrameSubscriber::open(&domain, "test").expect_err("the layout differs");
    assert!(matches!(error, BusError::VersionMismatch { service: FRAMES }), "{error}");
    assert!(error.to_string().contains("run the same version of bench-dragon on both sides"), "{error}");
    drop((other, node));
    // The last member of this library removes the remains.
    drop(Member::join(&domain, "test", Role::Source { handle_count: 2 }).expect("the domain is usable"));
    assert_left_empty(&domain);
}

#[test]
fn a_second_source_is_refused_with_the_pid_of_the_first() {
    let domain = own_domain();
    let first = SourceLock::take(&domain).expect("the first source gets the lock");
    let error = SourceLock::take(&domain).expect_err("the second source does not");
    assert!(error.to_string().contains(&format!("pid {}", std::process::id())), "{error}");
    drop(first);
    drop(SourceLock::take(&domain).expect("the lock is free after the first source has ended"));
    assert_left_empty(&domain);
}

#[test]
fn one_reader_too_many_is_refused_and_operators_have_places_of_their_own() {
    let domain = own_domain();
    let member = Member::join(&domain, "source", Role::Source { handle_count: 2 }).expect("the domain is usable");
    let frames = member.frames().expect("the frames can be made");
    let readers: Vec<_> = (0..bench_dragon_ipc::service::MAX_READERS)
        .map(|_| FrameSubscriber::open(&domain, "test").expect("the service has room"))
        .collect();
    let error = FrameSubscriber::open(&domain, "test").expect_err("the service is full");
    assert!(matches!(error, BusError::TooManyClients { service: FRAMES }), "{error}");
    let operators = domain.clone().for_operators();
    let tools: Vec<_> = (0..bench_dragon_ipc::service::OPERATOR_READERS)
        .map(|_| FrameSubscriber::open(&operators, "test").expect("these places are reserved"))
        .collect();
    let error = FrameSubscriber::open(&operators, "test").expect_err("the service is full");
    assert!(matches!(error, BusError::TooManyClients { service: FRAMES }), "{error}");
    drop(tools);
    drop(readers);
    drop(frames);
    drop(member);
    assert_left_empty(&domain);
}

#[test]
fn a_command_without_a_connected_server_fails_with_no_server() {
    let domain = own_domain();
    let member = Member::join(&domain, "source", Role::Source { handle_count: 2 }).expect("the domain is usable");
    let commands = member.commands().expect("the commands can be made");
    let client = CommandClient::open(&domain, "test").expect("the service exists");
    let error = client
        .call(bench_dragon_ipc::Request::Pause, std::time::Duration::from_mins(1))
        .expect_err("no server is connected");
    assert!(error.is_absent(), "{error}");
    drop((client, commands, member));
    assert_left_empty(&domain);
}

#[test]
fn a_directory_that_others_may_write_is_refused() {
    use std::os::unix::fs::PermissionsExt as _;
    let domain = own_domain();
    domain.create_directory().expect("the directory can be made");
    fs::set_permissions(domain.root(), fs::Permissions::from_mode(0o777)).expect("this user owns the directory");
    let error = FrameSubscriber::open(&domain, "test").expect_err("others may write it").to_string();
    assert!(error.contains("has mode 0777, must not be writable by others: chmod 0700 it"), "{error}");
    fs::remove_dir(domain.root()).expect("the directory is empty");
}
