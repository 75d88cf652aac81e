//! The composed loop against the closed form it was designed for.

#![allow(
    clippy::unwrap_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

use loopsight_controllers::{PiResponse, settling_time};
use loopsight_core::{Controller, Driver, DriverFault, Loop, Plant, Rk4, Sample, SimulatedClock};
use loopsight_model::affine::Affine;
use loopsight_model::config::TomlSource;
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, ControllerPart};
use loopsight_plants::Ddmr;

const PERIOD: f64 = 0.01;
/// Integration steps of the robot per period.
const FINE: usize = 10;

const PAPER: &str = <Ddmr as Plant>::META.example;

/// The velocities of the paper's robot, integrated finely, with every step kept.
struct Robot {
    rk4: Rk4<[f64; 2]>,
    velocity: [f64; 2],
    volts: [f64; 2],
    limit: f64,
    /// Measures the mean over the last period, as an encoder does.
    means: bool,
    reads: usize,
    nan_at: Option<usize>,
    trace: Vec<[f64; 2]>,
}

impl Robot {
    fn at_rest(limit: f64) -> Self {
        Self {
            rk4: Rk4::new([0.0; 2]),
            velocity: [0.0; 2],
            volts: [0.0; 2],
            limit,
            means: false,
            reads: 0,
            nan_at: None,
            trace: vec![[0.0; 2]],
        }
    }

    /// From when on channel `i` stays within `band` of `reference`, s after step `from` of the trace.
    fn settled(&self, from: usize, i: usize, reference: f64, band: f64) -> f64 {
        let late = self.trace[from..]
            .iter()
            .rposition(|u| (u[i] - reference).abs() > band);
        late.map_or(0.0, |k| (k + 1) as f64 * PERIOD / FINE as f64)
    }
}

impl Driver<f64> for Robot {
    type Error = DriverFault;

    fn read(&mut self, measured: &mut [f64]) -> Result<Sample<f64>, DriverFault> {
        measured.copy_from_slice(&self.velocity);
        if self.reads > 0 {
            let [right, left] = self.volts;
            let mut sum = [0.0; 2];
            for _ in 0..FINE {
                let before = self.velocity;
                self.rk4
                    .step(&mut self.velocity, PERIOD / FINE as f64, |_, u, du| {
                        du[0] = -15.146 * u[0] + 0.005 * u[1] * u[1] + 0.136 * (right + left);
                        du[1] = -9.573 * u[1] - 3.945 * u[0] * u[1] + 0.656 * (right - left);
                    });
                for i in 0..2 {
                    sum[i] += 0.5 * (before[i] + self.velocity[i]);
                }
                self.trace.push(self.velocity);
            }
            for i in 0..2 {
                measured[i] = if self.means {
                    sum[i] / FINE as f64
                } else {
                    self.velocity[i]
                };
            }
        }
        if self.nan_at == Some(self.reads) {
            measured[0] = f64::NAN;
        }
        self.reads += 1;
        Ok(Sample {
            time: (self.reads - 1) as f64 * PERIOD,
            fresh: true,
        })
    }

    fn write(&mut self, command: &[f64], applied: &mut [f64]) -> Result<(), DriverFault> {
        for (volts, asked) in self.volts.iter_mut().zip(command) {
            *volts = asked.clamp(-self.limit, self.limit);
        }
        applied.copy_from_slice(&self.volts);
        Ok(())
    }

    fn safe_stop(&mut self) -> Result<(), DriverFault> {
        self.volts = [0.0; 2];
        Ok(())
    }
}

#[derive(Debug, serde::Deserialize)]
struct File {
    controller: Box<dyn ControllerPart>,
}

fn model(text: &str) -> Model {
    Model::from_toml("model.toml", text).unwrap().0
}

fn part(settings: &str) -> Box<dyn ControllerPart> {
    let text = format!("[controller.feedback_linearizing_pi]\n{settings}\n");
    let source = TomlSource::parse("loop.toml", &text).unwrap();
    source.read::<File>().unwrap().controller
}

fn refused(model_text: &str, settings: &str) -> BuildError {
    part(settings)
        .build(&model(model_text), PERIOD)
        .err()
        .unwrap()
}

type Composed = Loop<f64, Robot, Box<dyn Controller<f64>>, Affine, (), SimulatedClock, Vec<f64>>;

fn compose(settings: &str, robot: Robot) -> Composed {
    let model = model(PAPER);
    let zero = vec![0.0; 2];
    Loop::new(
        robot,
        part(settings).build(&model, PERIOD).unwrap(),
        model.affine().unwrap(),
        (),
        SimulatedClock::default(),
        PERIOD,
        zero.clone(),
        zero.clone(),
        zero.clone(),
        zero,
    )
}

const GAINS: &str = "proportional = 17.78\nintegral = [79.01, 79.01]";

