//! A unix socket through which a running robot is given another model.

use std::fs::Permissions;
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use loopsight_link::{Decoder, LONGEST, Note, Reply, Request, encode};

use super::LineError;
use super::open::failed;

/// How long a visitor may say nothing that is a request.
const IDLE: Duration = Duration::from_secs(2);

/// A socket that speaks the robot's protocol. No call here blocks, and none takes in more than one frame of bytes.
pub(super) struct Door {
    path: PathBuf,
    listener: UnixListener,
    visitor: Option<Visitor>,
}

/// Who stands at the door.
struct Visitor {
    stream: UnixStream,
    decoder: Decoder,
    /// Bytes that came behind a request, and are not decoded yet: `bytes[from..to]`.
    bytes: [u8; LONGEST],
    from: usize,
    to: usize,
    heard: Instant,
    /// The session with which it greeted in this version.
    session: Option<u32>,
}

impl Visitor {
    fn new(stream: UnixStream) -> Self {
        Self {
            stream,
            decoder: Decoder::default(),
            bytes: [0; LONGEST],
            from: 0,
            to: 0,
            heard: Instant::now(),
            session: None,
        }
    }

    /// The next request among the bytes of one reading; an error where the visitor has gone.
    fn asked(&mut self) -> io::Result<Option<Request>> {
        if self.from == self.to {
            match self.stream.read(&mut self.bytes) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(length) => (self.from, self.to) = (0, length),
                Err(error)
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
                Err(error) => return Err(error),
            }
        }
        for byte in &self.bytes[self.from..self.to] {
            self.from += 1;
            if let Some(Ok(request)) = self.decoder.take(*byte) {
                self.heard = Instant::now();
                return Ok(Some(request));
            }
        }
        if self.heard.elapsed() > IDLE {
            return Err(ErrorKind::TimedOut.into());
        }
        Ok(None)
    }
}

impl Door {
    /// Makes the socket, which its owner alone may use. A stale one, at which nobody listens, is replaced; what is
    /// no socket never is.
    pub(super) fn open(path: &str) -> Result<Self, LineError> {
        let io = |source| failed(path, source);
        let listener = match UnixListener::bind(path) {
            Err(error) if error.kind() == ErrorKind::AddrInUse => {
                if !is_socket(Path::new(path)) {
                    let message = "there is something that is no socket, which is not replaced";
                    return Err(io(io::Error::new(ErrorKind::AlreadyExists, message)));
                }
                let left = matches!(UnixStream::connect(path), Err(e) if e.kind() == ErrorKind::ConnectionRefused);
                if !left {
                    let line = path.to_owned();
                    return Err(LineError::Busy { line });
                }
                std::fs::remove_file(path).map_err(io)?;
                UnixListener::bind(path)
            }
            other => other,
        };
        let listener = listener.map_err(io)?;
        let door = Self {
            path: PathBuf::from(path),
            listener,
            visitor: None,
        };
        std::fs::set_permissions(path, Permissions::from_mode(0o600)).map_err(io)?;
        door.listener.set_nonblocking(true).map_err(io)?;
        Ok(door)
    }

    /// The next request of a client, if there is one. A second client is told that there is a first.
    pub(super) fn asked(&mut self) -> Option<Request> {
        if let Ok((mut stream, _)) = self.listener.accept() {
            let ready = stream.set_nonblocking(true).is_ok();
            if ready && self.visitor.is_none() {
                self.visitor = Some(Visitor::new(stream));
            } else if ready {
                // It is told as far as it listens.
                let _ = say(&mut stream, &Reply::Log(Note::Busy));
            }
        }
        let asked = self.visitor.as_mut()?.asked();
        if asked.is_err() {
            self.visitor = None;
        }
        asked.ok().flatten()
    }

    /// The client greeted with this session.
    pub(super) fn greeted(&mut self, session: u32) {
        if let Some(visitor) = &mut self.visitor {
            visitor.session = Some(session);
        }
    }

