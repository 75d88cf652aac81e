//! A line to a robot: a serial port, or a unix socket.

use std::fmt::Debug;
use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

use loopsight_link::{Decoder, LONGEST, Reason, Reply, Request, Unusable, encode};

use super::open::{self, Stream};

/// Why a robot cannot be talked to.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LineError {
    /// There is no such file.
    #[error("there is no line `{line}`{}", listed(.ports))]
    Missing {
        /// The line.
        line: String,
        /// Serial ports of this machine.
        ports: Vec<String>,
    },
    /// The file may not be opened.
    #[error(
        "there is no permission to open `{line}`: on most systems the group of the file (`ls -l {line}`, \
         often `dialout`) may"
    )]
    Permission {
        /// The line.
        line: String,
    },
    /// Neither a serial port nor a socket.
    #[error("`{line}` is {found}, expected a serial port or a unix socket")]
    NotALine {
        /// The line.
        line: String,
        /// What it is.
        found: &'static str,
    },
    /// Another program has it.
    #[error("`{line}` is in use by another program")]
    Busy {
        /// The line.
        line: String,
    },
    /// Nobody listens at this socket.
    #[error("nobody listens at the socket `{line}`")]
    Nobody {
        /// The line.
        line: String,
    },
    /// It was opened, and fails.
    #[error("the line `{line}` fails: {source}")]
    Io {
        /// The line.
        line: String,
        /// What the system says.
        source: io::Error,
    },
    /// Nothing came in time.
    #[error(
        "the robot at `{line}` has not answered for {timeout_s} s: is it switched on{}?",
        .baud.map_or_else(String::new, |b| format!(", and does it talk at {b} baud"))
    )]
    NoAnswer {
        /// The line.
        line: String,
        /// How long the host waited, s.
        timeout_s: f64,
        /// Baud rate of a serial port.
        baud: Option<u32>,
    },
    /// The other end was closed.
    #[error("the robot at `{line}` hung up")]
    HungUp {
        /// The line.
        line: String,
    },
    /// The robot speaks another version of the protocol.
    #[error(
        "the robot at `{line}` speaks version {found} of the protocol, expected {expected}: build its \
         firmware anew"
    )]
    Version {
        /// The line.
        line: String,
        /// Version of this host.
        expected: u16,
        /// Version of the robot.
        found: u16,
    },
    /// The robot was built for another period.
    #[error("the robot at `{line}` was built for a period of {found_s} s, expected {expected_s} s")]
    Period {
        /// The line.
        line: String,
        /// Period of the loop, s.
        expected_s: f64,
        /// Period of the robot, s.
        found_s: f64,
    },
    /// The robot was built for another plant.
    #[error("the robot at `{line}` was built for the plant `{found}`, expected `{expected}`")]
    Plant {
        /// The line.
        line: String,
        /// Plant of the model.
        expected: String,
        /// Plant of the robot.
        found: String,
    },
    /// The robot is at rest.
    #[error("the robot has come to rest: {reason}")]
    AtRest {
        /// Why.
        reason: Reason,
    },
    /// The robot cannot use what it was told, and is at rest.
    #[error("the robot at `{line}` refuses what it was told, and is at rest: {what}")]
    Refused {
        /// The line.
        line: String,
        /// What is wrong.
        what: String,
        /// The same, as the robot said it.
        unusable: Unusable,
    },
    /// The robot sent another number of values than its plant has.
    #[error("the robot at `{line}` sent {found} {what}, expected {expected}")]
    Sizes {
        /// The line.
        line: String,
        /// Of what.
        what: &'static str,
        /// How many came.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// The robot sent what is no number.
    #[error("the robot at `{line}` sent {found} among its {what}, expected a number")]
    NotFinite {
        /// The line.
        line: String,
        /// Of what.
        what: &'static str,
        /// What it sent.
        found: f32,
    },
}