/// Largest deviation of each channel from `H(s)` after a step of `reference`, as a fraction of the
/// step: at the samples, and at any time.
fn deviation(robot: Robot, reference: [f64; 2]) -> [[f64; 2]; 2] {
    let mut composed = compose(GAINS, robot);
    for _ in 0..200 {
        let step = composed.tick(&reference).unwrap();
        assert!(!step.outcome.saturated && !step.outcome.held);
    }
    let response = PiResponse::new(17.78, 79.01).unwrap();
    let mut worst = [[0.0f64; 2]; 2];
    for (k, velocity) in composed.driver.trace.iter().enumerate() {
        let rise = 1.0 - response.error(k as f64 * PERIOD / FINE as f64);
        for i in 0..2 {
            // A channel that should rest is judged by the other one's step.
            let step = if reference[i] == 0.0 {
                reference[1 - i]
            } else {
                reference[i]
            };
            let off = ((velocity[i] - reference[i] * rise) / step).abs();
            worst[1][i] = worst[1][i].max(off);
            if k % FINE == 0 {
                worst[0][i] = worst[0][i].max(off);
            }
        }
    }
    worst
}

#[test]
fn the_loop_follows_h_within_a_hundredth_of_the_step() {
    for reference in [[0.1, 0.5], [0.1, 0.0], [0.0, 0.5], [-0.1, 0.5], [0.2, -1.3]] {
        let [samples, between] = deviation(Robot::at_rest(f64::INFINITY), reference);
        println!("{reference:?}: at the samples {samples:.5?}, at any time {between:.5?}");
        assert!(between.iter().all(|off| *off <= 0.01), "{between:?}");
        assert!(samples.iter().all(|off| *off <= 0.005), "{samples:?}");
    }
    // Not a promise, but to be known: a velocity from encoders is half a period old.
    let mut robot = Robot::at_rest(f64::INFINITY);
    robot.means = true;
    let [samples, _] = deviation(robot, [0.1, 0.5]);
    println!("encoder means: at the samples {samples:.5?}");
    assert!(samples.iter().all(|off| *off <= 0.06), "{samples:?}");
}

#[test]
fn the_loop_settles_when_the_design_says_so() {
    let by_rule = |rule: &str| {
        let settings = format!("settling_time_s = 0.45\ndamping = 1.0\nrule = \"{rule}\"");
        let mut composed = compose(&settings, Robot::at_rest(f64::INFINITY));
        for _ in 0..300 {
            composed.tick(&[0.1, 0.5]).unwrap();
        }
        [
            composed.driver.settled(0, 0, 0.1, 0.002),
            composed.driver.settled(0, 1, 0.5, 0.01),
        ]
    };
    let (paper, exact) = (by_rule("paper"), by_rule("exact"));
    println!("settled: paper {paper:?}, exact {exact:?}");
    for i in 0..2 {
        assert!((paper[i] - settling_time(17.78, 79.01)).abs() < 0.01);
        assert!((exact[i] - 0.45).abs() < 0.01);
    }
    let notes = part("settling_time_s = 0.45").notes().join("\n");
    assert!(notes.contains("0.45 s") && notes.contains("0.607 s") && notes.contains("13.5 %"));
}

/// 0.3 m/s is more than 12 V give. Back within reach, the loop must not remember the wait.
#[test]
fn a_reference_out_of_reach_winds_nothing_up() {
    let mut composed = compose(&format!("{GAINS}\nlimit = 12.0"), Robot::at_rest(12.0));
    let mut saturated = 0;
    for _ in 0..500 {
        saturated += u32::from(composed.tick(&[0.3, 0.0]).unwrap().outcome.saturated);
    }
    assert!(saturated > 450, "{saturated}");
    let reached = composed.driver.velocity[0];
    assert!((reached - 2.0 * 12.0 * 0.136 / 15.146).abs() < 1e-3);
    let from = composed.driver.trace.len() - 1;
    for _ in 0..200 {
        composed.tick(&[0.1, 0.0]).unwrap();
    }
    let step = reached - 0.1;
    let back = &composed.driver.trace[from..];
    let undershoot = back.iter().map(|u| 0.1 - u[0]).fold(0.0, f64::max) / step;
    let settled = composed.driver.settled(from, 0, 0.1, 0.02 * step);
    println!("back within reach: undershoot {undershoot:.3}, settled after {settled:.3} s");
    // As good as without limits: 13.5 % and 0.607 s.
    assert!(undershoot < 0.14, "{undershoot}");
    assert!(settled < 0.65, "{settled}");
}

