//! What a host says to a robot, from the greeting to the end.

use loopsight_link::{
    Act, Configuration, Hello, Measured, Reply, Request, SIGNALS, Signals, VERSION, Welcome,
};

use super::{Line, LineError};

/// A session with a robot.
#[derive(Debug)]
pub(super) struct Conversation {
    pub(super) line: Line,
    configuration: Configuration,
    period_us: u32,
    session: u32,
    begun: bool,
}

/// A number that no session before had: of the random keys that the standard library draws.
fn drawn() -> u32 {
    use std::hash::{BuildHasher, RandomState};
    RandomState::new().hash_one(std::process::id()) as u32
}

/// Numbers as they travel; as many as the configuration has, which fits.
fn told(values: &[f64]) -> Signals {
    values.iter().map(|v| *v as f32).take(SIGNALS).collect()
}

impl Conversation {
    pub(super) fn new(line: Line, configuration: Configuration, period: f64) -> Self {
        Self {
            line,
            configuration,
            period_us: (period * 1e6).round() as u32,
            session: drawn(),
            begun: false,
        }
    }

    /// A new session, begun when something is next to be said.
    pub(super) fn renew(&mut self) {
        self.session = drawn();
        self.begun = false;
    }

    /// Greets and configures, the first time. What a robot says of itself meanwhile is of no matter.
    pub(super) fn begin(&mut self) -> Result<(), LineError> {
        if self.begun {
            return Ok(());
        }
        self.greet()?;
        self.configure()?;
        self.begun = true;
        Ok(())
    }

    /// Greets; what the robot answers.
    pub(super) fn greet(&mut self) -> Result<Welcome, LineError> {
        let session = self.session;
        let hello = Hello {
            version: VERSION,
            session,
        };
        self.line.say(&Request::Hello(hello))?;
        let welcome = self.line.hear(|reply| match reply {
            Reply::Hello(welcome) if welcome.hello.session == session => Some(Ok(welcome)),
            _ => None,
        })?;
        let line = self.line.path().to_owned();
        if welcome.hello.version != VERSION {
            return Err(LineError::Version {
                line,
                expected: VERSION,
                found: welcome.hello.version,
            });
        }
        if welcome.plant != self.configuration.plant {
            return Err(LineError::Plant {
                line,
                expected: self.configuration.plant.as_str().to_owned(),
                found: welcome.plant.as_str().to_owned(),
            });
        }
        if welcome.period_us != self.period_us {
            return Err(LineError::Period {
                line,
                expected_s: f64::from(self.period_us) * 1e-6,
                found_s: f64::from(welcome.period_us) * 1e-6,
            });
        }
        Ok(welcome)
    }

    /// Sends the configuration, and waits until it is in use.
    pub(super) fn configure(&mut self) -> Result<(), LineError> {
        let session = self.session;
        let configuration = self.configuration.clone();
        self.line.say(&Request::Configure {
            session,
            configuration,
        })?;
        self.line.hear(|reply| match reply {
            Reply::Configured { session: of } if of == session => Some(Ok(())),
            Reply::Stopped { reason, .. } => Some(Err(LineError::AtRest { reason })),
            _ => None,
        })
    }

    /// Says a step; of a robot with sensors of its own nothing was measured here.
    pub(super) fn step(
        &mut self,
        tick: u32,
        measured: &[f64],
        reference: &[f64],
    ) -> Result<(), LineError> {
        self.line.say(&Request::Step(Measured {
            session: self.session,
            tick,
            age_us: 0,
            supply: 0.0,
            measured: told(measured),
            reference: told(reference),
        }))
    }

    /// The robot's next act, with as many commands as it should have.
    pub(super) fn act(&mut self, commands: usize) -> Result<Act, LineError> {
        let session = self.session;
        let act = self.line.hear(|reply| match reply {
            Reply::Act(act) if act.session == session => Some(Ok(act)),
            Reply::Stopped { reason, .. } => Some(Err(LineError::AtRest { reason })),
            _ => None,
        })?;
        self.sized("commands", act.command.len(), commands)?;
        Ok(act)
    }

    /// An error where the robot sent another number of something than it should.
    pub(super) fn sized(
        &self,
        what: &'static str,
        found: usize,
        expected: usize,
    ) -> Result<(), LineError> {
        if found == expected {
            return Ok(());
        }
        Err(LineError::Sizes {
            line: self.line.path().to_owned(),
            what,
            found,
            expected,
        })
    }

    /// Lets the robot go, and keeps the line open until it has said that it rests.
    pub(super) fn stop(&mut self) -> Result<(), LineError> {
        if !self.begun {
            return Ok(());
        }
        self.begun = false;
        let session = self.session;
        self.line.say(&Request::Stop { session })?;
        self.line.hear(|reply| match reply {
            Reply::Stopped { .. } => Some(Ok(())),
            _ => None,
        })
    }
}
