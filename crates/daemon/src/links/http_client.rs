//! Just enough of an HTTP/1.1 client for JSON over plain connections: one exchange a connection.

use std::io::{self, Error, ErrorKind};
use std::time::Duration;

use serde_json::Value;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

/// Largest answer that is read, bytes.
const MAX_ANSWER_BYTES: u64 = 1 << 20;
/// How long one exchange may take.
const EXCHANGE_TIME: Duration = Duration::from_secs(2);

/// Asks for a path, or sends a body to it; the JSON of the answer.
pub(super) async fn exchange(address: &str, path: &str, body: Option<&Value>) -> io::Result<Value> {
    let bytes = timeout(EXCHANGE_TIME, bytes_of(address, path, body)).await??;
    parse(&bytes)
}

async fn bytes_of(address: &str, path: &str, body: Option<&Value>) -> io::Result<Vec<u8>> {
    let mut stream = TcpStream::connect(address).await?;
    let (method, body) = match body {
        None => ("GET", String::new()),
        Some(value) => ("POST", value.to_string()),
    };
    let request = format!(
        "{method} {path} HTTP/1.1\r\nHost: {address}\r\nAccept: application/json\r\n\
         Content-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(request.as_bytes()).await?;
    let mut bytes = Vec::new();
    stream
        .take(MAX_ANSWER_BYTES)
        .read_to_end(&mut bytes)
        .await?;
    Ok(bytes)
}

/// The body of a successful answer as JSON; an empty one is null.
fn parse(bytes: &[u8]) -> io::Result<Value> {
    let invalid = |what: &str| Error::new(ErrorKind::InvalidData, what.to_owned());
    let end = bytes
        .windows(4)
        .position(|four| four == b"\r\n\r\n")
        .ok_or_else(|| invalid("the answer has no end of its head"))?;
    let head = String::from_utf8_lossy(&bytes[..end]).to_ascii_lowercase();
    let status = head.split(' ').nth(1).unwrap_or_default();
    if status != "200" {
        return Err(invalid(&format!("the answer has status {status:.20}")));
    }
    let body = &bytes[end + 4..];
    let chunked = head
        .lines()
        .any(|line| line.starts_with("transfer-encoding:") && line.contains("chunked"));
    let body = if chunked {
        unchunk(body).ok_or_else(|| invalid("the answer's chunks are broken"))?
    } else {
        body.to_vec()
    };
    if body.iter().all(u8::is_ascii_whitespace) {
        return Ok(Value::Null);
    }
    serde_json::from_slice(&body).map_err(|error| Error::new(ErrorKind::InvalidData, error))
}

fn unchunk(mut body: &[u8]) -> Option<Vec<u8>> {
    let mut whole = Vec::new();
    loop {
        let end = body.windows(2).position(|two| two == b"\r\n")?;
        let size = std::str::from_utf8(&body[..end]).ok()?;
        let size = usize::from_str_radix(size.split(';').next()?.trim(), 16).ok()?;
        if size == 0 {
            return Some(whole);
        }
        let rest = body.get(end + 2..)?;
        whole.extend_from_slice(rest.get(..size)?);
        body = rest.get(size.checked_add(2)?..)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn plain_and_chunked_bodies_are_read_and_failures_told() {
        let plain = b"HTTP/1.1 200 OK\r\nContent-Length: 7\r\n\r\n{\"a\":1}";
        assert_eq!(parse(plain).unwrap(), json!({"a": 1}));
        let chunked =
            b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n3\r\n{\"a\r\n4;x\r\n\":1}\r\n0\r\n\r\n";
        assert_eq!(parse(chunked).unwrap(), json!({"a": 1}));
        assert_eq!(parse(b"HTTP/1.1 200 OK\r\n\r\n").unwrap(), Value::Null);
        for bad in [
            &b"HTTP/1.1 404 Not Found\r\n\r\n{}"[..],
            b"HTTP/1.1 200 OK\r\n",
            b"HTTP/1.1 200 OK\r\n\r\n{",
            b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n{}",
            b"",
        ] {
            assert!(parse(bad).is_err(), "{}", String::from_utf8_lossy(bad));
        }
    }
}
