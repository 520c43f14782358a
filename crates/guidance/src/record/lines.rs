//! Newline-delimited JSON: a line for each start, reload, answer and pushed message.

use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write};
use std::path::Path;

use base64::Engine as _;
use serde_json::Value;

use super::{Entry, Lost, write_some};

/// Bytes that wait in memory for one write.
const BUFFER_BYTES: usize = 8192;

/// The line of an entry.
pub(super) fn line(entry: &Entry) -> Value {
    let mut value = entry.facts();
    value["reply"] = entry.reply.clone().into();
    match entry.line.as_deref().map(std::str::from_utf8) {
        Some(Ok(text)) => value["line"] = text.into(),
        Some(Err(_)) => {
            let bytes = entry.line.as_deref().unwrap_or_default();
            let text = base64::engine::general_purpose::STANDARD.encode(bytes);
            value["line_base64"] = text.into();
        }
        None => {}
    }
    value
}

/// Writes whole lines behind a buffer. What cannot be written is given up, and the next line begins a new
/// line also where the one before was cut.
pub(super) struct LineWriter<W> {
    out: W,
    waiting: Vec<u8>,
    /// Whether what was written last ends a line.
    at_start: bool,
}

impl<W: Write> LineWriter<W> {
    pub(super) fn new(out: W, at_start: bool) -> Self {
        Self {
            out,
            waiting: Vec::new(),
            at_start,
        }
    }

    /// Takes a line.
    pub(super) fn write(&mut self, line: &Value) -> Result<(), Lost> {
        self.waiting.extend_from_slice(line.to_string().as_bytes());
        self.waiting.push(b'\n');
        match self.waiting.len() < BUFFER_BYTES {
            true => Ok(()),
            false => self.flush(),
        }
    }

    pub(super) fn flush(&mut self) -> Result<(), Lost> {
        let waiting = std::mem::take(&mut self.waiting);
        if waiting.is_empty() {
            return Ok(());
        }
        let mut written = 0;
        let outcome = self.push(&waiting, &mut written);
        outcome.map_err(|error| Lost {
            records: ends(&waiting[written..]),
            error,
        })
    }

    fn push(&mut self, bytes: &[u8], written: &mut usize) -> io::Result<()> {
        while !self.at_start {
            self.at_start = write_some(&mut self.out, b"\n")? == 1;
        }
        while *written < bytes.len() {
            *written += write_some(&mut self.out, &bytes[*written..])?;
            self.at_start = bytes[..*written].ends_with(b"\n");
        }
        Ok(())
    }
}

/// Ends of lines.
fn ends(bytes: &[u8]) -> u64 {
    bytes.iter().map(|&byte| u64::from(byte == b'\n')).sum()
}

/// Whether a file is empty or ends with a line's end; one that cannot be read is taken for one that does.
pub(super) fn ends_a_line(path: &Path) -> bool {
    let last = || -> io::Result<u8> {
        let mut file = File::open(path)?;
        let mut last = [b'\n'];
        if file.seek(SeekFrom::End(-1)).is_ok() {
            file.read_exact(&mut last)?;
        }
        Ok(last[0])
    };
    !path.is_file() || last().is_ok_and(|byte| byte == b'\n')
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// A disk with room for so many bytes.
    struct Disk {
        room: usize,
        bytes: Vec<u8>,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let count = bytes.len().min(self.room);
            if count == 0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.room -= count;
            self.bytes.extend_from_slice(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_line_never_goes_on_where_another_was_cut() {
        for room in 0..40 {
            let disk = Disk {
                room,
                bytes: Vec::new(),
            };
            let mut lines = LineWriter::new(disk, true);
            for k in 0..3 {
                lines.write(&json!({"early": k})).unwrap();
            }
            let lost = match lines.flush() {
                Ok(()) => 0,
                Err(lost) => lost.records,
            };
            lines.out.room = 1000;
            lines.write(&json!({"late": 0})).unwrap();
            lines.flush().unwrap();
            let text = String::from_utf8(lines.out.bytes).unwrap();
            let whole = |line: &&str| serde_json::from_str::<Value>(line).is_ok();
            assert!(text.ends_with("{\"late\":0}\n"), "{room}: {text:?}");
            let kept = text.lines().filter(whole).count() - 1;
            let torn = text.lines().count() - 1 - kept;
            assert!(torn <= 1, "{room}: {text:?}");
            // A line that lacks its end only is whole after all.
            let expected = 3 - usize::try_from(lost).unwrap();
            assert!(
                kept == expected || (kept == expected + 1 && torn == 0),
                "{room}: {text:?}"
            );
        }
    }
}
