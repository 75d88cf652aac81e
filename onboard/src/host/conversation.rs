//! The host's end of the conversation with a robot.

use std::collections::VecDeque;

use loopsight_link::{
    Act, Configuration, Hello, Measured, Note, Reason, Reply, Request, SIGNALS, Signals, Unusable,
    VERSION, Welcome,
};

use super::changeable::Allowed;
#[cfg(unix)]
use super::door::Door;
use super::{Line, LineError};

/// A session with a robot.
pub(super) struct Conversation {
    pub(super) line: Line,
    configuration: Configuration,
    period_us: u32,
    session: u32,
    begun: bool,
    /// Acts that arrived while another message was awaited.
    acts: VecDeque<Act>,
    #[cfg(unix)]
    door: Option<Door>,
    door_at: Option<String>,
    allowed: Allowed,
    welcome: Option<Welcome>,
}

/// What a robot answered to a greeting.
#[derive(Debug)]
pub(super) struct Greeted {
    pub(super) welcome: Welcome,
    /// Another program runs it, and answered for it.
    pub(super) runs: bool,
    /// The greeting stopped it.
    pub(super) interrupted: bool,
}

/// A random number for a session, from the random keys of the standard library's hasher.
fn drawn() -> u32 {
    use std::hash::{BuildHasher, RandomState};
    RandomState::new().hash_one(std::process::id()) as u32
}

/// Numbers in single precision, as messages carry them.
fn told(values: &[f64]) -> Signals {
    values.iter().map(|v| *v as f32).take(SIGNALS).collect()
}

/// What is wrong with a configuration, naming the effect.
fn named(what: Unusable, configuration: &Configuration) -> String {
    let of = |i: u8| {
        let effect = configuration.effects.get(usize::from(i));
        effect.map_or("?", |effect| effect.id.as_str())
    };
    match what {
        Unusable::Effect(i) => format!("the effect `{}` is not known to its firmware", of(i)),
        Unusable::Channel(i) => {
            format!(
                "the effect `{}` acts where its firmware compensates nothing",
                of(i)
            )
        }
        Unusable::Reads(i) => format!("the effect `{}` reads what it does not know", of(i)),
        other => other.to_string(),
    }
}

impl Conversation {
    pub(super) fn new(line: Line, configuration: Configuration, period: f64) -> Self {
        Self {
            line,
            configuration,
            period_us: (period * 1e6).round() as u32,
            session: drawn(),
            begun: false,
            acts: VecDeque::new(),
            #[cfg(unix)]
            door: None,
            door_at: None,
            allowed: Allowed::default(),
            welcome: None,
        }
    }

    /// The same, with a socket through which a running robot is given another model, as far as that is allowed.
    pub(super) fn with_door(mut self, at: Option<&String>, allowed: Allowed) -> Self {
        self.door_at = at.cloned();
        self.allowed = allowed;
        self
    }

    /// Drops the session: the next message begins a new one.
    pub(super) fn renew(&mut self) {
        self.session = drawn();
        self.begun = false;
        self.acts.clear();
    }

    /// Greets and configures the robot if that was not done yet.
    pub(super) fn begin(&mut self) -> Result<(), LineError> {
        if self.begun {
            return Ok(());
        }
        self.welcome = Some(self.greet()?.welcome);
        self.configure()?;
        #[cfg(unix)]
        if let Some(at) = &self.door_at
            && self.door.is_none()
        {
            self.door = Some(Door::open(at)?);
        }
        self.begun = true;
        Ok(())
    }

