//! A robot that speaks lines of text over TCP.

use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::time::{Duration, Instant};

use loopsight_core::{Driver, DriverFault, Sample};
use loopsight_model::declare_part;
use loopsight_model::registry::{
    BuildError, DriverContext, DriverPart, HostDriver, HostDriverError, PartMeta, Setting,
};
use serde::{Deserialize, Serialize};

/// A robot behind a TCP connection, one line of text for each question and each answer.
///
/// ```text
/// read                ->  Y1 Y2 …     the measured signals, in the order of the model
/// write U1 U2 …       ->  U1 U2 …     the inputs as they were applied, within the robot's limits
/// stop                ->  anything
/// ```
///
/// Numbers are in SI units with a decimal point, between blanks. A robot that does not answer in
/// time, or hangs up, is [`DriverFault::Disconnected`]; an answer that is not the numbers asked for
/// is [`DriverFault::Io`].
///
/// Reference: RFC 9293 (2022), "Transmission Control Protocol".
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TcpLines {
    address: String,
    #[serde(default = "one")]
    timeout_s: f64,
}

fn one() -> f64 {
    1.0
}

const META: PartMeta = PartMeta {
    id: "tcp_lines",
    role: "driver",
    summary: "a robot behind a TCP connection that answers lines of text",
    equation: "read -> measured signals; write inputs -> inputs applied; stop",
    reference: "RFC 9293 (2022), Transmission Control Protocol",
    example: "[driver.tcp_lines]\naddress = \"192.168.4.1:5555\"\n",
    settings: &[
        Setting::new("address", "", "host and port of the robot; no default"),
        Setting::new("timeout_s", "s", "longest wait for an answer; default: 1"),
    ],
};

#[typetag::serde(name = "tcp_lines")]
impl DriverPart for TcpLines {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn build(&self, _context: &DriverContext<'_>) -> Result<HostDriver, BuildError> {
        let timeout = Duration::try_from_secs_f64(self.timeout_s).ok();
        let Some(timeout) = timeout.filter(|t| !t.is_zero()) else {
            let message = format!(
                "`timeout_s` is {} s, expected a number above 0 s",
                self.timeout_s
            );
            return Err(BuildError::at("timeout_s", message));
        };
        Ok(Box::new(Robot {
            address: self.address.clone(),
            timeout,
            connection: None,
            line: String::with_capacity(256),
            started: Instant::now(),
        }))
    }

    fn is_simulated(&self) -> bool {
        false
    }
}

declare_part!(&META);

/// The driver at work.
struct Robot {
    address: String,
    timeout: Duration,
    /// Made by the first question: files can be checked while the robot is off.
    connection: Option<BufReader<TcpStream>>,
    /// The line that is sent or was received, reused.
    line: String,
    started: Instant,
}

fn wrong(fault: DriverFault, message: String) -> HostDriverError {
    HostDriverError { fault, message }
}

/// Connects to the first of the addresses.
fn connect(address: &str, timeout: Duration) -> std::io::Result<BufReader<TcpStream>> {
    let found = address.to_socket_addrs()?.next();
    let found = found.ok_or_else(|| std::io::Error::other("no such address"))?;
    let stream = TcpStream::connect_timeout(&found, timeout)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(timeout))?;
    stream.set_write_timeout(Some(timeout))?;
    Ok(BufReader::new(stream))
}

impl Robot {
    /// Sends the line; the answer takes its place.
    fn ask(&mut self) -> Result<(), HostDriverError> {
        let asked = self.exchange();
        asked.map_err(|why| {
            let message = format!("the robot at {} does not answer: {why}", self.address);
            wrong(DriverFault::Disconnected, message)
        })
    }

    fn exchange(&mut self) -> std::io::Result<()> {
        let stream = match &mut self.connection {
            Some(stream) => stream,
            None => self
                .connection
                .insert(connect(&self.address, self.timeout)?),
        };
        self.line.push('\n');
        stream.get_mut().write_all(self.line.as_bytes())?;
        self.line.clear();
        match stream.read_line(&mut self.line)? {
            0 => Err(std::io::Error::other("it hung up")),
            _ => Ok(()),
        }
    }

