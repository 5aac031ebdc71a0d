//! Keys, endpoints and configuration files of a bridge over zenoh.

use std::io::Write as _;
use std::sync::atomic::AtomicBool;

use bench_dragon::bridge::zenoh::{
    BridgeError, BridgeSession, KeyPrefix, KeyPrefixError, SessionSettings, Side, check_endpoint,
};

#[test]
fn a_prefix_has_words_and_no_wildcards() {
    for sound in ["bench-dragon/dragon", "a", "hall 3/über/α"] {
        assert!(sound.parse::<KeyPrefix>().is_ok(), "{sound}");
    }
    for odd in ["", "/a", "a/", "a//b", "a/*", "**", "a$*", "a?b", "a#", &"a".repeat(201)] {
        assert_eq!(odd.parse::<KeyPrefix>(), Err(KeyPrefixError), "{odd}");
    }
}

#[test]
fn errors_of_a_configuration_file_are_one_line() {
    for text in ["{", "{ mode: 'pear' }", "{ lisen: {} }", "[]", "{ listen: { endpoints: ['nowhere'] } }"] {
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        file.write_all(text.as_bytes()).expect("a file");
        let settings = SessionSettings { config: Some(file.path().to_owned()), ..SessionSettings::default() };
        let error = BridgeSession::open(&settings, Side::Sending, &AtomicBool::new(false), |_| ()).expect_err(text);
        let message = error.to_string();
        assert!(matches!(error, BridgeError::Settings(_)), "{text}: {message}");
        assert!(
            message.starts_with(&file.path().display().to_string()) && !message.contains('\n'),
            "{text}: {message}"
        );
    }
}

#[test]
fn endpoints_are_those_of_links_that_are_built_in() {
    for sound in ["tcp/127.0.0.1:7447", "tcp/[::1]:0", "tls/stage.example:7447"] {
        assert_eq!(check_endpoint(sound).as_deref(), Ok(sound));
    }
    for odd in [
        "",
        "127.0.0.1:7447",
        "tcp",
        "tcp/10.0.0.1",
        "tls/stage.example:seven",
        "udp/10.0.0.1:7447",
        "quic/10.0.0.1:7447",
    ] {
        assert!(check_endpoint(odd).is_err(), "{odd}");
    }
}
