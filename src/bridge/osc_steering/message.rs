//! Messages of desks: the table of addresses, and how a packet is read. Pure.

use bench_dragon_ipc::Request;
use rosc::{OscMessage, OscPacket, OscType};

use super::admission::Secret;

/// The first part of each address.
const OURS: &str = "/dragon/";
/// The request for the state.
const STATE: &str = "state";
/// Addresses that this program sends, which another bridge may pass here.
const SENT: [&str; 2] = ["reply", "show"];
/// Greatest number of messages in a packet that are read.
const MAX_MESSAGES: usize = 16;
/// Greatest depth of nested bundles.
const DEEPEST: usize = 4;
/// Greatest length of a command's name in a reply.
const MAX_NAME_LEN: usize = 24;

/// A command by its address.
struct SteeringCommand {
    name: &'static str,
    form: Form,
    /// Whether only a listener with `--full` accepts it.
    needs_full: bool,
}

/// The arguments of a command.
#[derive(Clone, Copy)]
enum Form {
    /// None. A button sends 1 when it is pressed, and 0, which does nothing, when it is released.
    Plain(Request),
    /// A number, of which a fader sends many: the newest one replaces those that wait.
    Fader(fn(f64) -> Request),
    /// A number.
    Number(fn(f64) -> Request),
    /// The name of a cue, which a seek goes to.
    Cue,
}

const fn open(name: &'static str, form: Form) -> SteeringCommand {
    SteeringCommand { name, form, needs_full: false }
}

const fn full(name: &'static str, form: Form) -> SteeringCommand {
    SteeringCommand { name, form, needs_full: true }
}

/// All commands.
const COMMANDS: [SteeringCommand; 10] = [
    open("hold", Form::Plain(Request::Hold)),
    open("pause", Form::Plain(Request::Pause)),
    open("resume", Form::Plain(Request::Resume)),
    open("go", Form::Plain(Request::Go)),
    open("speed", Form::Fader(|speed_mps| Request::Speed { speed_mps })),
    open("pace", Form::Fader(|factor| Request::Pace { factor })),
    full("release", Form::Plain(Request::Release)),
    full("seek", Form::Number(|show_time_s| Request::Seek { show_time_s })),
    full("cue", Form::Cue),
    full("stop", Form::Plain(Request::Stop)),
];

/// The rules for messages.
#[derive(Clone, Debug, Default)]
pub(super) struct Rules {
    pub(super) secret: Option<Secret>,
    pub(super) is_full: bool,
}

/// A message for this program.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Incoming {
    /// A command. Of a fader's values, the newest one replaces those that wait.
    Command { name: &'static str, request: Request, is_fader: bool },
    /// A seek to a cue.
    Cue { name: String },
    /// A request for the state.
    State,
    /// A message that is no valid command: its name, and the reason.
    Invalid { name: String, reason: String },
    /// The secret is missing or wrong.
    NoSecret,
}

/// A packet that is no Open Sound Control, or has too many messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Malformed;

/// Reads a packet. Messages with other addresses, and released buttons, are left out.
///
/// # Errors
/// The packet is malformed: none of its messages has an effect.
pub(super) fn read(packet: &[u8], rules: &Rules) -> Result<Vec<Incoming>, Malformed> {
    let (rest, packet) = rosc::decoder::decode_udp(packet).map_err(|_| Malformed)?;
    let mut found = Vec::new();
    if !rest.is_empty() {
        return Err(Malformed);
    }
    read_packet(packet, rules, DEEPEST, &mut found)?;
    Ok(found)
}

fn read_packet(packet: OscPacket, rules: &Rules, deepest: usize, found: &mut Vec<Incoming>) -> Result<(), Malformed> {
    match packet {
        OscPacket::Bundle(_) if deepest == 0 => Err(Malformed),
        OscPacket::Bundle(bundle) => {
            bundle.content.into_iter().try_for_each(|packet| read_packet(packet, rules, deepest - 1, found))
        }
        OscPacket::Message(message) => {
            let Some(incoming) = read_message(&message, rules) else { return Ok(()) };
            if found.len() == MAX_MESSAGES {
                return Err(Malformed);
            }
            found.push(incoming);
            Ok(())
        }
    }
}