    /// Greets the robot; returns its answer.
    pub(super) fn greet(&mut self) -> Result<Greeted, LineError> {
        let session = self.session;
        let hello = Hello {
            version: VERSION,
            session,
        };
        self.line.say(&Request::Hello(hello))?;
        let (mut runs, mut interrupted) = (false, false);
        let path = self.line.path().to_owned();
        let welcome = self.line.hear(|reply| {
            match reply {
                Reply::Hello(welcome) if welcome.hello.session == session => {
                    return Some(Ok(welcome));
                }
                Reply::Log(Note::Runs) => runs = true,
                Reply::Log(Note::Busy) => return Some(Err(LineError::Busy { line: path.clone() })),
                Reply::Stopped { reason, .. } => interrupted = reason == Reason::HostRestarted,
                _ => {}
            }
            None
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
        Ok(Greeted {
            welcome,
            runs,
            interrupted,
        })
    }

    /// Sends the configuration, and waits until it is in use.
    pub(super) fn configure(&mut self) -> Result<(), LineError> {
        let session = self.session;
        let configuration = self.configuration.clone();
        self.line.say(&Request::Configure {
            session,
            configuration,
        })?;
        let acts = &mut self.acts;
        let refused = self.line.hear(|reply| match reply {
            Reply::Configured { session: of } if of == session => Some(Ok(None)),
            Reply::Stopped { reason, .. } => Some(Ok(Some(reason))),
            // A robot that runs by its own timer does not wait for this.
            Reply::Act(act) if act.session == session => {
                acts.push_back(act);
                None
            }
            _ => None,
        })?;
        match refused {
            None => Ok(()),
            Some(Reason::Configuration(what)) => Err(LineError::Refused {
                line: self.line.path().to_owned(),
                what: named(what, &self.configuration),
                unusable: what,
            }),
            Some(reason) => Err(LineError::AtRest { reason }),
        }
    }

    /// Passes another model on to the robot, if one came through the door; returns a remark for the log.
    #[cfg(unix)]
    pub(super) fn serve(&mut self) -> Result<Option<String>, LineError> {
        let Some(mut door) = self.door.take() else {
            return Ok(None);
        };
        let mut said = Ok(None);
        // One request per tick.
        match (door.asked(), &self.welcome) {
            (Some(Request::Hello(hello)), Some(welcome)) => {
                let session = hello.session;
                if hello.version == VERSION {
                    door.greeted(session);
                }
                let hello = Hello {
                    session,
                    version: VERSION,
                };
                door.answer(&Reply::Log(Note::Runs));
                door.answer(&Reply::Hello(Welcome {
                    hello,
                    ..welcome.clone()
                }));
            }
            (
                Some(Request::Configure {
                    session,
                    configuration,
                }),
                _,
            ) => {
                let refused = |reason| Reply::Stopped {
                    session,
                    tick: 0,
                    reason,
                };
                let taken = self.allowed.change(&self.configuration, configuration);
                match taken {
                    _ if !door.knows(session) => door.answer(&refused(Reason::OtherSession)),
                    Err(what) => {
                        door.answer(&refused(Reason::Configuration(what)));
                        let why = "another model was refused at the door while the robot drives";
                        said = Ok(Some(format!("{why}: {what}")));
                    }
                    Ok(configuration) => {
                        self.configuration = configuration;
                        let done = self.configure();
                        door.answer(&match &done {
                            Ok(()) => Reply::Configured { session },
                            Err(error) => refused(error.reason()),
                        });
                        said = done.map(|()| Some(self.changed()));
                    }
                }
            }
            // Nobody but this run moves or stops the robot.
            _ => {}
        }
        self.door = Some(door);
        said
    }

    /// Without unix sockets there is no door.
    #[cfg(not(unix))]
    pub(super) fn serve(&mut self) -> Result<Option<String>, LineError> {
        Ok(None)
    }

    fn changed(&self) -> String {
        let effects = self.configuration.effects.iter().map(|e| e.id.as_str());
        let effects: Vec<&str> = effects.collect();
        match &effects[..] {
            [] => "the robot was told another model, without effects".to_owned(),
            some => format!("the robot was told another model, with {}", some.join(", ")),
        }
    }

    /// Sends a step with a measurement that is `age` periods old. For a robot with sensors of its own the
    /// measurement is empty.
    pub(super) fn step(
        &mut self,
        tick: u32,
        periods: u32,
        measured: &[f64],
        reference: &[f64],
    ) -> Result<(), LineError> {
        self.line.say(&Request::Step(Measured {
            session: self.session,
            tick,
            age_us: periods.saturating_mul(self.period_us),
            supply: 0.0,
            measured: told(measured),
            reference: told(reference),
        }))
    }

    /// The robot's next act; an error if its number of commands is wrong.
    pub(super) fn act(&mut self, commands: usize) -> Result<Act, LineError> {
        let session = self.session;
        let act = match self.acts.pop_front() {
            Some(act) => act,
            None => self.line.hear(|reply| match reply {
                Reply::Act(act) if act.session == session => Some(Ok(act)),
                Reply::Stopped { reason, .. } => Some(Err(LineError::AtRest { reason })),
                _ => None,
            })?,
        };
        self.sized("commands", act.command.len(), commands)?;
        self.numbers("commands", &act.command)?;
        Ok(act)
    }

    /// An error if the robot sent another number of values than expected.
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

    /// An error if the robot sent what is no number.
    pub(super) fn numbers(&self, what: &'static str, values: &[f32]) -> Result<(), LineError> {
        match values.iter().find(|value| !value.is_finite()) {
            None => Ok(()),
            Some(found) => Err(LineError::NotFinite {
                line: self.line.path().to_owned(),
                what,
                found: *found,
            }),
        }
    }

    /// Stops the robot, and waits until it says that it is at rest.
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
