//! A recording as the robot.

use loopsight_core::{Driver, DriverFault, Sample};
use loopsight_model::config::nearest;
use loopsight_model::declare_part;
use loopsight_model::registry::{
    BuildError, DriverContext, DriverPart, HostDriver, HostDriverError, PartMeta, Setting,
};
use loopsight_model::run::Run;
use serde::{Deserialize, Serialize};

/// Distance of a time stamp from where the loop's period has it, relative to the period, beyond
/// which a sample is not fresh.
const LATE: f64 = 0.5;

/// A recording as the robot: an estimator gets the samples that it would have had on the robot.
///
/// ```text
/// read:  y = measured[k], t = time[k] - time[0], then k <- k + 1
/// write: applied = inputs[k], whatever was commanded
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `time`, `measured`, `inputs` | rows of the recording | s, of the signals |
/// | `k` | sample, one per tick | 1 |
///
/// The command is ignored, but the *logged* input is returned as applied: identification sees what
/// the plant saw. A value that is missing is replaced by the last one known, and the sample is not
/// fresh; nor is the one after a gap, which does not span one period. After the last sample the
/// driver has finished. A recording whose median period is not the loop's is refused.
///
/// Reference: the regression of Alves, Lages, Henriques (2018), (40)–(43), run over a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Replay {
    /// The recording, relative to the loop file.
    pub recording: String,
    /// Name of the run to play; `None`: the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run: Option<String>,
}

/// Declaration of the driver.
pub(crate) const META: PartMeta = PartMeta {
    id: "replay",
    role: "driver",
    summary: "a recording as the robot: reads its samples one per tick, applies what was logged",
    equation: "y = measured[k], applied = inputs[k], k = 0, 1, ... one per tick",
    reference: "Alves, Lages, Henriques (2018), IFAC PapersOnLine 51-15, (40)-(43): the regression run over a log",
    example: "[driver.replay]\nrecording = \"log.csv\"\n",
    settings: &[
        Setting::new(
            "recording",
            "",
            "file of the recording, relative to the loop file",
        ),
        Setting::new("run", "", "name of the run to play; default: the first"),
    ],
};

#[typetag::serde(name = "replay")]
impl DriverPart for Replay {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn build(&self, context: &DriverContext<'_>) -> Result<HostDriver, BuildError> {
        let runs = (context.load_runs)(&self.recording, context.model)?;
        let run = self.choose(runs)?;
        let model = context.model;
        let expected = (model.plant.inputs.len(), model.measured.len());
        if (run.n_inputs(), run.n_measured()) != expected {
            return Err(BuildError::at(
                "recording",
                format!(
                    "`{}` has {} inputs and {} measured signals, the loop's model {} and {}",
                    self.recording,
                    run.n_inputs(),
                    run.n_measured(),
                    expected.0,
                    expected.1
                ),
            ));
        }
        let period = run.median_period();
        let same = (period - context.period).abs() <= 0.05 * context.period;
        if !same {
            return Err(BuildError::at(
                "recording",
                format!(
                    "`{}` was sampled every {period:.6} s, the loop's period is {} s",
                    self.recording, context.period
                ),
            )
            .help("give the loop the period of the recording"));
        }
        Ok(Box::new(ReplayDriver {
            held: vec![0.0; run.n_measured()],
            run,
            period: context.period,
            next: 0,
        }))
    }

    fn is_driven(&self) -> bool {
        false
    }

    fn is_simulated(&self) -> bool {
        true
    }
}

declare_part!(&META);

impl Replay {
    fn choose(&self, mut runs: Vec<Run>) -> Result<Run, BuildError> {
        let index = match &self.run {
            None => runs.iter().position(|r| r.len() > 1).ok_or_else(|| {
                BuildError::at(
                    "recording",
                    format!("`{}` holds no run to play", self.recording),
                )
            })?,
            Some(name) => runs.iter().position(|r| r.name() == *name).ok_or_else(|| {
                let names: Vec<&str> = runs.iter().map(|r| r.name()).collect();
                let error = BuildError::at(
                    "run",
                    match names[..] {
                        [] | [""] => format!(
                            "`{}` has no run `{name}`: its runs have no names",
                            self.recording
                        ),
                        _ => format!(
                            "`{}` has no run `{name}`, expected one of {}",
                            self.recording,
                            names.join(", ")
                        ),
                    },
                );
                match nearest(name, names) {
                    Some(near) => error.help(format!("did you mean `{near}`?")),
                    None => error,
                }
            })?,
        };
        Ok(runs.swap_remove(index))
    }
}

/// The driver in motion.
struct ReplayDriver {
    run: Run,
    period: f64,
    /// The sample that is read next.
    next: usize,
    /// Last known value of each signal.
    held: Vec<f64>,
}

impl Driver<f64> for ReplayDriver {
    type Error = HostDriverError;

