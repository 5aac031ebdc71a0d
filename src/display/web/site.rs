//! A listening address, the loop that serves it, and the replies: text, JSON, and refusals of one line.

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
use super::same_site::{Admission, Hosts, admit};
use crate::system::stop::StopFlag;

/// Timeout for a request's first line and headers, and for the pause between two requests.
const HEADER_TIMEOUT: Duration = Duration::from_secs(10);
/// Greatest length of a request's first line and headers, in bytes.
const MAX_HEADER_BYTES: usize = 16 << 10;
const MAX_HEADERS: usize = 64;
/// Period at which the stop flag is checked.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// Timeout for the end of all connections.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(3);
/// Greatest lifetime of a connection, after which the reply in progress has a timeout. A browser opens a new connection.
/// Streams are exempt, since an upgraded socket leaves this loop.
const LIFE: Duration = Duration::from_mins(1);
const LAST_REPLY: Duration = Duration::from_secs(15);
/// Wait after a failed accept, for example because too many files are open.
const ACCEPT_PERIOD: Duration = Duration::from_millis(50);

/// A listening address.
#[derive(Debug)]
pub struct Site {
    listener: TcpListener,
    /// The address at which the site listens.
    pub address: SocketAddr,
    admission: Admission,
}

impl Site {
    /// Listens at an address; port 0 takes any free port. Requests may name this machine, by its name too if `machine` has it,
    /// or one of the `allowed` hosts.
    ///
    /// # Errors
    /// The operating system's reason.
    pub fn open(address: SocketAddr, machine: Option<&str>, allowed: &[String]) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let admission = Admission { hosts: Hosts::new(address, machine, allowed), passes_foreign_pages: false };
        Ok(Self { listener, address, admission })
    }

    /// Passes pages of other sites on to the router, marked as `ForeignPage`: it refuses those without the token. A request may show the
    /// token in its query, as `token=`.
    #[must_use]
    pub fn with_foreign_pages(mut self) -> Self {
        self.admission.passes_foreign_pages = true;
        self
    }

    /// Serves the router until the flag is set. Then `closing` becomes true, and all its subscribers have three seconds to end
    /// and to unsubscribe.
    ///
    /// # Errors
    /// The operating system's reason if the timer or the socket cannot be created.
    pub fn serve(self, router: Router, stop: &StopFlag, closing: &watch::Sender<bool>) -> io::Result<()> {
        let router = router.layer(middleware::from_fn_with_state(Arc::new(self.admission), admit));
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            tokio::select! {
                () = accept(&listener, &router, closing) => {}
                () = until(stop) => {}
            }
            drop(listener);
            closing.send_replace(true);
            // A connection that does not end in time is dropped with the runtime.
            let _ = timeout(CLOSE_TIMEOUT, closing.closed()).await;
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
                // At the limit, with no idle connection, the new one is closed at once.
                if let Some(permit) = limit.take(peer.ip()) {
                    tokio::spawn(answer(stream, router.clone(), closing.subscribe(), permit));
                }
            }
            Err(_) => sleep(ACCEPT_PERIOD).await,
        }
    }
}

async fn answer(stream: TcpStream, router: Router, mut closing: watch::Receiver<bool>, mut permit: Permit) {
    // With this option, small messages are sent at once. Without it they are sent a little later, so an error is ignored.
    let _ = stream.set_nodelay(true);
    let connection = permit.connection.clone();
    let service = service_fn(move |request| reply(router.clone(), connection.clone(), request));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADER_TIMEOUT)
        .max_buf_size(MAX_HEADER_BYTES)
        .max_headers(MAX_HEADERS)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades();
    let mut connection = pin!(connection);
    // If the client disconnects or sends no valid HTTP, the connection is complete.
    tokio::select! {
        _ = connection.as_mut() => return,
        () = permit.closed() => return,
        () = closed(&mut closing) => {}
        () = sleep(LIFE) => {}
    }
    connection.as_mut().graceful_shutdown();
    let _ = timeout(LAST_REPLY, connection).await;
}

/// Returns the router's reply to a request, to which it adds the connection as an extension.
async fn reply(router: Router, connection: Connection, mut request: Request<Incoming>) -> Result<Response, Infallible> {
    let in_progress = connection.begin_request();
    request.extensions_mut().insert(connection);
    let response = TowerToHyperService::new(router).call(request).await;
    drop(in_progress);
    response
}

/// Returns when a site ends.
pub async fn closed(closing: &mut watch::Receiver<bool>) {
    // If the sender is dropped, the site has ended too.
    let _ = closing.wait_for(|closing| *closing).await;
}

/// Returns a reply with text of this media type.
pub fn text(status: StatusCode, media_type: &'static str, body: impl Into<Body>) -> Response {
    let mut response = Response::new(body.into());
    *response.status_mut() = status;
    response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(media_type));
    response
}

/// The media type of JSON.
pub const JSON: &str = "application/json";

/// Returns a reply with a value as JSON.
pub fn json_reply(status: StatusCode, value: &Value) -> Response {
    text(status, JSON, format!("{value}\n"))
}

/// Returns a refusal and its reason, in one line of JSON, so that a page can read it.
pub fn refuse(status: StatusCode, reason: &str) -> Response {
    json_reply(status, &json!({ "error": reason }))
}
