//! A controller whose law runs at the other end of a line.

use std::io;

use loopsight_core::{AffineModel, Command, ControlError, Controller, Tick};
use loopsight_link::{Configuration, Hello, Measured, Reply, Request, Signals, VERSION};

use super::Line;

/// Hands over what was measured and wanted, and takes the command.
pub(super) struct Remote {
    line: Line,
    configuration: Configuration,
    period_us: u32,
    session: u32,
    /// The next step; `None` before the greeting.
    tick: Option<u32>,
}

impl Remote {
    pub(super) fn new(line: Line, configuration: Configuration, period: f64) -> Self {
        Self {
            line,
            configuration,
            period_us: (period * 1e6).round() as u32,
            session: drawn(),
            tick: None,
        }
    }

    /// Greets and configures. What a robot says of itself meanwhile is of no matter.
    fn greet(&mut self) -> Result<(), ControlError> {
        let session = self.session;
        let hello = Hello {
            version: VERSION,
            session,
        };
        self.line.say(&Request::Hello(hello)).map_err(silent)?;
        loop {
            match self.line.hear().map_err(silent)? {
                Reply::Hello(welcome) if welcome.hello.version != VERSION => {
                    return Err(ControlError::AtRest("it speaks another version"));
                }
                Reply::Hello(welcome) if welcome.period_us != self.period_us => {
                    return Err(ControlError::AtRest("it was built for another period"));
                }
                Reply::Hello(welcome) if welcome.hello.session == session => break,
                _ => {}
            }
        }
        let configuration = self.configuration.clone();
        self.line
            .say(&Request::Configure {
                session,
                configuration,
            })
            .map_err(silent)?;
        loop {
            match self.line.hear().map_err(silent)? {
                Reply::Configured { session: of } if of == session => return Ok(()),
                Reply::Stopped { reason, .. } => return Err(ControlError::AtRest(reason.id())),
                _ => {}
            }
        }
    }
}

/// A number that no session before had: of the random keys that the standard library draws.
fn drawn() -> u32 {
    use std::hash::{BuildHasher, RandomState};
    RandomState::new().hash_one(std::process::id()) as u32
}

fn silent(_: io::Error) -> ControlError {
    ControlError::NoAnswer
}

fn told(values: &[f64]) -> Result<Signals, ControlError> {
    let mut list = Signals::new();
    for value in values {
        list.push(*value as f32).map_err(|_| ControlError::Sizes)?;
    }
    Ok(list)
}

impl Controller<f64> for Remote {
    fn step(
        &mut self,
        _tick: &Tick<f64>,
        reference: &[f64],
        measured: &[f64],
        _model: &mut dyn AffineModel<f64>,
        command: &mut [f64],
    ) -> Result<Command, ControlError> {
        let tick = match self.tick {
            Some(tick) => tick,
            None => {
                self.greet()?;
                0
            }
        };
        let session = self.session;
        let step = Measured {
            session,
            tick,
            age_us: 0,
            supply: 0.0,
            measured: told(measured)?,
            reference: told(reference)?,
        };
        self.line.say(&Request::Step(step)).map_err(silent)?;
        loop {
            match self.line.hear().map_err(silent)? {
                Reply::Act(act) if act.session == session && act.tick == tick => {
                    if act.command.len() != command.len() {
                        return Err(ControlError::Sizes);
                    }
                    for (to, from) in command.iter_mut().zip(&act.command) {
                        *to = f64::from(*from);
                    }
                    self.tick = Some(tick.wrapping_add(1));
                    return Ok(Command {
                        saturated: act.saturated,
                        held: act.held,
                    });
                }
                Reply::Stopped { reason, .. } => return Err(ControlError::AtRest(reason.id())),
                _ => {}
            }
        }
    }

    /// A new session begins with the next step.
    fn reset(&mut self) {
        self.session = drawn();
        self.tick = None;
    }
}

impl Drop for Remote {
    /// The robot is let go at the end of a run, and the line stays open until it has said so; one that does
    /// not hear it stops by its watchdog.
    fn drop(&mut self) {
        let session = self.session;
        if self.tick.is_none() || self.line.say(&Request::Stop { session }).is_err() {
            return;
        }
        while let Ok(reply) = self.line.hear() {
            if matches!(reply, Reply::Stopped { .. }) {
                break;
            }
        }
    }
}
