//! A model as the robot.

use std::collections::BTreeMap;

use loopsight_core::{Driver, DriverFault, Sample};
use loopsight_model::declare_part;
use loopsight_model::model::Model;
use loopsight_model::registry::{
    BuildError, DriverContext, DriverPart, HostDriver, HostDriverError, PartMeta, Setting,
};
use loopsight_model::sensor::Sensor;
use serde::{Deserialize, Serialize};

use crate::fault::SensorFault;
use crate::robot::{Robot, STEP, unknown};

/// A model as the robot: the loop's own, or another one that hides what the loop's lacks.
///
/// ```text
/// x' = f(x, u)  by RK4 with step_s        u = clamp(command, -limit, limit), held over a period
/// y_k = sensor(x) + noise                 encoder: Σ gain Δ (N_k - N_(k-1))/T,  N = floor(φ/Δ + p)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `x`, `u`, `y` | state, applied inputs, measured signals | of the signals |
/// | `φ`, `gain` | shaft angles behind a measured signal and their gains to it | rad, of the signal per rad/s |
/// | `Δ`, `N`, `p` | angle of one count, counts, random phase of the disc | rad, 1, 1 |
/// | `T` | time since the last reading | s |
///
/// The robot is integrated with steps far finer than the model's (1e-4 s against 2.5e-3 s by
/// default): at 1e-4 s the fourth-order method is exact to 1e-13 of the motion of these plants,
/// changes of friction's direction are resolved in time, and a fit to the coarser model is not
/// tested against itself.
///
/// Sensors are as the model's `[log.measured]` says; effects on sensors act on the true value, then
/// the rounding to counts is added, then white noise. Signals that share a shaft share its counts,
/// so their roundings are correlated as on a robot. The first reading has no interval before it
/// and is the instantaneous value: 0 of a robot at rest.
///
/// Faults of the sensors are listed in `fault`, see [`SensorFault`]; a lost sample is replaced by the one
/// before it, and is not fresh.
///
/// A command that is not finite is rejected, and the robot goes on with its inputs at 0.
///
/// Reference: Hairer, Nørsett, Wanner (1993), "Solving Ordinary Differential Equations I", 2nd
/// edition, table II.1.2, for the integrator; [`Counter`](crate::Counter) for the encoder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Simulated {
    /// Model file of the robot; `None`: the loop's own model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Longest integration step of the robot, s; `None`: 1e-4, or the model's own if finer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Standard deviation of white noise by measured signal, in its SI unit; none by default.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub noise: BTreeMap<String, f64>,
    /// Seed of the noise and of the encoders' phases.
    pub seed: u64,
    /// Largest magnitude of the inputs; `None`: unlimited.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<Limit>,
    /// Whether encoders count, as the model's sensors say; else they give the exact mean.
    pub quantize: bool,
    /// What goes wrong with the sensors, and when.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fault: Vec<SensorFault>,
}

impl Default for Simulated {
    fn default() -> Self {
        Self {
            model: None,
            step_s: None,
            noise: BTreeMap::new(),
            seed: 1,
            limit: None,
            quantize: true,
            fault: Vec::new(),
        }
    }
}

impl Simulated {
    /// Longest integration step that these settings give the robot, s; its model's own may be shorter.
    pub fn longest_step(&self) -> f64 {
        self.step_s.unwrap_or(STEP)
    }
}

/// Largest magnitudes of the inputs, in their SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number or a table of numbers by input"
)]
pub enum Limit {
    /// The same for all.
    All(f64),
    /// By input; the others are unlimited.
    Each(BTreeMap<String, f64>),
}

/// Declaration of the driver.
pub(crate) const META: PartMeta = PartMeta {
    id: "simulated",
    role: "driver",
    summary: "a model as the robot, integrated finely, with noise, limits and encoder counts",
    equation: "x' = f(x, clamp(u)) by RK4 with step_s; y = sensor(x) + noise; encoder: sum of gain Δ (N_k - N_(k-1))/T with N = floor(φ/Δ + p)",
    reference: "Hairer, Nørsett, Wanner (1993), Solving Ordinary Differential Equations I, 2nd ed., table II.1.2; Brown, Schneider, Mulligan (1992), IEEE Trans. Ind. Electron. 39(1), 11-19",
    example: "[driver.simulated]\nseed = 1\nlimit = 12.0\n",
    settings: &[
        Setting::new(
            "model",
            "",
            "model file of the robot, which may hide effects the loop's model lacks; default: the loop's own model",
        ),
        Setting::new(
            "step_s",
            "s",
            "longest integration step of the robot; default: 1e-4, or the model's own if that is finer",
        ),
        Setting::new(
            "noise",
            "",
            "table: standard deviation of white noise by measured signal, in its unit; default: none",
        ),
        Setting::new(
            "seed",
            "1",
            "seed of the noise and of the encoders' phases; default: 1",
        ),
        Setting::new(
            "limit",
            "",
            "largest magnitude of the inputs, one number or a table by input, in their unit; default: unlimited",
        ),
        Setting::new(
            "quantize",
            "",
            "whether encoders count, as the model's sensors say; default: true",
        ),
        Setting::new(
            "fault",
            "",
            "list of sensor faults, each `dead_encoder = { of, start_s, duration_s }`, `frozen = { signal, start_s, duration_s }` or `stale = { share, start_s, duration_s }`; default: none",
        ),
    ],
};

