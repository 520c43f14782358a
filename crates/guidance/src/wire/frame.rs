//! From bytes to lines.

use tokio::io::{self, AsyncBufRead, AsyncBufReadExt};

use crate::wire::greeting::{foreign, foreign_beginning, is_telling};

/// Longest line, bytes without the newline: part of the protocol, and what one connection can make the
/// daemon hold in memory.
pub const MAX_LINE_BYTES: usize = 1 << 20;

/// What comes next from a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Frame {
    /// A line without its newline; also what precedes the end of the stream.
    Line(Vec<u8>),
    /// A line is longer than [`MAX_LINE_BYTES`]; told once, its rest is dropped.
    TooLong,
    /// A line that begins another protocol, whose name this is. It is told as soon as the beginning tells;
    /// nothing that follows is ever a line, whether or not it is here already.
    Foreign(&'static str),
    /// The peer has closed its side, or has spoken another protocol.
    End,
}

/// Splits a stream into lines. No more than one line and the reader's own buffer are held.
#[derive(Debug)]
pub struct Lines<R> {
    reader: R,
    line: Vec<u8>,
    dropping: bool,
    /// Whether lines that begin another protocol end it.
    strict: bool,
    /// Whether the beginning of the line has been judged.
    judged: bool,
    /// The peer speaks another protocol.
    ended: bool,
}

impl<R: AsyncBufRead + Unpin> Lines<R> {
    /// Lines of a buffered stream, whatever they are.
    pub fn new(reader: R) -> Self {
        Self {
            reader,
            strict: false,
            line: Vec::new(),
            dropping: false,
            judged: false,
            ended: false,
        }
    }

    /// Lines of a client, which end where another protocol begins.
    pub fn of_client(reader: R) -> Self {
        Self {
            strict: true,
            ..Self::new(reader)
        }
    }

    /// Waits for the next line. May be cancelled while it waits: bytes read so far are kept.
    pub async fn next(&mut self) -> io::Result<Frame> {
        if self.ended {
            return Ok(Frame::End);
        }
        loop {
            let bytes = self.reader.fill_buf().await?;
            if bytes.is_empty() {
                return Ok(match self.line.is_empty() {
                    true => Frame::End,
                    false => self.take(),
                });
            }
            let newline = bytes.iter().position(|&byte| byte == b'\n');
            let part = &bytes[..newline.unwrap_or(bytes.len())];
            let used = part.len() + usize::from(newline.is_some());
            if self.dropping {
                self.reader.consume(used);
                self.dropping = newline.is_none();
                continue;
            }
            let room = MAX_LINE_BYTES - self.line.len();
            let too_long = part.len() > room;
            self.line.extend_from_slice(&part[..part.len().min(room)]);
            self.reader.consume(used);
            if self.strict && !self.judged && (too_long || is_telling(&self.line)) {
                self.judged = true;
                if let Some(protocol) = foreign_beginning(&self.line) {
                    return Ok(self.end(protocol));
                }
            }
            if too_long {
                self.line = Vec::new();
                self.judged = false;
                self.dropping = newline.is_none();
                return Ok(Frame::TooLong);
            }
            if newline.is_some() {
                return Ok(self.take());
            }
        }
    }

    /// Reads and forgets what the peer still sends, until it closes.
    pub async fn discard(&mut self) -> io::Result<()> {
        self.line = Vec::new();
        loop {
            let count = self.reader.fill_buf().await?.len();
            if count == 0 {
                return Ok(());
            }
            self.reader.consume(count);
        }
    }

    /// The line as it is now.
    fn take(&mut self) -> Frame {
        self.judged = false;
        let line = std::mem::take(&mut self.line);
        match foreign(&line).filter(|_| self.strict) {
            Some(protocol) => self.end(protocol),
            None => Frame::Line(line),
        }
    }

    fn end(&mut self, protocol: &'static str) -> Frame {
        self.ended = true;
        self.line = Vec::new();
        Frame::Foreign(protocol)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn frames(bytes: &[u8], buffer: usize) -> Vec<Frame> {
        let mut lines = Lines::of_client(io::BufReader::with_capacity(buffer, bytes));
        let mut frames = Vec::new();
        loop {
            let frame = lines.next().await.unwrap();
            frames.push(frame.clone());
            if frame == Frame::End {
                return frames;
            }
        }
    }

    fn line(text: &str) -> Frame {
        Frame::Line(text.as_bytes().to_vec())
    }

    #[tokio::test]
    async fn lines_come_whole_whatever_the_pieces() {
        for buffer in [1, 3, 64] {
            let got = frames(b"one\n\nthree", buffer).await;
            assert_eq!(got, [line("one"), line(""), line("three"), Frame::End]);
        }
    }

    #[tokio::test]
    async fn a_line_of_the_limit_passes_and_one_byte_more_is_told_once() {
        let mut bytes = vec![b'x'; MAX_LINE_BYTES];
        bytes.push(b'\n');
        assert_eq!(frames(&bytes, 8192).await.len(), 2);
        bytes.insert(0, b'x');
        bytes.extend_from_slice(b"next\n");
        assert_eq!(
            frames(&bytes, 8192).await,
            [Frame::TooLong, line("next"), Frame::End]
        );
        let endless = vec![b'x'; 3 * MAX_LINE_BYTES];
        assert_eq!(frames(&endless, 8192).await, [Frame::TooLong, Frame::End]);
    }

    #[tokio::test]
    async fn nothing_behind_another_protocol_is_a_line() {
        let mut long = b"{}\nPOST /".to_vec();
        long.resize(2 * MAX_LINE_BYTES, b'x');
        long.extend_from_slice(b" HTTP/1.1\r\n\r\n{}\n");
        for buffer in [1, 3, 64, 8192] {
            let expected = [line("{}"), Frame::Foreign("HTTP"), Frame::End];
            let request = b"{}\nPOST / HTTP/1.1\r\n\r\n{}\n";
            assert_eq!(frames(request, buffer).await, expected);
            assert_eq!(frames(&long, buffer.max(64)).await, expected);
            assert_eq!(
                frames(b"{}\nSSH-2.0", buffer).await[1],
                Frame::Foreign("SSH")
            );
        }
    }
}