impl LineError {
    /// The robot's reason to be at rest, if it is.
    pub(super) fn reason(&self) -> Reason {
        match self {
            LineError::AtRest { reason } => *reason,
            LineError::Refused { unusable, .. } => Reason::Configuration(*unusable),
            _ => Reason::LinkLost,
        }
    }
}

fn listed(ports: &[String]) -> String {
    if ports.is_empty() {
        ", and no serial port at all: is the robot plugged in?".to_owned()
    } else {
        format!("; serial ports here: {}", ports.join(", "))
    }
}

/// A line to a robot. It is opened when the first message is sent.
pub struct Line {
    path: String,
    baud: u32,
    timeout: Duration,
    stream: Option<Box<dyn Stream>>,
    decoder: Decoder,
    buffer: [u8; 256],
    come: usize,
    looked_at: usize,
}

impl Debug for Line {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Line({:?}, open: {})", self.path, self.stream.is_some())
    }
}

impl Line {
    /// The line at a serial port (`/dev/ttyACM0`, with its baud rate) or a unix socket (which has none),
    /// with the time (s) that an answer may take.
    pub fn at(path: &str, baud: u32, timeout_s: f64) -> Self {
        Self {
            path: path.to_owned(),
            baud,
            timeout: Duration::from_secs_f64(timeout_s.clamp(1e-3, 1e6)),
            stream: None,
            decoder: Decoder::default(),
            buffer: [0; 256],
            come: 0,
            looked_at: 0,
        }
    }

    /// Its path.
    pub fn path(&self) -> &str {
        &self.path
    }

    fn open(&mut self) -> Result<&mut Box<dyn Stream>, LineError> {
        match &mut self.stream {
            Some(stream) => Ok(stream),
            none => {
                let mut stream = open::open(&self.path, self.baud, self.timeout)?;
                // What somebody else left of a frame ends here.
                let io = |source| open::failed(&self.path, source);
                stream.write_all(&[0]).map_err(io)?;
                Ok(none.insert(stream))
            }
        }
    }

    /// Sends a message.
    ///
    /// # Errors
    ///
    /// The line cannot be opened, or fails.
    pub fn say(&mut self, request: &Request) -> Result<(), LineError> {
        let mut bytes = [0; LONGEST];
        let path = self.path.clone();
        let io = |source| open::failed(&path, source);
        let length = encode(request, &mut bytes).map_err(|e| io(io::Error::other(e)))?;
        self.open()?.write_all(&bytes[..length]).map_err(io)
    }

    /// Hears until a message is the one that is waited for, or the time is over. Broken messages are passed
    /// over.
    pub fn hear<T>(
        &mut self,
        mut wanted: impl FnMut(Reply) -> Option<Result<T, LineError>>,
    ) -> Result<T, LineError> {
        let until = Instant::now() + self.timeout;
        loop {
            while self.looked_at < self.come {
                let byte = self.buffer[self.looked_at];
                self.looked_at += 1;
                if let Some(Ok(reply)) = self.decoder.take(byte)
                    && let Some(heard) = wanted(reply)
                {
                    return heard;
                }
            }
            let mut buffer = self.buffer;
            let come = match self.open()?.read(&mut buffer) {
                Ok(0) => {
                    let line = self.path.clone();
                    return Err(LineError::HungUp { line });
                }
                Ok(come) => come,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => 0,
                Err(error) => match error.kind() {
                    io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
                        return Err(self.silent());
                    }
                    _ => return Err(open::failed(&self.path, error)),
                },
            };
            (self.buffer, self.come, self.looked_at) = (buffer, come, 0);
            // Somebody who talks of other things all the time is no answer.
            if Instant::now() > until {
                return Err(self.silent());
            }
        }
    }

    fn silent(&self) -> LineError {
        let port = self.stream.as_ref().is_some_and(|s| s.has_baud());
        LineError::NoAnswer {
            line: self.path.clone(),
            timeout_s: self.timeout.as_secs_f64(),
            baud: port.then_some(self.baud),
        }
    }
}
