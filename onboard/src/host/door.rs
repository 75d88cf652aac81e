//! A unix socket through which a running robot is given another model.

use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;

use loopsight_link::{Decoder, LONGEST, Reply, Request, encode};

use super::LineError;
use super::open::failed;

/// A socket that speaks the robot's protocol. No call here blocks.
pub(super) struct Door {
    path: PathBuf,
    listener: UnixListener,
    visitor: Option<(UnixStream, Decoder)>,
}

impl Door {
    /// Makes the socket. A stale one, at which nobody listens, is replaced.
    pub(super) fn open(path: &str) -> Result<Self, LineError> {
        let io = |source| failed(path, source);
        let listener = match UnixListener::bind(path) {
            Err(error) if error.kind() == ErrorKind::AddrInUse => {
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
        listener.set_nonblocking(true).map_err(io)?;
        Ok(Self {
            path: PathBuf::from(path),
            listener,
            visitor: None,
        })
    }

    /// The next request of a client, if there is one.
    pub(super) fn asked(&mut self) -> Option<Request> {
        if self.visitor.is_none() {
            let (stream, _) = self.listener.accept().ok()?;
            stream.set_nonblocking(true).ok()?;
            self.visitor = Some((stream, Decoder::default()));
        }
        let (stream, decoder) = self.visitor.as_mut()?;
        // One byte at a time: what comes after a request stays where it is until that is answered.
        let mut byte = [0];
        loop {
            match stream.read(&mut byte) {
                Ok(1..) => {
                    if let Some(Ok(request)) = decoder.take(byte[0]) {
                        return Some(request);
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => return None,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Ok(0) | Err(_) => {
                    self.visitor = None;
                    return None;
                }
            }
        }
    }

    /// Answers the client. One that has gone is dropped.
    pub(super) fn answer(&mut self, reply: &Reply) {
        let Some((stream, _)) = &mut self.visitor else {
            return;
        };
        let mut bytes = [0; LONGEST];
        let written = encode(reply, &mut bytes)
            .map_err(io::Error::other)
            .and_then(|length| stream.write_all(&bytes[..length]));
        if written.is_err() {
            self.visitor = None;
        }
    }
}

impl Drop for Door {
    fn drop(&mut self) {
        // Nothing is left to be done about a socket that somebody else removed.
        let _ = std::fs::remove_file(&self.path);
    }
}
