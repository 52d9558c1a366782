//! A client for tests of a real process: one request per connection.

use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// An answer.
#[derive(Debug)]
pub struct Reply {
    /// The status code.
    pub status: u16,
    /// The head of the answer.
    pub head: String,
    /// The body.
    pub body: String,
}

impl Reply {
    /// The body as JSON.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|e| panic!("not JSON ({e}): {}", self.body))
    }

    /// The entries of a page of a list.
    pub fn items(&self) -> Value {
        self.json()["items"].take()
    }
}

/// Sends a request with a JSON body (empty for none).
///
/// # Errors
/// When the server is not reachable or closes the connection.
pub fn send(address: &str, method: &str, path: &str, body: &str) -> std::io::Result<Reply> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_read_timeout(Some(Duration::from_secs(10)))?;
    let length = body.len();
    write!(
        stream,
        "{method} {path} HTTP/1.1\r\nhost: {address}\r\nconnection: close\r\ncontent-type: application/json\r\ncontent-length: {length}\r\n\r\n{body}"
    )?;
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes)?;
    let text = String::from_utf8_lossy(&bytes);
    let (head, body) = text.split_once("\r\n\r\n").ok_or(std::io::ErrorKind::UnexpectedEof)?;
    let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).ok_or(std::io::ErrorKind::InvalidData)?;
    // A body shorter than its Content-Length was cut off.
    let promised =
        head.lines().find_map(|line| line.to_ascii_lowercase().strip_prefix("content-length: ")?.parse().ok());
    if promised.is_some_and(|promised: usize| body.len() < promised) {
        return Err(std::io::ErrorKind::UnexpectedEof.into());
    }
    Ok(Reply { status, head: head.to_owned(), body: body.to_owned() })
}

/// `GET`.
///
/// # Errors
/// When the server is not reachable or closes the connection.
pub fn get(address: &str, path: &str) -> std::io::Result<Reply> {
    send(address, "GET", path, "")
}

/// `POST`.
///
/// # Errors
/// When the server is not reachable or closes the connection.
pub fn post(address: &str, path: &str, body: &Value) -> std::io::Result<Reply> {
    send(address, "POST", path, &body.to_string())
}
