//! A robot on a desk, at the end of a socket or of a pair of pseudo terminals: the firmware's code in a thread.

#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::panic,
    reason = "shared by tests, each of which uses some of it"
)]

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixListener;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use loopsight_link::{Decoder, LONGEST, Reply, Request, encode};
use loopsight_onboard::{Sensors, Session, Twil};
use serialport::{SerialPort, TTYPort};

use crate::twil::{Body, PERIOD_US};

/// What is at the end of a line.
pub(crate) struct Desk {
    pub(crate) robot: Session<Twil, ()>,
    /// Motors and encoders, where the robot has its own.
    body: Option<Body>,
    measured: [f32; 2],
    /// Steps until it hangs up.
    pub(crate) steps: usize,
    /// Ticks of its own of which nothing arrives.
    pub(crate) loses: Vec<u32>,
    /// Supply that it measures at its ticks, V.
    pub(crate) supply: fn(u32) -> f32,
    /// The tick from which on it says that it measures what is no number.
    pub(crate) mad_from: Option<u32>,
    /// When it heard each step of its host.
    pub(crate) heard: Arc<Mutex<Vec<Instant>>>,
    /// Its periods are those of a clock, whether its host says something or not.
    pub(crate) by_clock: bool,
    ticks: u32,
}

impl Desk {
    /// A robot that its host measures.
    pub(crate) fn measured() -> Self {
        Self::new(Session::new(PERIOD_US, ()), None)
    }

    /// A robot with motors and encoders of its own.
    pub(crate) fn with_body() -> Self {
        Self::new(Session::with_sensors(PERIOD_US, ()), Some(Body::default()))
    }

    /// The same with other friction at its wheels: level in V, and speed of its smoothed sign, rad/s.
    pub(crate) fn with_friction(friction: [f64; 2]) -> Self {
        let mut body = Body::default();
        body.friction = friction;
        Self::new(Session::with_sensors(PERIOD_US, ()), Some(body))
    }

    /// A robot with a body, built for another period.
    pub(crate) fn of_period(period_us: u32) -> Self {
        let robot = Session::with_sensors(period_us, ());
        Self::new(robot, Some(Body::default()))
    }

    fn new(robot: Session<Twil, ()>, body: Option<Body>) -> Self {
        Self {
            robot,
            body,
            measured: [0.0; 2],
            steps: usize::MAX,
            loses: Vec::new(),
            supply: |_| 12.0,
            mad_from: None,
            by_clock: false,
            heard: Arc::default(),
            ticks: 0,
        }
    }

    /// Answers until the line is closed. Where it has no clock, a robot with a body has its next period as soon
    /// as a step was heard, so that tests need not wait.
    fn serve(mut self, line: &mut (impl Read + Write)) {
        let mut requests = Decoder::default();
        let mut buffer = [0; 256];
        let period = Duration::from_micros(PERIOD_US.into());
        let mut next = Instant::now() + period;
        while self.steps > 0 {
            let mut said = Vec::new();
            let length = match line.read(&mut buffer) {
                Ok(0) => return,
                Ok(length) => length,
                Err(error) if error.kind() == ErrorKind::TimedOut => 0,
                Err(_) => return,
            };
            for byte in &buffer[..length] {
                self.robot
                    .take(*byte, &mut |reply| said.push(reply.clone()));
                if let Some(Ok(Request::Step(_))) = requests.take(*byte) {
                    self.steps = self.steps.saturating_sub(1);
                    self.heard.lock().unwrap().push(Instant::now());
                    while !self.by_clock && self.period(&mut said) {}
                }
            }
            while self.by_clock && Instant::now() >= next {
                next += period;
                self.period(&mut said);
            }
            for reply in &said {
                let mut frame = [0; LONGEST];
                let length = encode(reply, &mut frame).unwrap();
                if line.write_all(&frame[..length]).is_err() {
                    return;
                }
            }
        }
    }

    /// A period of a robot with a body; true where what it says of it gets lost.
    fn period(&mut self, said: &mut Vec<Reply>) -> bool {
        let Some(body) = &mut self.body else {
            return false;
        };
        let sensors = Sensors {
            measured: self.measured,
            supply: (self.supply)(self.ticks),
        };
        self.robot
            .sensed(Some(sensors), &mut |r| said.push(r.clone()));
        let volts = self.robot.output().copied().unwrap_or_default();
        self.measured = body.drive(&volts);
        if self.mad_from.is_some_and(|from| self.ticks >= from)
            && let Some(Reply::Act(act)) = said.last_mut()
            && let Some(sensed) = &mut act.sensed
        {
            sensed.measured[0] = f32::NAN;
        }
        let lost = self.loses.contains(&self.ticks);
        if lost {
            said.pop();
        }
        self.ticks += 1;
        lost
    }

    /// The robot at a unix socket, which goes when somebody has opened it.
    pub(crate) fn at_socket(self) -> (PathBuf, JoinHandle<()>) {
        static SOCKETS: AtomicU32 = AtomicU32::new(0);
        let number = SOCKETS.fetch_add(1, Ordering::Relaxed);
        let name = format!("loopsight-{}-{number}.desk", std::process::id());
        let socket = std::env::temp_dir().join(name);
        let listener = UnixListener::bind(&socket).unwrap();
        let path = socket.clone();
        let thread = std::thread::spawn(move || {
            let (mut line, _) = listener.accept().unwrap();
            std::fs::remove_file(&path).unwrap();
            self.serve(&mut line);
        });
        (socket, thread)
    }

    /// The robot at a serial port: one of a pair of pseudo terminals.
    pub(crate) fn at_port(self) -> (PathBuf, JoinHandle<()>) {
        let (mut line, port) = TTYPort::pair().unwrap();
        let path = PathBuf::from(port.name().unwrap());
        let wait = if self.by_clock { 1 } else { 50 };
        line.set_timeout(Duration::from_millis(wait)).unwrap();
        // Kept open until the host has opened it, too: a terminal that nobody has is one that hung up.
        let thread = std::thread::spawn(move || {
            let mut first = [0];
            while matches!(line.read(&mut first), Err(e) if e.kind() == ErrorKind::TimedOut) {}
            drop(port);
            self.serve(&mut line);
        });
        (path, thread)
    }
}