    fn read(&mut self, measured: &mut [f64]) -> Result<Sample<f64>, HostDriverError> {
        let k = self.next;
        if k >= self.run.len() {
            return Err(HostDriverError {
                fault: DriverFault::Finished,
                message: format!("the recording is over after {} samples", self.run.len()),
            });
        }
        if measured.len() != self.run.n_measured() {
            return Err(HostDriverError {
                fault: DriverFault::Rejected,
                message: format!(
                    "{} measured signals, expected {}",
                    measured.len(),
                    self.run.n_measured()
                ),
            });
        }
        self.next += 1;
        let on_time = k == 0 || {
            let span = self.run.time()[k] - self.run.time()[k - 1];
            (span - self.period).abs() <= LATE * self.period
        };
        let mut complete = true;
        for ((to, held), value) in measured
            .iter_mut()
            .zip(&mut self.held)
            .zip(self.run.sample(k))
        {
            if value.is_finite() {
                *held = *value;
            } else {
                complete = false;
            }
            *to = *held;
        }
        Ok(Sample {
            time: self.run.time()[k] - self.run.time()[0],
            fresh: on_time && complete,
        })
    }

    fn write(&mut self, _command: &[f64], applied: &mut [f64]) -> Result<(), HostDriverError> {
        let logged = self.run.input(self.next.saturating_sub(1));
        for (to, from) in applied.iter_mut().zip(logged) {
            *to = *from;
        }
        Ok(())
    }

    /// A recording cannot be stopped.
    fn safe_stop(&mut self) -> Result<(), HostDriverError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use loopsight_model::run::Rows;

    use crate::fixture::{build, instants, twil_encoders, voltages};
    use crate::{Simulated, simulate_inputs};

    fn recorded(name: &str) -> Run {
        let run = simulate_inputs(
            &twil_encoders(),
            &Simulated::default(),
            &instants(100),
            &voltages(100),
        )
        .unwrap();
        run.named(name)
    }

    /// The run with other instants.
    fn at(run: &Run, time: impl Fn(usize, f64) -> f64) -> Run {
        let time = run.time().iter().enumerate().map(|(k, t)| time(k, *t));
        let rows = |width, values: &[f64]| Rows::new(width, values.to_vec());
        Run::new(
            run.name(),
            time.collect(),
            rows(run.n_inputs(), run.inputs()),
            rows(run.n_measured(), run.measured()),
        )
        .unwrap()
    }

    /// The run with one measured value changed.
    fn measuring(run: Run, index: usize, value: f64) -> Run {
        let mut measured = run.measured().to_vec();
        measured[index] = value;
        run.with_measured(measured).unwrap()
    }

    fn part(run: Option<&str>) -> Replay {
        Replay {
            recording: "log.csv".to_owned(),
            run: run.map(str::to_owned),
        }
    }

    #[test]
    fn what_the_simulated_robot_did_is_played_back() {
        let run = recorded("");
        let mut driver = build(
            &part(None),
            &twil_encoders(),
            None,
            std::slice::from_ref(&run),
        )
        .unwrap();
        let (mut y, mut applied) = ([0.0; 2], [0.0; 2]);
        for k in 0..run.len() {
            let sample = driver.read(&mut y).unwrap();
            assert_eq!((sample.time, sample.fresh), (run.time()[k], true));
            assert_eq!(y, run.sample(k));
            driver.write(&[f64::NAN, 99.0], &mut applied).unwrap();
            assert_eq!(applied, run.input(k));
        }
        assert_eq!(
            driver.read(&mut y).unwrap_err().fault,
            DriverFault::Finished
        );
        assert!(driver.safe_stop().is_ok());
    }

    #[test]
    fn runs_are_chosen_by_name() {
        let runs = [recorded("slow"), measuring(recorded("fast"), 2, 42.0)];
        let model = twil_encoders();
        let second = |name| {
            let mut driver = build(&part(name), &model, None, &runs).unwrap();
            let mut y = [0.0; 2];
            driver.read(&mut y).unwrap();
            driver.read(&mut y).unwrap();
            y[0]
        };
        assert!(second(None) != 42.0 && second(Some("fast")) == 42.0);
        let error = build(&part(Some("fats")), &model, None, &runs)
            .err()
            .unwrap();
        assert_eq!(error.key, "run");
        assert!(error.message.contains("slow, fast"), "{error}");
        assert_eq!(error.help.as_deref(), Some("did you mean `fast`?"));
    }

    #[test]
    fn missing_values_and_gaps_are_not_fresh() {
        let run = measuring(recorded(""), 2 * 5, f64::NAN);
        let run = at(&run, |k, t| if k < 20 { t } else { t + 0.5 });
        let mut driver = build(
            &part(None),
            &twil_encoders(),
            None,
            std::slice::from_ref(&run),
        )
        .unwrap();
        let mut y = [0.0; 2];
        for k in 0..run.len() {
            let sample = driver.read(&mut y).unwrap();
            assert_eq!(sample.fresh, k != 5 && k != 20, "sample {k}");
            if k == 5 {
                assert_eq!(y, [run.sample(4)[0], run.sample(5)[1]]);
            }
        }
    }

    #[test]
    fn a_recording_that_does_not_fit_is_refused() {
        let model = twil_encoders();
        let refused = |run: Run| build(&part(None), &model, None, &[run]).err().unwrap();
        let error = refused(at(&recorded(""), |_, t| 2.0 * t));
        assert!(error.message.contains("0.02"), "{error}");
        let wide = recorded("");
        let inputs = Rows::new(1, wide.inputs()[..wide.len()].to_vec());
        let narrow = Run::new(
            "",
            wide.time().to_vec(),
            inputs,
            Rows::new(2, wide.measured().to_vec()),
        );
        assert_eq!(refused(narrow.unwrap()).key, "recording");
        assert_eq!(refused(Run::default()).key, "recording");
    }
}