    /// The answer's numbers, as many as there is room for.
    fn numbers(&self, to: &mut [f64]) -> Result<(), HostDriverError> {
        let mut words = self.line.split_whitespace();
        let given = words.clone().count();
        let understood = given == to.len()
            && to.iter_mut().all(|to| match words.next().map(str::parse) {
                Some(Ok(number)) => {
                    *to = number;
                    true
                }
                _ => false,
            });
        if understood {
            return Ok(());
        }
        let answer = self.line.trim_end();
        let message = format!(
            "the robot answers `{answer}`, expected {} numbers",
            to.len()
        );
        Err(wrong(DriverFault::Io, message))
    }
}

impl Driver<f64> for Robot {
    type Error = HostDriverError;

    fn read(&mut self, measured: &mut [f64]) -> Result<Sample<f64>, HostDriverError> {
        self.line.clear();
        self.line.push_str("read");
        self.ask()?;
        self.numbers(measured)?;
        Ok(Sample {
            time: self.started.elapsed().as_secs_f64(),
            fresh: true,
        })
    }

    fn write(&mut self, command: &[f64], applied: &mut [f64]) -> Result<(), HostDriverError> {
        if let Some(bad) = command.iter().find(|c| !c.is_finite()) {
            let message = format!("a command is {bad}, expected a finite number");
            return Err(wrong(DriverFault::Rejected, message));
        }
        self.line.clear();
        self.line.push_str("write");
        for value in command {
            // Writing to a String cannot fail.
            let _ = write!(self.line, " {value}");
        }
        self.ask()?;
        self.numbers(applied)
    }

    fn safe_stop(&mut self) -> Result<(), HostDriverError> {
        if self.connection.is_none() {
            return Ok(());
        }
        self.line.clear();
        self.line.push_str("stop");
        self.ask()
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    /// A robot that answers with these lines and hangs up.
    fn robot(answers: &'static [&'static str]) -> Robot {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        std::thread::spawn(move || {
            let (stream, _) = listener.accept().unwrap();
            let mut lines = BufReader::new(stream);
            for answer in answers {
                let mut asked = String::new();
                lines.read_line(&mut asked).unwrap();
                let answer = answer.replace("ECHO", asked.trim_start_matches("write "));
                let stream = lines.get_mut();
                stream.write_all(answer.trim_end().as_bytes()).unwrap();
                stream.write_all(b"\n").unwrap();
            }
        });
        Robot {
            address: address.to_string(),
            timeout: Duration::from_secs(10),
            connection: None,
            line: String::new(),
            started: Instant::now(),
        }
    }

    #[test]
    fn measurements_and_commands_go_over_the_line() {
        let mut driver = robot(&["0.25 -3e-2", "ECHO", "done"]);
        let (mut y, mut applied) = ([0.0; 2], [0.0; 2]);
        assert!(driver.read(&mut y).unwrap().fresh);
        assert_eq!(y, [0.25, -0.03]);
        driver.write(&[0.5, -1.5], &mut applied).unwrap();
        assert_eq!(applied, [0.5, -1.5]);
        driver.safe_stop().unwrap();
        let error = driver.read(&mut y).unwrap_err();
        assert_eq!(error.fault, DriverFault::Disconnected);
    }

    #[test]
    fn answers_that_are_no_numbers_are_shown() {
        let mut driver = robot(&["low battery", "1 2 3", "1"]);
        let mut y = [0.0; 2];
        for said in ["low battery", "1 2 3", "1"] {
            let error = driver.read(&mut y).unwrap_err();
            assert_eq!(error.fault, DriverFault::Io);
            assert!(error.message.contains(said), "{error}");
        }
        let error = driver.write(&[f64::NAN], &mut [0.0]).unwrap_err();
        assert_eq!(error.fault, DriverFault::Rejected);
    }
}
