//! `[driver.serial]`: a robot that runs its loop itself.

use std::any::Any;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use loopsight_core::{
    AffineModel, Command, ControlError, Controller, Driver, DriverFault, Quantity, Sample, Tick,
};
use loopsight_link::Act;
use loopsight_model::declare_part;
use loopsight_model::registry::{
    BuildError, ControllerPart, DriverContext, DriverPart, HalfError, Halves, HostDriver,
    HostDriverError, PartMeta, Setting,
};
use serde::{Deserialize, Serialize};

use super::conversation::Conversation;
use super::remote::kind;
use super::told::{Told, widen};
use super::{Aboard, Line, LineError, baud, rate, timeout, waits};

/// A robot with motors and encoders of its own, which runs its loop by its own timer. The host sends its
/// configuration (`[controller.aboard]`) and its references, and hears what it measured and did.
///
/// The robot keeps the time: the loop on the host ticks when a report of the robot arrives. The robot follows
/// the reference that it heard last, one period later than the file has it; the log has what the robot
/// followed. A tick whose report was lost is in the log with the values before it, marked as not fresh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Serial {
    /// Serial port or unix socket at which the robot is found.
    pub line: String,
    /// Baud rate of a serial port, 1/s.
    #[serde(default = "baud")]
    pub baud: u32,
    /// How long the robot may be silent, s.
    #[serde(default = "timeout")]
    pub timeout_s: f64,
}

const META: PartMeta = PartMeta {
    id: "serial",
    role: "driver",
    summary: "a robot that runs its loop itself, with motors and encoders of its own, at a serial port or a \
              unix socket; the law is that of `[controller.aboard]`",
    equation: "host: model, effects and law once, then a reference per period; robot: measures, computes and \
               drives by its own timer, and says what it did",
    reference: "the protocol: link/src/lib.rs; Cheshire, Baker (1999), IEEE/ACM Transactions on Networking 7(2), 159-172 (COBS)",
    example: "[driver.serial]\nline = \"/dev/ttyACM0\"\nbaud = 115200\n\n\
              [controller.aboard]\nlaw = { settling_time_s = 0.45, limit = 12.0 }\n",
    settings: &[
        Setting::new(
            "line",
            "",
            "serial port or unix socket at which the robot is found",
        ),
        Setting::new("baud", "1/s", "baud rate of a serial port; default: 115200"),
        Setting::new(
            "timeout_s",
            "s",
            "how long the robot may be silent; default: 2 s",
        ),
    ],
};

#[typetag::serde(name = "serial")]
impl DriverPart for Serial {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn build(&self, context: &DriverContext<'_>) -> Result<HostDriver, BuildError> {
        let _ = context;
        Err(
            BuildError::at("", "a robot that runs its law itself must be told one")
                .help("add `[controller.aboard]` with a `law`"),
        )
    }

    fn is_simulated(&self) -> bool {
        false
    }

    fn runs_law(&self) -> bool {
        true
    }

    fn build_with(&self, controller: &dyn ControllerPart, context: &DriverContext<'_>) -> Halves {
        let at = |key: &str, message: String| HalfError::Driver(BuildError::at(key, message));
        let Some(aboard) = (controller as &dyn Any).downcast_ref::<Aboard>() else {
            let found = controller.meta().id;
            let message = format!("the robot runs its law itself, and `{found}` runs here");
            let error = BuildError::at("", message);
            return Err(HalfError::Driver(error.help(
                "give it the law in `[controller.aboard]`, or drive with another driver",
            )));
        };
        waits(self.timeout_s).map_err(HalfError::Driver)?;
        rate(self.baud).map_err(HalfError::Driver)?;
        if aboard.line.is_some() {
            let message = "the line stands in `[driver.serial]` already";
            return Err(HalfError::Controller(BuildError::at("line", message)));
        }
        let (model, period) = (context.model, context.period);
        let configuration = aboard
            .configuration(model, period)
            .map_err(HalfError::Controller)?;
        let allowed = aboard.changeable.of(model);
        let allowed = allowed.map_err(HalfError::Controller)?;
        let n = model.plant.controlled.len();
        if let Some(more) = model.measured.get(n) {
            let message = format!(
                "the model measures `{}`, which this robot does not send",
                more.signal.id
            );
            return Err(at("", message));
        }
        let line = Line::at(&self.line, self.baud, self.timeout_s);
        let talk = Arc::new(Mutex::new(Talk {
            robot: Conversation::new(line, configuration, period)
                .with_door(aboard.door.as_ref(), allowed),
            act: None,
        }));
        let body = Body {
            talk: Arc::clone(&talk),
            inputs: model.plant.inputs.len(),
            period,
            tick: 0,
            pending: None,
            measured: vec![0.0; n],
        };
        let law = Law {
            talk,
            followed: vec![0.0; n],
            told: aboard.told(model).with_supply(),
            remark: None,
        };
        Ok((Box::new(body), Box::new(law)))
    }
}

