//! What a receiving bridge listens to and asks for.

use std::sync::Arc;

use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Reply;
use zenoh::sample::Sample;
use zenoh::{Session, Wait as _};

use super::inbox::Inbox;
use super::keys::KeyPrefix;

/// What is listened to, for as long as this is kept.
#[derive(Debug)]
pub(super) struct Subscriptions {
    _samples: [Subscriber<()>; 3],
    _source: Subscriber<()>,
}

/// Has what comes under the keys put into the inbox.
pub(super) fn subscribe(session: &Session, prefix: &KeyPrefix, inbox: &Arc<Inbox>) -> zenoh::Result<Subscriptions> {
    let to = |put: fn(&Inbox, &Sample)| {
        let inbox = Arc::clone(inbox);
        move |sample: Sample| put(&inbox, &sample)
    };
    let subscriptions = Subscriptions {
        _samples: [
            session.declare_subscriber(prefix.description()).callback(to(Inbox::put_description)).wait()?,
            session.declare_subscriber(prefix.alerts()).callback(to(Inbox::put_alert)).wait()?,
            session.declare_subscriber(prefix.frames()).callback(to(Inbox::put_frame)).wait()?,
        ],
        _source: session
            .liveliness()
            .declare_subscriber(prefix.source())
            .history(true)
            .callback(to(|inbox, sample| inbox.put_liveliness(sample.kind())))
            .wait()?,
    };
    Ok(subscriptions)
}

/// Has the description put there that the other side has.
pub(super) fn ask_for_description(session: &Session, prefix: &KeyPrefix, inbox: &Arc<Inbox>) -> zenoh::Result<()> {
    let inbox = Arc::clone(inbox);
    let take = move |reply: Reply| {
        if let Ok(sample) = reply.result() {
            inbox.put_description(sample);
        }
    };
    session
        .get(prefix.description())
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::InteractiveHigh)
        .callback(take)
        .wait()
}
