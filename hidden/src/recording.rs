//! Making a recording.

use std::path::Path;

use loopsight_model::run::Run;
use loopsight_recordings::write_csv;

use crate::driven::{Driven, ELECTRICAL_TIME_CONSTANT};
use crate::error::HiddenError;
use crate::experiment::{Experiment, PERIOD};
use crate::live::Live;
use crate::machine::STEP;
use crate::machines::along_rig;
use crate::motor::COPPER;
use crate::robot::Kind;
use crate::truth::{Quantity, Truth, significant};
use crate::{Hidden, Robot};

/// A log of a machine that hides something, and what it hides.
#[derive(Clone, Debug)]
pub struct Recording {
    /// What is logged: commands or what a controller made of them, and readings, in SI units.
    pub run: Run,
    /// The same motion through the same sensors, but for the rounding to counts: no model can be
    /// closer to [`Recording::run`] than this is.
    pub exact: Run,
    /// What was hidden.
    pub truth: Truth,
    /// A model file without the effect.
    pub model_toml: String,
    /// What the machine was told.
    pub(crate) commands: Vec<[f64; 2]>,
}

/// Integration steps from sample to sample.
pub(crate) const STEPS: usize = (PERIOD / STEP + 0.5) as usize;

/// Records 25 s of `robot` hiding `effects` (of the sizes given; none: the clean machine).
///
/// The seed decides on the commands and on where the marks of the encoders are. Equal arguments
/// give equal recordings; with the same seed the commands of different effects are the same.
///
/// # Errors
///
/// [`HiddenError::NotHere`] or [`HiddenError::Size`] when the machine cannot have the effect.
///
/// ```
/// use loopsight_hidden::{Experiment, Hidden, Robot, record};
/// let log = record(Robot::Twil, &[(Hidden::CoulombFriction, 1.0)], Experiment::Prbs, 1)?;
/// assert_eq!(log.run.len(), 2501);
/// assert_eq!(log.truth.hidden[0].value("level"), Some(0.9));
/// # Ok::<(), loopsight_hidden::HiddenError>(())
/// ```
pub fn record(
    robot: Robot,
    effects: &[(Hidden, f64)],
    experiment: Experiment,
    seed: u64,
) -> Result<Recording, HiddenError> {
    record_with(robot, effects, experiment, seed, ELECTRICAL_TIME_CONSTANT)
}

/// [`record`] with windings of another time constant `L/R`, s, than 0.1 ms.
///
/// At 0.1 ms, as of motors with ironless rotors, the clean machine is the lumped model for all that
/// can be seen. A millisecond is little, but it is there: on 25 s of data it leaves an error of a
/// third of that of the counts, and an actuator lag of 1 ms is a true finding.
///
/// # Errors
///
/// As [`record`].
pub fn record_with(
    robot: Robot,
    effects: &[(Hidden, f64)],
    experiment: Experiment,
    seed: u64,
    winding_time_constant: f64,
) -> Result<Recording, HiddenError> {
    let commands = experiment.commands(robot, seed)?;
    record_along(robot, effects, &commands, seed, winding_time_constant)
}

/// [`record_with`] along commands of one's own, V, one row per sampling period: a planned
/// experiment. On a machine with one command the second of a row is not used, and the first is in the
/// unit of that command.
///
/// # Errors
///
/// As [`record`].
pub fn record_along(
    robot: Robot,
    effects: &[(Hidden, f64)],
    commands: &[[f64; 2]],
    seed: u64,
    winding_time_constant: f64,
) -> Result<Recording, HiddenError> {
    match robot.kind() {
        Kind::Driven(driven) => along_driven(
            driven,
            robot,
            effects,
            commands,
            seed,
            winding_time_constant,
        ),
        Kind::Rig(sheet) => along_rig(sheet, robot, effects, commands, seed, winding_time_constant),
    }
}