#[typetag::serde(name = "simulated")]
impl DriverPart for Simulated {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn build(&self, context: &DriverContext<'_>) -> Result<HostDriver, BuildError> {
        let wanted = context.model;
        let (robot, measured_at, input_at) = match &self.model {
            None => {
                let identity = |n: usize| (0..n).collect();
                (
                    Robot::new(wanted.clone(), self)?,
                    identity(wanted.measured.len()),
                    identity(wanted.plant.inputs.len()),
                )
            }
            Some(path) => {
                let mut model = (context.load_model)(path)?;
                let (measured_at, input_at) = serve(&mut model, wanted)?;
                (Robot::new(model, self)?, measured_at, input_at)
            }
        };
        Ok(Box::new(SimulatedDriver {
            robot,
            period: context.period,
            readings: 0,
            input: vec![0.0; input_at.len()],
            taken: 0.0,
            held: vec![0.0; measured_at.len()],
            measured: vec![0.0; measured_at.len()],
            measured_at,
            input_at,
        }))
    }

    fn simulates_with(&self) -> Option<f64> {
        Some(self.longest_step())
    }

    fn is_simulated(&self) -> bool {
        true
    }
}

declare_part!(&META);

/// Makes the robot `model` measure what the loop's model `wanted` measures, with the robot's own
/// sensors where it names them. Returns where the loop's measured signals and inputs are found.
fn serve(model: &mut Model, wanted: &Model) -> Result<(Vec<usize>, Vec<usize>), BuildError> {
    let list: Vec<(String, Sensor)> = wanted
        .measured
        .iter()
        .map(|m| {
            let own = model.measured.iter().find(|o| o.signal.id == m.signal.id);
            let sensor = own.map_or(&m.sensor, |o| &o.sensor);
            (m.signal.id.to_owned(), sensor.clone())
        })
        .collect();
    model.measure(&list).map_err(|(id, message, help)| {
        let error = BuildError::at("model", format!("the loop measures `{id}`: {message}"));
        match help {
            Some(help) => error.help(help),
            None => error,
        }
    })?;
    let measured_at = list
        .iter()
        .filter_map(|(id, _)| model.measured.iter().position(|m| m.signal.id == id))
        .collect();
    let ids: Vec<&str> = model.plant.inputs.iter().map(|s| s.id).collect();
    let inputs = wanted.plant.inputs;
    let mut input_at = Vec::new();
    for input in inputs {
        let index = ids.iter().position(|id| *id == input.id);
        input_at.push(index.ok_or_else(|| unknown("model", "input", input.id, &ids))?);
    }
    if ids.len() != inputs.len() {
        return Err(BuildError::at(
            "model",
            format!(
                "the robot has the inputs {}, the loop drives {} of these {}",
                ids.join(", "),
                inputs.len(),
                ids.len()
            ),
        ));
    }
    Ok((measured_at, input_at))
}

/// The driver in motion.
struct SimulatedDriver {
    robot: Robot,
    period: f64,
    readings: u64,
    /// Applied inputs and last measurement, in the robot's order.
    input: Vec<f64>,
    measured: Vec<f64>,
    /// The sample that was handed out last: when it was taken, and its values.
    taken: f64,
    held: Vec<f64>,
    measured_at: Vec<usize>,
    input_at: Vec<usize>,
}

fn wrong_length(what: &str, found: usize, expected: usize) -> HostDriverError {
    HostDriverError {
        fault: DriverFault::Rejected,
        message: format!("{found} {what}, expected {expected}"),
    }
}

impl Driver<f64> for SimulatedDriver {
    type Error = HostDriverError;