/// Reads a message; `None` for one that has no effect.
fn read_message(OscMessage { addr, args }: &OscMessage, rules: &Rules) -> Option<Incoming> {
    let name = addr.strip_prefix(OURS).filter(|name| !name.contains('/') && !SENT.contains(name))?;
    let args = match &rules.secret {
        None => args.as_slice(),
        Some(secret) => match args.split_first() {
            Some((OscType::String(shown), args)) if secret.is(shown) => args,
            _ => return Some(Incoming::NoSecret),
        },
    };
    if name == STATE {
        // With arguments it is the state that another bridge sends.
        return args.is_empty().then_some(Incoming::State);
    }
    let read = match COMMANDS.iter().find(|command| command.name == name) {
        Some(command) if command.needs_full && !rules.is_full => Err("needs bridge osc --full".to_owned()),
        Some(command) => read_command(command, args),
        None => Err(format!("no such command, must be one of {}", names())),
    };
    read.unwrap_or_else(|reason| Some(Incoming::Invalid { name: shown(name), reason }))
}

/// Reads the arguments of a command; `None` for a released button.
fn read_command(command: &SteeringCommand, args: &[OscType]) -> Result<Option<Incoming>, String> {
    let of = |request, is_fader| Incoming::Command { name: command.name, request, is_fader };
    match command.form {
        Form::Plain(request) => match args {
            [] | [OscType::Inf] => Ok(Some(of(request, false))),
            [value] => match is_pressed(value) {
                Some(is_pressed) => Ok(is_pressed.then(|| of(request, false))),
                None => Err(format!("the argument is {}, must be none or one number", in_words(value))),
            },
            _ => Err(format!("has {} arguments, must have none or one number", args.len())),
        },
        Form::Fader(request) => Ok(Some(of(request(number(args)?), true))),
        Form::Number(request) => Ok(Some(of(request(number(args)?), false))),
        Form::Cue => match args {
            [OscType::String(name)] => Ok(Some(Incoming::Cue { name: name.clone() })),
            _ => Err("must have the name of a cue as its only argument".to_owned()),
        },
    }
}

fn is_pressed(value: &OscType) -> Option<bool> {
    match value {
        OscType::Bool(value) => Some(*value),
        value => plain_number(value).map(|value| value != 0.0),
    }
}

fn number(args: &[OscType]) -> Result<f64, String> {
    match args {
        [value] => {
            let number = plain_number(value).filter(|number| number.is_finite());
            number.ok_or_else(|| format!("the argument is {}, must be one finite number", in_words(value)))
        }
        _ => Err(format!("has {} arguments, must have one number", args.len())),
    }
}

/// The value of a number of any type. Of a 32-bit number, the shortest decimal number with these bits, as it was typed.
fn plain_number(value: &OscType) -> Option<f64> {
    match value {
        OscType::Float(value) => value.to_string().parse().ok(),
        OscType::Double(value) => Some(*value),
        OscType::Int(value) => Some(f64::from(*value)),
        OscType::Long(value) => Some(*value as f64),
        _ => None,
    }
}

/// An argument in a few words. A text is not repeated: it may be a secret.
fn in_words(value: &OscType) -> String {
    match value {
        OscType::String(_) => "a text".to_owned(),
        OscType::Float(value) => value.to_string(),
        OscType::Double(value) => value.to_string(),
        _ => "of another type".to_owned(),
    }
}

fn names() -> String {
    COMMANDS.map(|command| command.name).join(", ")
}

/// A name without control characters, shortened.
fn shown(name: &str) -> String {
    name.chars().take(MAX_NAME_LEN).map(|char| if char.is_control() { '?' } else { char }).collect()
}

#[cfg(test)]
mod tests {
    use rosc::{OscBundle, OscTime, encoder};

    use super::*;

    fn packet(addr: &str, args: &[OscType]) -> OscPacket {
        OscPacket::Message(OscMessage { addr: addr.to_owned(), args: args.to_vec() })
    }

    fn bundle(content: Vec<OscPacket>) -> OscPacket {
        OscPacket::Bundle(OscBundle { timetag: OscTime { seconds: u32::MAX, fractional: 0 }, content })
    }

    fn bytes(packet: &OscPacket) -> Vec<u8> {
        encoder::encode(packet).expect("a packet")
    }

    fn full_rules() -> Rules {
        Rules { secret: None, is_full: true }
    }