declare_part!(&META);

/// The conversation, shared by the two halves of the loop.
struct Talk {
    robot: Conversation,
    /// What the robot did in the present tick.
    act: Option<Act>,
}

fn locked(talk: &Arc<Mutex<Talk>>) -> MutexGuard<'_, Talk> {
    talk.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The robot as a driver.
struct Body {
    talk: Arc<Mutex<Talk>>,
    inputs: usize,
    period: f64,
    /// The robot's next tick.
    tick: u32,
    /// An act that arrived early: those before it were lost.
    pending: Option<Act>,
    measured: Vec<f64>,
}

impl Body {
    fn next(&mut self) -> Result<bool, LineError> {
        let mut talk = locked(&self.talk);
        if self.tick == 0 && self.pending.is_none() {
            talk.robot.begin()?;
            // It begins where it should be at rest; the first reference is heard in its second tick.
            talk.robot
                .step(0, 0, &[], &vec![0.0; self.measured.len()])?;
        }
        let act = match self.pending.take() {
            Some(act) => act,
            None => loop {
                let act = talk.robot.act(self.inputs)?;
                if act.tick >= self.tick {
                    break act;
                }
            },
        };
        let fresh = act.tick == self.tick;
        self.tick += 1;
        if !fresh {
            self.pending = Some(act);
            return Ok(false);
        }
        let sensed = act.sensed.as_ref().map_or(&[][..], |s| &s.measured);
        talk.robot
            .sized("measurements", sensed.len(), self.measured.len())?;
        talk.robot.numbers("measurements", sensed)?;
        widen(&mut self.measured, sensed);
        talk.act = Some(act);
        Ok(true)
    }
}

fn lost(error: &LineError) -> HostDriverError {
    let fault = match error {
        LineError::NoAnswer { .. } | LineError::HungUp { .. } => DriverFault::Disconnected,
        LineError::AtRest { .. } | LineError::Refused { .. } => DriverFault::Rejected,
        _ => DriverFault::Io,
    };
    let message = error.to_string();
    HostDriverError { fault, message }
}

impl Driver<f64> for Body {
    type Error = HostDriverError;

    fn read(&mut self, measured: &mut [f64]) -> Result<Sample<f64>, HostDriverError> {
        let time = f64::from(self.tick) * self.period;
        let fresh = self.next().map_err(|e| lost(&e))?;
        measured.copy_from_slice(&self.measured);
        Ok(Sample { time, fresh })
    }

    /// Nothing is written: the robot has driven its motors already.
    fn write(&mut self, _command: &[f64], applied: &mut [f64]) -> Result<(), HostDriverError> {
        let talk = locked(&self.talk);
        widen(applied, talk.act.as_ref().map_or(&[][..], |a| &a.command));
        Ok(())
    }

    fn safe_stop(&mut self) -> Result<(), HostDriverError> {
        locked(&self.talk).robot.stop().map_err(|e| lost(&e))
    }
}

/// The robot's law as a controller.
struct Law {
    talk: Arc<Mutex<Talk>>,
    /// The reference that the robot followed.
    followed: Vec<f64>,
    told: Told,
    remark: Option<String>,
}

impl Controller<f64> for Law {
    fn step(
        &mut self,
        tick: &Tick<f64>,
        reference: &[f64],
        _measured: &[f64],
        _model: &mut dyn AffineModel<f64>,
        command: &mut [f64],
    ) -> Result<Command, ControlError> {
        let mut talk = locked(&self.talk);
        let served = talk.robot.serve();
        let step = |talk: &mut Talk| talk.robot.step(tick.index as u32, 0, &[], reference);
        let said = served.and_then(|remark| step(&mut talk).map(|()| remark));
        if let Err(error) = said.map(|remark| self.remark = remark) {
            self.remark = Some(error.to_string());
            return Err(kind(&error));
        }
        let Some(act) = &talk.act else {
            return Err(ControlError::NoAnswer);
        };
        let followed = act.sensed.as_ref().map_or(&[][..], |s| &s.reference);
        widen(&mut self.followed, followed);
        Ok(self.told.take(act, command))
    }

    fn demand(&self, reference: &mut [f64]) {
        reference.copy_from_slice(&self.followed);
    }

    fn quantities(&self) -> &[Quantity<f64>] {
        self.told.quantities()
    }

    fn told(&self) -> &[f64] {
        self.told.values()
    }

    fn remark(&self) -> Option<&str> {
        self.remark.as_deref()
    }

    /// A new session begins with the next reading.
    fn reset(&mut self) {
        locked(&self.talk).robot.renew();
    }
}