    fn read(&mut self, measured: &mut [f64]) -> Result<Sample<f64>, HostDriverError> {
        if measured.len() != self.measured_at.len() {
            let expected = self.measured_at.len();
            return Err(wrong_length("measured signals", measured.len(), expected));
        }
        let time = self.readings as f64 * self.period;
        if self.readings > 0 {
            self.robot.advance(time, &self.input);
        }
        self.readings += 1;
        let finite = self.robot.measure(&mut self.measured);
        // The first sample has none before it that could be handed out in its place.
        let fresh = !self.robot.loses() || time == 0.0;
        if fresh {
            self.taken = time;
            for (to, at) in self.held.iter_mut().zip(&self.measured_at) {
                *to = self.measured[*at];
            }
        }
        measured.copy_from_slice(&self.held);
        if finite {
            Ok(Sample {
                time: self.taken,
                fresh,
            })
        } else {
            Err(HostDriverError {
                fault: DriverFault::Io,
                message: format!("the simulated robot diverged before {time} s"),
            })
        }
    }

    fn write(&mut self, command: &[f64], applied: &mut [f64]) -> Result<(), HostDriverError> {
        let expected = self.input_at.len();
        if command.len() != expected || applied.len() != expected {
            return Err(wrong_length("inputs", command.len(), expected));
        }
        if let Some(bad) = command.iter().position(|c| !c.is_finite()) {
            self.input.fill(0.0);
            applied.fill(0.0);
            return Err(HostDriverError {
                fault: DriverFault::Rejected,
                message: format!("the command for input {bad} is {}", command[bad]),
            });
        }
        for (value, at) in command.iter().zip(&self.input_at) {
            self.input[*at] = *value;
        }
        self.robot.limit(&mut self.input);
        for (to, at) in applied.iter_mut().zip(&self.input_at) {
            *to = self.input[*at];
        }
        Ok(())
    }