/// Both channels hit the limits on the way; they arrive all the same.
#[test]
fn a_large_step_saturates_and_recovers() {
    let settings = format!("{GAINS}\nlimit = [9.0, 9.0]");
    let mut composed = compose(&settings, Robot::at_rest(9.0));
    let mut saturated = 0;
    for _ in 0..300 {
        let step = composed.tick(&[0.08, 0.5]).unwrap();
        assert!(step.command.iter().all(|v| v.abs() <= 9.0));
        assert_eq!(step.command, step.applied);
        saturated += u32::from(step.outcome.saturated);
    }
    println!("saturated in {saturated} of 300 ticks");
    assert!((3..200).contains(&saturated), "{saturated}");
    let trace = &composed.driver.trace;
    for (i, reference) in [(0, 0.08), (1, 0.5)] {
        let peak = trace.iter().map(|u| u[i]).fold(0.0, f64::max);
        println!("channel {i}: peak at {:.3} of the step", peak / reference);
        assert!(peak < 1.2 * reference, "{i}: {peak}");
        assert!((trace[trace.len() - 1][i] / reference - 1.0).abs() < 1e-3);
    }
}

/// Figures 8 and 9 of the paper: constant acceleration until 12 V are not enough.
#[test]
fn the_linearisation_alone_gives_constant_acceleration() {
    for (i, acceleration, damping, gain) in
        [(0, 0.6, 15.146, 2.0 * 0.136), (1, 1.6, 9.573, 2.0 * 0.656)]
    {
        let mut asked = [0.0; 2];
        asked[i] = acceleration;
        let settings = format!("open_loop_acceleration = {asked:?}\nlimit = 12.0");
        let mut composed = compose(&settings, Robot::at_rest(12.0));
        let saturates = (12.0 * gain - acceleration) / damping / acceleration;
        let mut worst = 0.0f64;
        for _ in 0..200 {
            let step = composed.tick(&[0.0; 2]).unwrap();
            let (t, velocity) = (step.tick.time, step.measured[i]);
            assert!(step.measured[1 - i].abs() < 1e-3);
            if t < saturates - 2.0 * PERIOD {
                assert!(!step.outcome.saturated, "{i}: {t}");
                worst = worst.max((velocity - acceleration * t).abs() / (acceleration * saturates));
            } else if t > saturates + 2.0 * PERIOD {
                assert!(step.outcome.saturated, "{i}: {t}");
            }
        }
        println!("channel {i}: saturates at {saturates:.3} s, off the ramp by {worst:.5}");
        assert!(worst < 0.003, "{worst}");
        let last = composed.driver.velocity[i];
        assert!((last - 12.0 * gain / damping).abs() < 1e-2 * last);
    }
}

#[test]
fn a_measurement_that_is_no_number_is_ridden_out() {
    let mut robot = Robot::at_rest(f64::INFINITY);
    robot.nan_at = Some(20);
    let mut composed = compose(GAINS, robot);
    let mut before = Vec::new();
    for k in 0..300 {
        let step = composed.tick(&[0.1, 0.5]).unwrap();
        assert_eq!(step.outcome.held, k == 20);
        if k == 20 {
            assert_eq!(step.command, before);
        }
        before = step.command.to_vec();
    }
    assert!((composed.driver.velocity[0] - 0.1).abs() < 1e-4);
}

#[test]
fn what_cannot_be_built_says_which_key_what_was_found_and_what_is_expected() {
    for (settings, key, words) in [
        ("", "", "no gains"),
        (
            "proportional = 1.0",
            "proportional",
            "`integral` is missing",
        ),
        ("damping = 1.0", "damping", "`settling_time_s` is missing"),
        (
            "proportional = 1.0\nintegral = 1.0\nrule = \"exact\"",
            "rule",
            "beside `proportional`",
        ),
        (
            "settling_time_s = -1.0",
            "settling_time_s",
            "is -1 s, expected",
        ),
        (
            "settling_time_s = 1.0\ndamping = 0.0",
            "damping",
            "is 0, expected",
        ),
        (
            "proportional = [1.0, -2.0]\nintegral = 1.0",
            "proportional",
            "channel 1 is -2",
        ),
        (
            "settling_time_s = [1.0, 1.0, 1.0]",
            "settling_time_s",
            "has 3 numbers",
        ),
        (
            "settling_time_s = 1.0\nlimit = [12.0, 0.0]",
            "limit",
            "input 1 is 0",
        ),
        (
            "open_loop_acceleration = [1.0]",
            "open_loop_acceleration",
            "has 1 number",
        ),
        (
            "open_loop_acceleration = [1.0, 0.0]\nintegral = 2.0",
            "integral",
            "beside `open_loop_acceleration`",
        ),
    ] {
        let error = refused(PAPER, settings);
        assert_eq!(error.key, key, "{settings}: {error}");
        assert!(error.message.contains(words), "{settings}: {error}");
    }
    let singular = refused(&PAPER.replace("0.656", "0.0"), "settling_time_s = 0.45");
    assert!(
        singular
            .message
            .contains("no input moves `angular_velocity`"),
        "{singular}"
    );
    let unknown = refused(
        &PAPER.replace("K_C = 0.136\n", ""),
        "settling_time_s = 0.45",
    );
    assert!(unknown.message.contains("no value for K_C"), "{unknown}");
}
