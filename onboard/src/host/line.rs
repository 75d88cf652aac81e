//! A line to a robot: a unix socket.

use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use loopsight_link::{Decoder, LONGEST, Reply, Request, encode};

/// A line, opened when something is first said.
#[derive(Debug)]
pub struct Line {
    socket: String,
    timeout: Duration,
    stream: Option<UnixStream>,
    decoder: Decoder,
    buffer: [u8; 256],
    come: usize,
    looked_at: usize,
}

impl Line {
    /// The line at a unix socket, with the time (s) that an answer may take.
    pub fn at(socket: &str, timeout_s: f64) -> Self {
        Self {
            socket: socket.to_owned(),
            timeout: Duration::from_secs_f64(timeout_s.clamp(1e-3, 1e6)),
            stream: None,
            decoder: Decoder::default(),
            buffer: [0; 256],
            come: 0,
            looked_at: 0,
        }
    }

    fn open(&mut self) -> io::Result<&mut UnixStream> {
        if self.stream.is_none() {
            let stream = UnixStream::connect(&self.socket)?;
            stream.set_read_timeout(Some(self.timeout))?;
            stream.set_write_timeout(Some(self.timeout))?;
            self.stream = Some(stream);
        }
        self.stream
            .as_mut()
            .ok_or_else(|| io::ErrorKind::NotConnected.into())
    }

    /// Says something.
    pub fn say(&mut self, request: &Request) -> io::Result<()> {
        let mut bytes = [0; LONGEST];
        let length = encode(request, &mut bytes).map_err(io::Error::other)?;
        self.open()?.write_all(&bytes[..length])
    }

    /// The next message that is whole; broken ones are passed over. An error where none comes in time.
    pub fn hear(&mut self) -> io::Result<Reply> {
        loop {
            while self.looked_at < self.come {
                let byte = self.buffer[self.looked_at];
                self.looked_at += 1;
                if let Some(Ok(reply)) = self.decoder.take(byte) {
                    return Ok(reply);
                }
            }
            let mut buffer = self.buffer;
            let come = self.open()?.read(&mut buffer)?;
            if come == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            (self.buffer, self.come, self.looked_at) = (buffer, come, 0);
        }
    }
}
