//! A listening address, the loop that answers there, and the replies: text, JSON, and refusals of one line.

use std::convert::Infallible;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderValue, StatusCode};
use axum::response::Response;
use axum::{Router, middleware};
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::time::{sleep, timeout};

use super::connection_limit::{Connection, ConnectionLimit, Permit};
use super::same_site::{Hosts, admit};
use crate::system::stop::StopFlag;

/// How long a client may take for its first line and headers, and rest between two requests.
const HEADER_PATIENCE: Duration = Duration::from_secs(10);
/// Longest first line and headers in bytes.
const MAX_HEADER_BYTES: usize = 16 << 10;
const MAX_HEADERS: usize = 64;
/// How often the stop flag is looked at.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// How long connections may take to end.
const FAREWELL: Duration = Duration::from_secs(3);
/// How long a connection may last, and then the reply that it is at. A browser makes another one; a stream is none any more.
const LIFE: Duration = Duration::from_mins(1);
const LAST_REPLY: Duration = Duration::from_secs(15);
/// How long to wait where no connection could be accepted: too many files are open, say.
const ACCEPT_PERIOD: Duration = Duration::from_millis(50);

/// An address that is listened to.
#[derive(Debug)]
pub struct Site {
    listener: TcpListener,
    /// Where it listens.
    pub address: SocketAddr,
    hosts: Hosts,
}

impl Site {
    /// Listens at an address, port 0 being any free one, for requests to this machine, by its name too where that is known,
    /// or to one of these hosts.
    ///
    /// # Errors
    /// The operating system's reason.
    pub fn open(address: SocketAddr, machine: Option<&str>, allowed: &[String]) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        Ok(Self { hosts: Hosts::new(address, machine, allowed), listener, address })
    }

    /// Answers with what the router says, until the flag is set. Then `closing` becomes true, and whoever has subscribed to it
    /// has three seconds to end and to unsubscribe.
    ///
    /// # Errors
    /// The operating system's reason why no timer or no socket can be had.
    pub fn serve(self, router: Router, stop: &StopFlag, closing: &watch::Sender<bool>) -> io::Result<()> {
        let router = router.layer(middleware::from_fn_with_state(Arc::new(self.hosts), admit));
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            tokio::select! {
                () = accept(&listener, &router, closing) => {}
                () = until(stop) => {}
            }
            drop(listener);
            closing.send_replace(true);
            // One that does not end is dropped with the runtime.
            let _ = timeout(FAREWELL, closing.closed()).await;
            Ok(())
        })
    }
}

async fn until(stop: &StopFlag) {
    while !stop.is_set() {
        sleep(LOOK_PERIOD).await;
    }
}

async fn accept(listener: &tokio::net::TcpListener, router: &Router, closing: &watch::Sender<bool>) {
    let limit = ConnectionLimit::default();
    loop {
        match listener.accept().await {
            Ok((stream, peer)) => {
                // Over the limit, while all others are being answered, it is closed at once.
                if let Some(permit) = limit.take(peer.ip()) {
                    tokio::spawn(answer(stream, router.clone(), closing.subscribe(), permit));
                }
            }
            Err(_) => sleep(ACCEPT_PERIOD).await,
        }
    }
}

async fn answer(stream: TcpStream, router: Router, mut closing: watch::Receiver<bool>, mut permit: Permit) {
    // Small messages go out at once; a socket that refuses sends them a little later.
    let _ = stream.set_nodelay(true);
    let connection = permit.connection.clone();
    let service = service_fn(move |request| reply(router.clone(), connection.clone(), request));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADER_PATIENCE)
        .max_buf_size(MAX_HEADER_BYTES)
        .max_headers(MAX_HEADERS)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades();
    let mut connection = pin!(connection);
    // A client that breaks off or speaks no HTTP has had its answer, if any.
    tokio::select! {
        _ = connection.as_mut() => return,
        () = permit.closed() => return,
        () = closed(&mut closing) => {}
        () = sleep(LIFE) => {}
    }
    connection.as_mut().graceful_shutdown();
    let _ = timeout(LAST_REPLY, connection).await;
}

/// The router's reply to a request, which bears its connection.
async fn reply(router: Router, connection: Connection, mut request: Request<Incoming>) -> Result<Response, Infallible> {
    let in_progress = connection.begin_request();
    request.extensions_mut().insert(connection);
    let response = TowerToHyperService::new(router).call(request).await;
    drop(in_progress);
    response
}

/// Returns when a site ends.
pub async fn closed(closing: &mut watch::Receiver<bool>) {
    // Where its sender is gone, the site has ended too.
    let _ = closing.wait_for(|closing| *closing).await;
}

/// Text of this media type.
pub fn text(status: StatusCode, media_type: &'static str, body: impl Into<Body>) -> Response {
    let mut response = Response::new(body.into());
    *response.status_mut() = status;
    response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(media_type));
    response
}

/// A value as JSON.
pub fn json_reply(status: StatusCode, value: &Value) -> Response {
    text(status, "application/json", format!("{value}\n"))
}

/// A refusal and its reason, in one line of JSON, for a page reads it too.
pub fn refuse(status: StatusCode, reason: &str) -> Response {
    json_reply(status, &json!({ "error": reason }))
}