    /// Whether the client greeted with this session.
    pub(super) fn knows(&self, session: u32) -> bool {
        let visitor = self.visitor.as_ref();
        visitor.is_some_and(|visitor| visitor.session == Some(session))
    }

    /// Answers the client. One that has gone, or does not listen, is dropped.
    pub(super) fn answer(&mut self, reply: &Reply) {
        if let Some(visitor) = &mut self.visitor
            && say(&mut visitor.stream, reply).is_err()
        {
            self.visitor = None;
        }
    }
}

fn say(stream: &mut UnixStream, reply: &Reply) -> io::Result<()> {
    let mut bytes = [0; LONGEST];
    let length = encode(reply, &mut bytes).map_err(io::Error::other)?;
    stream.write_all(&bytes[..length])
}

fn is_socket(path: &Path) -> bool {
    std::fs::symlink_metadata(path).is_ok_and(|found| found.file_type().is_socket())
}

impl Drop for Door {
    fn drop(&mut self) {
        if is_socket(&self.path) {
            // Nothing is left to be done about a socket that somebody else removed.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use loopsight_link::{Hello, VERSION};

    use super::*;

    fn hello(session: u32) -> Request {
        Request::Hello(Hello {
            version: VERSION,
            session,
        })
    }

    fn frame(request: &Request) -> Vec<u8> {
        let mut bytes = [0; LONGEST];
        let length = encode(request, &mut bytes).unwrap();
        bytes[..length].to_vec()
    }

    #[test]
    fn only_a_socket_is_ever_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("precious.csv");
        std::fs::write(&path, "time_s\n0\n").unwrap();
        let error = Door::open(path.to_str().unwrap()).err().unwrap();
        assert!(error.to_string().contains("no socket"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "time_s\n0\n");

        let path = folder.path().join("door");
        // A socket that was left behind is replaced.
        drop(UnixListener::bind(&path).unwrap());
        let door = Door::open(path.to_str().unwrap()).unwrap();
        let mode = std::fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        // Nor is what took its place.
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, "mine").unwrap();
        drop(door);
        assert!(path.exists());
    }

    #[test]
    fn a_flood_costs_a_tick_one_frame_and_no_request_is_lost() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("door");
        let mut door = Door::open(path.to_str().unwrap()).unwrap();
        let mut visitor = UnixStream::connect(&path).unwrap();
        let noise = vec![7; 20 * LONGEST];
        visitor.write_all(&noise).unwrap();
        visitor.write_all(&[0]).unwrap();
        visitor.write_all(&frame(&hello(3))).unwrap();
        visitor.write_all(&frame(&hello(4))).unwrap();
        let mut calls = 0;
        let mut heard = Vec::new();
        while heard.len() < 2 && calls < 100 {
            calls += 1;
            heard.extend(door.asked());
        }
        assert!((21..60).contains(&calls), "{calls}");
        assert_eq!(heard, [hello(3), hello(4)]);
        assert!(!door.knows(4));
        door.greeted(4);
        assert!(door.knows(4) && !door.knows(3));
    }

    #[test]
    fn a_second_visitor_is_told_and_an_idle_one_leaves() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("door");
        let mut door = Door::open(path.to_str().unwrap()).unwrap();
        let _first = UnixStream::connect(&path).unwrap();
        assert_eq!(door.asked(), None);
        let mut second = UnixStream::connect(&path).unwrap();
        assert_eq!(door.asked(), None);
        let mut bytes = Vec::new();
        second.read_to_end(&mut bytes).unwrap();
        let mut decoder = Decoder::default();
        let told: Vec<Reply> = bytes
            .iter()
            .filter_map(|b| decoder.take(*b)?.ok())
            .collect();
        assert_eq!(told, [Reply::Log(Note::Busy)]);
        let visitor = door.visitor.as_mut().unwrap();
        visitor.heard = visitor.heard.checked_sub(2 * IDLE).unwrap();
        assert_eq!(door.asked(), None);
        assert!(door.visitor.is_none());
    }
}
