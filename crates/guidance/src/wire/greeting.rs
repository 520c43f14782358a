//! Lines that are no try at this protocol but the beginning of another one.
//!
//! What follows them was not meant for this daemon: a web page, for instance, can have a browser send an
//! HTTP request whose body is a line of this protocol. A JSON object begins with `{`, so nothing that is
//! meant for the daemon is taken for a greeting.

/// How many bytes of a line, white space before them left out, tell what it is.
pub const TELLING_BYTES: usize = 64;

/// Beginnings of other protocols that are no words: where the bytes stand, and which.
const BYTES: [(&str, usize, &[u8]); 15] = [
    ("TLS", 0, b"\x16\x03"),
    ("SSH", 0, b"SSH-"),
    ("HTTP", 0, b"HTTP/"),
    // The magic cookie of RFC 5389, which browsers send to the TURN servers that a page names.
    ("STUN", 4, b"\x21\x12\xa4\x42"),
    ("SOCKS", 0, b"\x04\x01"),
    ("SOCKS", 0, b"\x05\x01"),
    ("SOCKS", 0, b"\x05\x02"),
    ("SOCKS", 0, b"\x05\x03"),
    ("AMQP", 0, b"AMQP"),
    ("MQTT", 4, b"MQTT"),
    ("SMB", 4, b"\xffSMB"),
    ("SMB", 4, b"\xfeSMB"),
    ("RDP", 0, b"\x03\x00\x00"),
    ("PostgreSQL", 4, b"\x04\xd2\x16\x2f"),
    ("PostgreSQL", 4, b"\x00\x03\x00\x00"),
];
/// HTTP methods that browsers do not write in capitals for the page.
const METHODS: [&str; 10] = [
    "get", "head", "post", "put", "delete", "connect", "options", "trace", "patch", "query",
];

/// The protocol that a whole line is, if it is another one.
pub fn foreign(line: &[u8]) -> Option<&'static str> {
    foreign_beginning(line).or_else(|| ends_as_http(line).then_some("HTTP"))
}

/// The same by the beginning of a line, as much of it as [`is_telling`] wants; a longer one changes nothing.
pub fn foreign_beginning(line: &[u8]) -> Option<&'static str> {
    let bytes = BYTES
        .iter()
        .find(|(_, at, bytes)| line.get(*at..).is_some_and(|rest| rest.starts_with(bytes)));
    if let Some((name, ..)) = bytes {
        return Some(name);
    }
    let text = line.trim_ascii_start();
    let text = text[..text.len().min(TELLING_BYTES)].trim_ascii_end();
    if is_redis(text) {
        return Some("Redis");
    }
    let word = text.iter().take_while(|&&byte| is_token(byte)).count();
    let (word, after) = text.split_at(word);
    if !word.first().is_some_and(u8::is_ascii_alphabetic) {
        return None;
    }
    match after {
        [b' ', ..] if is_command(word) => Some("HTTP"),
        [b':', b' ', ..] => Some("HTTP header"),
        _ => None,
    }
}

/// Whether so much of a line is enough for [`foreign_beginning`].
pub fn is_telling(line: &[u8]) -> bool {
    line.trim_ascii_start().len() >= TELLING_BYTES
}

/// Commands of HTTP, RTSP, SIP, SMTP, FTP and their like are words in capitals; methods that a page names
/// may be in small letters.
fn is_command(word: &[u8]) -> bool {
    let capitals = !word.iter().any(u8::is_ascii_lowercase);
    capitals
        || METHODS
            .iter()
            .any(|method| word.eq_ignore_ascii_case(method.as_bytes()))
}

/// A request line of a method that nobody knows.
fn ends_as_http(line: &[u8]) -> bool {
    let line = line.trim_ascii_end();
    let end = &line[line.len().saturating_sub(9)..];
    end.starts_with(b" HTTP/")
}

/// An array of Redis, such as `*1`.
fn is_redis(line: &[u8]) -> bool {
    matches!(line, [b'*', digits @ ..] if !digits.is_empty() && digits.iter().all(u8::is_ascii_digit))
}

/// A character of an HTTP method or field name (RFC 9110, 5.6.2).
fn is_token(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || b"!#$%&'*+-.^_`|~".contains(&byte)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greetings_are_told_from_requests_and_from_rubbish() {
        for line in [
            &b"GET / HTTP/1.1\r"[..],
            b"  POST /x",
            b"patch /x HTTP/1.1",
            b"Anything /x HTTP/1.1\r",
            b"PRI * HTTP/2.0\r",
            b"M-SEARCH * HTTP/1.1\r",
            b"Content-Type: text/plain\r",
            b"EHLO me",
            b"SSH-2.0-x\r",
            b"*12\r",
            b"\x16\x03\x01\x00\xf8",
            b"\x00\x01\x00\x00\x21\x12\xa4\x42",
        ] {
            assert!(foreign(line).is_some(), "{}", String::from_utf8_lossy(line));
        }
        for line in [
            &b"{\"op\": \"health\"}"[..],
            b"{\"op\": \"health\", \"id\": \"GET / HTTP/1.1\"}",
            b"",
            b"\r",
            b"rubbish",
            b"some words of rubbish",
            b"[1, 2]",
            b"NaN",
            b"\x00\xff{]}",
            b"\xff\xfe\x00",
            b"\"GET \"",
            b"true",
            b"3 4",
            b"*",
            b"**",
        ] {
            assert_eq!(foreign(line), None, "{}", String::from_utf8_lossy(line));
        }
    }

    #[test]
    fn the_beginning_is_enough_where_the_line_is_long() {
        let mut line = b"POST /".to_vec();
        line.resize(1 << 21, b'x');
        assert!(is_telling(&line[..TELLING_BYTES]));
        assert_eq!(foreign_beginning(&line[..TELLING_BYTES]), Some("HTTP"));
        assert!(!is_telling(&[[b' '; 100].as_slice(), b"POST /"].concat()));
    }
}
