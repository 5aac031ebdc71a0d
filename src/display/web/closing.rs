//! The end of a WebSocket.

use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket};
use tokio::time::timeout;

/// Timeout for the other side's answer to a close frame.
const TIMEOUT: Duration = Duration::from_secs(2);

/// Sends a close frame and reads until the other side has answered it (RFC 6455, section 7.1.1). If a socket is closed while it has
/// unread messages, TCP resets the connection, and the other side can lose the close frame. Without an answer in time, it is dropped.
pub(in crate::display) async fn close(mut socket: WebSocket, code: u16, reason: &'static str) {
    let frame = CloseFrame { code, reason: Utf8Bytes::from_static(reason) };
    let end = async {
        if socket.send(Message::Close(Some(frame))).await.is_ok() {
            while let Some(Ok(_)) = socket.recv().await {}
        }
    };
    let _ = timeout(TIMEOUT, end).await;
}