    fn one(addr: &str, args: &[OscType], rules: &Rules) -> Option<Incoming> {
        let mut found = read(&bytes(&packet(addr, args)), rules).expect("a valid packet");
        assert!(found.len() < 2);
        found.pop()
    }

    fn request(addr: &str, args: &[OscType]) -> Option<Request> {
        match one(addr, args, &full_rules()) {
            Some(Incoming::Command { request, .. }) => Some(request),
            _ => None,
        }
    }

    #[test]
    fn each_address_is_a_command() {
        for (name, expected) in [
            ("hold", Request::Hold),
            ("release", Request::Release),
            ("pause", Request::Pause),
            ("resume", Request::Resume),
            ("go", Request::Go),
            ("stop", Request::Stop),
        ] {
            let address = format!("/dragon/{name}");
            for pressed in [
                vec![],
                vec![OscType::Float(1.0)],
                vec![OscType::Int(127)],
                vec![OscType::Bool(true)],
                vec![OscType::Inf],
            ] {
                assert_eq!(request(&address, &pressed), Some(expected), "{address} {pressed:?}");
            }
            for released in [OscType::Float(0.0), OscType::Int(0), OscType::Bool(false)] {
                assert_eq!(one(&address, &[released], &full_rules()), None, "{address}");
            }
        }
        for number in [[OscType::Float(0.8)], [OscType::Double(0.8)]] {
            assert_eq!(request("/dragon/speed", &number), Some(Request::Speed { speed_mps: 0.8 }));
            assert_eq!(request("/dragon/seek", &number), Some(Request::Seek { show_time_s: 0.8 }));
            assert_eq!(request("/dragon/pace", &number), Some(Request::Pace { factor: 0.8 }));
        }
        assert_eq!(request("/dragon/seek", &[OscType::Int(-30)]), Some(Request::Seek { show_time_s: -30.0 }));
        assert_eq!(request("/dragon/speed", &[OscType::Long(2)]), Some(Request::Speed { speed_mps: 2.0 }));
        assert_eq!(one("/dragon/state", &[], &Rules::default()), Some(Incoming::State));
        let cue = one("/dragon/cue", &[OscType::String("into the S".to_owned())], &full_rules());
        assert_eq!(cue, Some(Incoming::Cue { name: "into the S".to_owned() }));
    }

    #[test]
    fn a_message_that_is_no_valid_command_has_a_reason() {
        let text = || OscType::String("secret-of-another".to_owned());
        for (address, args, reason) in [
            ("/dragon/speed", vec![], "has 0 arguments, must have one number"),
            ("/dragon/speed", vec![OscType::Int(1), OscType::Int(2)], "has 2 arguments, must have one number"),
            ("/dragon/speed", vec![text()], "the argument is a text, must be one finite number"),
            ("/dragon/seek", vec![OscType::Float(f32::NAN)], "the argument is NaN, must be one finite number"),
            ("/dragon/seek", vec![OscType::Double(f64::INFINITY)], "the argument is inf, must be one finite number"),
            ("/dragon/hold", vec![text()], "the argument is a text, must be none or one number"),
            ("/dragon/cue", vec![OscType::Int(3)], "must have the name of a cue as its only argument"),
            ("/dragon/hold", vec![OscType::Nil], "the argument is of another type, must be none or one number"),
            ("/dragon/stop", vec![OscType::Int(1), OscType::Int(1)], "has 2 arguments, must have none or one number"),
            (
                "/dragon/*",
                vec![],
                "no such command, must be one of hold, pause, resume, go, speed, pace, release, seek, cue, stop",
            ),
        ] {
            let Some(Incoming::Invalid { name, reason: told }) = one(address, &args, &full_rules()) else {
                panic!("{address} {args:?} is valid");
            };
            assert_eq!((&*told, &*format!("/dragon/{name}")), (reason, address));
        }
    }

    #[test]
    fn addresses_of_others_and_of_our_own_messages_have_no_effect() {
        let long = format!("/eos/out/{}", "x".repeat(900));
        for address in
            ["/eos/out/active/cue/text", "/dragon", "/dragon/show", "/dragon/reply", "/dragon/gold/bench/0", &long]
        {
            assert_eq!(one(address, &[OscType::Float(1.0)], &full_rules()), None, "{address}");
        }
        let state = [OscType::String("held".to_owned()), OscType::Float(0.0)];
        assert_eq!(one("/dragon/state", &state, &full_rules()), None, "the state of another bridge");
    }