    fn safe_stop(&mut self) -> Result<(), HostDriverError> {
        self.input.fill(0.0);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use loopsight_model::config::TomlSource;

    use super::*;
    use crate::fixture::{build, instants, model, twil, twil_encoders, voltages};
    use crate::simulate_inputs;

    fn mean() -> Model {
        twil("\"interval_mean\"", "\"interval_mean\"")
    }

    fn refused(settings: &Simulated) -> BuildError {
        build(settings, &mean(), None, &[]).err().unwrap()
    }

    #[derive(Debug, Deserialize)]
    struct File {
        driver: Box<dyn DriverPart>,
    }

    #[test]
    fn the_example_and_every_setting_are_read() {
        let read = |text: &str| TomlSource::parse("loop.toml", text).unwrap().read::<File>();
        assert_eq!(read(META.example).unwrap().driver.meta().id, "simulated");
        let all = "[driver.simulated]\nmodel = \"robot.toml\"\nstep_s = 1e-4\nseed = 3\n\
                   noise = { linear_velocity = 0.001 }\nlimit = { voltage_left = 12.0 }\nquantize = false\n\
                   fault = [{ stale = { share = 0.05 } }]\n";
        assert!(read(all).unwrap().driver.is_simulated());
        let wrong = "[driver.simulated]\nlimit = \"12 V\"\n";
        let error = read(wrong).unwrap_err();
        assert!(error.message.contains("a number or a table"), "{error}");
    }

    #[test]
    fn a_loop_sees_what_a_given_sequence_gives() {
        let model = twil_encoders();
        let settings = Simulated {
            noise: [("angular_velocity".to_owned(), 0.01)].into(),
            limit: Some(Limit::All(8.0)),
            ..Simulated::default()
        };
        let (time, inputs) = (instants(200), voltages(200));
        let run = simulate_inputs(&model, &settings, &time, &inputs).unwrap();
        let mut driver = build(&settings, &model, None, &[]).unwrap();
        let (mut y, mut applied) = ([0.0; 2], [0.0; 2]);
        for k in 0..200 {
            let sample = driver.read(&mut y).unwrap();
            assert_eq!((sample.time, sample.fresh), (time[k], true));
            assert_eq!(y, run.sample(k));
            driver
                .write(&inputs[2 * k..2 * k + 2], &mut applied)
                .unwrap();
            assert_eq!(applied, run.input(k));
        }
    }

    #[test]
    fn reading_and_writing_allocate_nothing() {
        let settings = Simulated {
            noise: [("linear_velocity".to_owned(), 0.01)].into(),
            ..Simulated::default()
        };
        let mut driver = build(&settings, &twil_encoders(), None, &[]).unwrap();
        let (mut y, mut applied) = ([0.0; 2], [0.0; 2]);
        let used = allocation_counter::measure(|| {
            for _ in 0..100 {
                driver.read(&mut y).unwrap();
                driver.write(&[5.0, -5.0], &mut applied).unwrap();
            }
        });
        assert_eq!(used.count_total, 0);
    }

    #[test]
    fn a_command_that_is_no_number_is_rejected_and_the_inputs_go_to_zero() {
        let mut driver = build(&Simulated::default(), &mean(), None, &[]).unwrap();
        let (mut y, mut applied) = ([0.0; 2], [1.0; 2]);
        driver.read(&mut y).unwrap();
        driver.write(&[9.0, 9.0], &mut applied).unwrap();
        driver.read(&mut y).unwrap();
        let before = y[0];
        let error = driver.write(&[9.0, f64::NAN], &mut applied).unwrap_err();
        assert_eq!(error.fault, DriverFault::Rejected);
        assert_eq!(applied, [0.0, 0.0]);
        driver.read(&mut y).unwrap();
        let coasting = y[0];
        driver.write(&[9.0, 9.0], &mut applied).unwrap();
        driver.safe_stop().unwrap();
        driver.read(&mut y).unwrap();
        assert!(before > 0.0 && coasting > y[0] && y[0] > 0.0);
        assert!(driver.write(&[9.0], &mut applied).is_err());
        assert!(driver.read(&mut []).is_err());
    }

    #[test]
    fn the_robot_may_hide_an_effect() {
        let toml = "[plant.ddmr]\nK_A = -15.146\nK_B = 0.0\nK_C = 0.136\nK_D = -9.573\n\
                    K_E = 0.0\nK_F = 0.656\nhalf_track = 0.131\nwheel_radius = 0.05\n\
                    [[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 2.0\n";
        let settings = Simulated {
            model: Some("robot.toml".to_owned()),
            ..Simulated::default()
        };
        let drive = |robot: &Model| {
            let mut driver = build(&settings, &mean(), Some(robot), &[]).unwrap();
            let (mut y, mut applied) = ([0.0; 2], [0.0; 2]);
            for _ in 0..300 {
                driver.read(&mut y).unwrap();
                driver.write(&[9.0, 9.0], &mut applied).unwrap();
            }
            y[0]
        };
        let (clean, rough) = (drive(&mean()), drive(&model(toml)));
        assert!((clean - 0.136 * 18.0 / 15.146).abs() < 1e-9);
        assert!((rough - 0.136 * 14.0 / 15.146).abs() < 1e-3, "{rough}");
        let axis = model("[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n");
        let error = build(&settings, &mean(), Some(&axis), &[]).err().unwrap();
        assert!(error.message.contains("linear_velocity"), "{error}");
    }

    #[test]
    fn wrong_settings_are_named_with_the_nearest_right_one() {
        let error = refused(&Simulated {
            noise: [("linear_velocty".to_owned(), 0.01)].into(),
            ..Simulated::default()
        });
        assert_eq!(error.key, "noise.linear_velocty");
        assert_eq!(
            error.help.as_deref(),
            Some("did you mean `linear_velocity`?")
        );
        let error = refused(&Simulated {
            limit: Some(Limit::Each([("voltage_rigth".to_owned(), 12.0)].into())),
            ..Simulated::default()
        });
        assert_eq!(error.help.as_deref(), Some("did you mean `voltage_right`?"));
        for step_s in [0.0, f64::NAN, 0.01] {
            let error = refused(&Simulated {
                step_s: Some(step_s),
                ..Simulated::default()
            });
            assert_eq!(error.key, "step_s");
        }
        let error = refused(&Simulated {
            limit: Some(Limit::All(-1.0)),
            ..Simulated::default()
        });
        assert_eq!(error.key, "limit");
        let empty = model("[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n");
        let error = build(&Simulated::default(), &empty, None, &[])
            .err()
            .unwrap();
        assert!(error.message.contains("nothing is measured"), "{error}");
        let unknown = model("[plant.dc_axis]\nK_C = 8.0\n[log.measured.speed]\n");
        let error = build(&Simulated::default(), &unknown, None, &[])
            .err()
            .unwrap();
        assert!(error.message.contains("has none for K_A"), "{error}");
        let speed = "{ encoder_counts = { counts_per_revolution = 8192.0, of = { shaft_speed_right = 0.05 } } }";
        let error = build(&Simulated::default(), &twil(speed, speed), None, &[])
            .err()
            .unwrap();
        assert!(error.message.contains("shaft_angle_right"), "{error}");
    }
}