/// A machine of shafts along commands.
fn along_driven(
    driven: Driven,
    robot: Robot,
    effects: &[(Hidden, f64)],
    commands: &[[f64; 2]],
    seed: u64,
    winding_time_constant: f64,
) -> Result<Recording, HiddenError> {
    let samples = commands.len();
    let Live {
        mut machine,
        mut odometry,
        mut hidden,
        signals,
        logged_late,
    } = Live::with_winding(driven, effects, seed, winding_time_constant)?;
    let drives = driven.drives();

    let mut run = Run::empty(drives, signals);
    let mut exact = Vec::with_capacity(samples * signals);
    for (k, command) in commands.iter().enumerate() {
        let (counted, smooth) = odometry.sample(PERIOD);
        run.push(k as f64 / 100.0, &command[..drives], &counted[..signals])?;
        exact.extend(&smooth[..signals]);
        // What is written down now was sent earlier, and what is sent now is written down later.
        let sent = commands.get(k + logged_late).or(commands.last());
        let sent = *sent.unwrap_or(command);
        for step in 1..=STEPS {
            machine.step(sent);
            odometry.step(machine.angles(), step == STEPS);
        }
    }
    for concealed in &mut hidden {
        if concealed.effect == Hidden::WindingHeating {
            let rises = machine.warmth().map(|t| COPPER * t);
            let names = ["rise_at_end_right", "rise_at_end_left"];
            for (name, value) in names.into_iter().zip(rises[..drives].iter().copied()) {
                let unit = "1";
                concealed.physical.push(Quantity { name, value, unit });
            }
        }
    }
    Ok(Recording {
        exact: run.clone().with_measured(exact)?,
        run,
        truth: Truth {
            robot,
            hidden,
            lumped: driven.quantities(),
            winding_time_constant: Some(winding_time_constant),
        },
        model_toml: driven.model_toml(),
        commands: commands.to_vec(),
    })
}

/// Root mean square of the difference of two runs over the standard deviation of the first,
/// signal by signal; the overall value of the diagnosis is the root mean square of these.
pub fn nrmse(measured: &Run, other: &Run) -> Vec<f64> {
    let n = measured.len() as f64;
    (0..measured.n_measured())
        .map(|j| {
            let values = || (0..measured.len()).map(|k| measured.sample(k)[j]);
            let mean = values().sum::<f64>() / n;
            let variance = values().map(|y| (y - mean).powi(2)).sum::<f64>() / n;
            let error = (0..measured.len())
                .map(|k| (measured.sample(k)[j] - other.sample(k)[j]).powi(2))
                .sum::<f64>()
                / n;
            (error / variance).sqrt()
        })
        .collect()
}

impl Recording {
    /// What encoder resolution alone leaves: [`nrmse`] of the log against the motion behind it,
    /// root mean square over the signals.
    pub fn floor(&self) -> f64 {
        overall(&nrmse(&self.run, &self.exact))
    }

    /// Header of the log.
    pub fn columns(&self) -> Vec<String> {
        let names = self.truth.robot.columns();
        names.iter().map(|n| (*n).to_owned()).collect()
    }

    /// Writes the log as CSV with six significant digits.
    ///
    /// # Errors
    ///
    /// [`HiddenError::Recording`] when the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), HiddenError> {
        let run = &self.run;
        let rows: Vec<f64> = (0..run.len())
            .flat_map(|k| {
                std::iter::once(run.time()[k])
                    .chain(run.input(k).iter().copied())
                    .chain(run.sample(k).iter().copied())
            })
            .map(|value| significant(value, 6))
            .collect();
        write_csv(path, &self.columns(), &rows)?;
        Ok(())
    }
}

/// Root mean square over signals.
pub fn overall(of_signals: &[f64]) -> f64 {
    let sum: f64 = of_signals.iter().map(|x| x * x).sum();
    (sum / of_signals.len() as f64).sqrt()
}