    #[test]
    fn release_seek_and_stop_need_full_rights() {
        for (name, args) in
            [("release", vec![]), ("stop", vec![]), ("seek", vec![OscType::Float(1.0)]), ("cue", vec![])]
        {
            let incoming = one(&format!("/dragon/{name}"), &args, &Rules::default());
            let reason = "needs bridge osc --full".to_owned();
            assert_eq!(incoming, Some(Incoming::Invalid { name: name.to_owned(), reason }));
        }
        assert!(matches!(one("/dragon/hold", &[], &Rules::default()), Some(Incoming::Command { .. })));
    }

    #[test]
    fn with_a_secret_each_message_has_it_first() {
        let rules = Rules { secret: Some("night-of-dragons".parse().expect("a secret")), is_full: true };
        let [right, wrong] = ["night-of-dragons", "night-of-dragonS"].map(|text| OscType::String(text.to_owned()));
        for args in [vec![], vec![OscType::Float(1.0)], vec![wrong], vec![OscType::Float(1.0), right.clone()]] {
            for name in ["hold", "state", "unknown"] {
                let incoming = one(&format!("/dragon/{name}"), &args, &rules);
                assert_eq!(incoming, Some(Incoming::NoSecret), "{name} {args:?}");
            }
        }
        let speed = one("/dragon/speed", &[right.clone(), OscType::Float(0.5)], &rules);
        assert!(matches!(
            speed,
            Some(Incoming::Command { request: Request::Speed { speed_mps: 0.5 }, is_fader: true, .. })
        ));
        assert_eq!(one("/dragon/hold", &[right.clone(), OscType::Int(0)], &rules), None, "a released button");
        assert_eq!(one("/dragon/state", &[right], &rules), Some(Incoming::State));
    }

    #[test]
    fn messages_of_a_bundle_are_read_in_their_order_whatever_its_time() {
        let inner = bundle(vec![packet("/dragon/pause", &[]), packet("/other", &[])]);
        let found = read(&bytes(&bundle(vec![packet("/dragon/hold", &[]), inner])), &Rules::default());
        let requests: Vec<Request> = found
            .expect("a valid packet")
            .into_iter()
            .filter_map(|incoming| if let Incoming::Command { request, .. } = incoming { Some(request) } else { None })
            .collect();
        assert_eq!(requests, [Request::Hold, Request::Pause]);
    }

    #[test]
    fn malformed_packets_have_no_effect() {
        let hold = bytes(&packet("/dragon/hold", &[]));
        let deep = (0..DEEPEST).fold(packet("/dragon/hold", &[]), |inner, _| bundle(vec![inner]));
        assert_eq!(read(&bytes(&deep), &Rules::default()).map(|found| found.len()), Ok(1));
        let many = |count| bytes(&bundle(vec![packet("/dragon/hold", &[]); count]));
        assert_eq!(read(&many(MAX_MESSAGES), &Rules::default()).map(|found| found.len()), Ok(MAX_MESSAGES));
        let unclosed = [&hold[..], &[0; 4]].concat();
        for bad in [
            &b""[..],
            b"/",
            b"hold",
            b"/dragon/hold",
            &hold[..hold.len() - 1],
            &unclosed,
            &bytes(&bundle(vec![deep])),
            &many(MAX_MESSAGES + 1),
        ] {
            assert_eq!(read(bad, &Rules::default()), Err(Malformed), "{bad:?}");
        }
    }

    #[test]
    fn no_bytes_panic() {
        let rules = Rules { secret: Some("night-of-dragons".parse().expect("a secret")), is_full: true };
        let samples = [
            bytes(&packet("/dragon/speed", &[OscType::String("night-of-dragons".to_owned()), OscType::Float(0.5)])),
            bytes(&bundle(vec![packet("/dragon/hold", &[OscType::Blob(vec![1, 2, 3])]), bundle(vec![])])),
        ];
        let mut random = fastrand::Rng::with_seed(34);
        for _ in 0..200_000 {
            let mut bytes = samples[random.usize(..samples.len())].clone();
            bytes.truncate(random.usize(..=bytes.len()));
            for _ in 0..random.usize(..4) {
                if let Some(byte) = (!bytes.is_empty()).then(|| random.usize(..bytes.len())) {
                    bytes[byte] = random.u8(..);
                }
            }
            let _ = read(&bytes, &rules);
        }
    }
}
