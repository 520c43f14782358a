//! From bytes to lines.

use tokio::io::{self, AsyncBufRead, AsyncBufReadExt};

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
    /// The peer has closed its side.
    End,
}

/// Splits a stream into lines. No more than one line and the reader's own buffer are held.
#[derive(Debug)]
pub struct Lines<R> {
    reader: R,
    line: Vec<u8>,
    dropping: bool,
}

impl<R: AsyncBufRead + Unpin> Lines<R> {
    /// Lines of a buffered stream.
    pub fn new(reader: R) -> Self {
        Self {
            reader,
            line: Vec::new(),
            dropping: false,
        }
    }

    /// Waits for the next line. May be cancelled while it waits: bytes read so far are kept.
    pub async fn next(&mut self) -> io::Result<Frame> {
        loop {
            let bytes = self.reader.fill_buf().await?;
            if bytes.is_empty() {
                let rest = std::mem::take(&mut self.line);
                return Ok(if rest.is_empty() {
                    Frame::End
                } else {
                    Frame::Line(rest)
                });
            }
            let newline = bytes.iter().position(|&byte| byte == b'\n');
            let part = &bytes[..newline.unwrap_or(bytes.len())];
            let used = part.len() + usize::from(newline.is_some());
            let too_long = !self.dropping && self.line.len() + part.len() > MAX_LINE_BYTES;
            if !self.dropping && !too_long {
                self.line.extend_from_slice(part);
            }
            self.reader.consume(used);
            if too_long {
                self.line = Vec::new();
                self.dropping = newline.is_none();
                return Ok(Frame::TooLong);
            }
            if newline.is_some() && !std::mem::take(&mut self.dropping) {
                return Ok(Frame::Line(std::mem::take(&mut self.line)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn frames(bytes: &[u8], buffer: usize) -> Vec<Frame> {
        let mut lines = Lines::new(io::BufReader::with_capacity(buffer, bytes));
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
}
