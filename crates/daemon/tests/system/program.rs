//! The program `uwguide` in a folder of its own, as tests start, ask, signal and end it.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use crate::client::Client;
use crate::support::{Numbers, echo_model, profile};

/// A folder with a profile, and a program started in it.
pub(crate) struct Program {
    pub(crate) folder: tempfile::TempDir,
    pub(crate) child: Option<Child>,
    pub(crate) stderr: Option<BufReader<std::process::ChildStderr>>,
}

impl Program {
    pub(crate) fn folder() -> Self {
        let folder = tempfile::tempdir().unwrap();
        profile(&mut Numbers::new(3))
            .write(&folder.path().join("profile.json"))
            .unwrap();
        // A model that states all about itself, so that nothing is warned of.
        let model = echo_model(-2.0, 0.02).to_string();
        std::fs::write(folder.path().join("model.json"), model).unwrap();
        Self {
            folder,
            child: None,
            stderr: None,
        }
    }

    pub(crate) fn write(self, name: &str, text: &str) -> Self {
        std::fs::write(self.folder.path().join(name), text).unwrap();
        self
    }

    pub(crate) fn config(self, text: &str) -> Self {
        self.write(
            "config.toml",
            &format!("format = \"uwguide-config/1\"\n{text}"),
        )
    }

    pub(crate) fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn command(&self, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_uwguide"));
        command.current_dir(self.folder.path());
        command.args(["--model", "model.json"]);
        if !more.contains(&"--no-profile") {
            command.args(["--profile", "profile.json"]);
        }
        if self.path("config.toml").exists() {
            command.args(["--config", "config.toml"]);
        }
        command.args(more);
        command
    }

    pub(crate) fn start(mut self, more: &[&str]) -> Self {
        let mut child = self.command(more).stderr(Stdio::piped()).spawn().unwrap();
        self.stderr = child.stderr.take().map(BufReader::new);
        self.child = Some(child);
        self
    }

    pub(crate) fn output(&self, more: &[&str]) -> Output {
        self.command(more).output().unwrap()
    }

    /// What follows the words in the next line that holds them.
    pub(crate) fn told(&mut self, words: &str) -> String {
        let stderr = self.stderr.as_mut().unwrap();
        loop {
            let mut line = String::new();
            assert_ne!(
                stderr.read_line(&mut line).unwrap(),
                0,
                "no line with {words:?}"
            );
            if let Some((_, rest)) = line.split_once(words) {
                return rest.trim().to_owned();
            }
        }
    }

    /// What follows each of `words`, in whatever order they are told: the log is written by a thread of its own.
    pub(crate) fn told_both(&mut self, words: [&str; 2]) -> [String; 2] {
        let mut told = [None, None];
        let stderr = self.stderr.as_mut().unwrap();
        while told.contains(&None) {
            let mut line = String::new();
            let read = stderr.read_line(&mut line).unwrap();
            assert_ne!(read, 0, "no lines with {words:?}");
            for (told, words) in told.iter_mut().zip(words) {
                let rest = line.split_once(words).map(|(_, rest)| rest.trim());
                *told = told.take().or(rest.map(str::to_owned));
            }
        }
        told.map(Option::unwrap)
    }

    pub(crate) fn client(&mut self) -> Client {
        let address = self.told("uwguide listening on ");
        Client::to(address.parse().unwrap())
    }

    pub(crate) fn signal(&self, name: &str) {
        let id = self.child.as_ref().unwrap().id().to_string();
        let done = Command::new("kill").args([name, &id]).status().unwrap();
        assert!(done.success());
    }

    pub(crate) fn end(&mut self) -> Option<i32> {
        self.signal("-TERM");
        self.child.as_mut().unwrap().wait().unwrap().code()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The permissions of a file.
pub(crate) fn mode(path: &Path) -> u32 {
    std::fs::metadata(path).unwrap().permissions().mode() & 0o777
}

pub(crate) fn set_mode(path: &Path, mode: u32) {
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
}

/// Makes a named pipe.
pub(crate) fn pipe(path: &Path) {
    let made = Command::new("mkfifo").arg(path).status().unwrap();
    assert!(made.success());
}

pub(crate) const ANY_PORT: [&str; 2] = ["--listen", "127.0.0.1:0"];
pub(crate) const TOKEN: &str = "a-token-of-some-length";

/// Status line and body of what the metrics port says.
pub(crate) fn get(address: &str, path: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream
        .write_all(format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n").as_bytes())
        .unwrap();
    let mut reply = String::new();
    stream.read_to_string(&mut reply).unwrap();
    let (head, body) = reply.split_once("\r\n\r\n").unwrap();
    (head.lines().next().unwrap().to_owned(), body.to_owned())
}
