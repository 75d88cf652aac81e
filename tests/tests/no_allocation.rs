//! Nothing in a running loop allocates.

#![allow(
    clippy::unwrap_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

use allocation_counter::measure;
use loopsight_controllers::FeedbackLinearizingPiSettings;
use loopsight_core::{
    AffineModel, Clock, Controller, Driver, DriverFault, Estimator, Loop, Observation, Observer,
    Plant, Sample, SimulatedClock, Tick,
};
use loopsight_estimators::{Rls, RlsSettings};
use loopsight_model::model::Model;
use loopsight_model::registry::{ControllerPart, EstimatorPart};
use loopsight_model::simulate::Simulator;
use loopsight_plants::Ddmr;
use nalgebra::{DVector, SVector};

const PERIOD: f64 = 0.01;

const PAPER: &str = <Ddmr as Plant>::META.example;

const WITH_EFFECTS: &str = "
[[effect]]
[effect.coulomb_friction]
at = [\"wheel.right\", \"wheel.left\"]
level = 0.5

[[effect]]
[effect.input_delay]
at = [\"input.right\", \"input.left\"]
delay = 0.013
";

fn model(text: &str) -> Model {
    Model::from_toml("model.toml", text).unwrap().0
}

/// Allocations of `times` calls of `f`, the first few of which are not counted.
fn allocations(times: usize, mut f: impl FnMut(usize)) -> u64 {
    for k in 0..10 {
        f(k);
    }
    measure(|| {
        for k in 10..10 + times {
            f(k);
        }
    })
    .count_total
}

/// Forgets, so that the covariance is also bounded now and then.
fn forgetting() -> RlsSettings {
    RlsSettings {
        forgetting: 0.95,
        ..RlsSettings::default()
    }
}

fn regressor(k: usize) -> [f64; 3] {
    let k = k as f64;
    [0.1 * (0.3 * k).sin(), 0.0, 18.0 * (0.7 * k).cos()]
}

#[test]
fn the_counter_counts() {
    assert!(allocations(10, |k| drop(std::hint::black_box(vec![k; 10]))) >= 10);
}

#[test]
fn an_estimator_allocates_nothing() {
    let mut fixed = Rls::new(SVector::<f64, 3>::zeros(), &forgetting()).unwrap();
    assert_eq!(
        allocations(1000, |k| {
            fixed.update(&regressor(k), 1.0);
        }),
        0
    );
    let mut dynamic = Rls::new(DVector::<f64>::zeros(3), &forgetting()).unwrap();
    assert_eq!(
        allocations(1000, |k| {
            let phi = regressor(k);
            dynamic.update(&phi[..3 - usize::from(k % 50 == 49)], 1.0);
            if k % 100 == 99 {
                dynamic.reset(&[0.0; 3]);
            }
        }),
        0
    );
}

#[test]
fn a_controller_and_its_model_allocate_nothing() {
    let model = model(PAPER);
    let mut affine = model.affine().unwrap();
    let (mut drift, mut matrix) = ([0.0; 2], [0.0; 4]);
    assert_eq!(
        allocations(1000, |k| affine.evaluate(
            &[0.1, k as f64 * 1e-3],
            &mut drift,
            &mut matrix
        )),
        0
    );
    let settings: FeedbackLinearizingPiSettings =
        toml::from_str("settling_time_s = 0.45\nlimit = 12.0").unwrap();
    let mut controller = settings.build(&model, PERIOD).unwrap();
    let mut command = [0.0; 2];
    let (mut saturated, mut held) = (0, 0);
    let counted = allocations(1000, |k| {
        let tick = Tick {
            index: k as u64,
            time: k as f64 * PERIOD,
            period: PERIOD,
        };
        let reference = [if k % 100 == 50 { f64::NAN } else { 0.3 }, 0.5];
        let measured = [0.2 * (0.1 * k as f64).sin(), 0.4];
        let said = controller
            .step(&tick, &reference, &measured, &mut affine, &mut command)
            .unwrap();
        saturated += u32::from(said.saturated);
        held += u32::from(said.held);
    });
    assert_eq!(counted, 0);
    assert!(saturated > 0 && held > 0);
}

#[test]
fn a_simulation_allocates_nothing() {
    let path = loopsight_tests::repository().join("examples/expressions");
    let file = |name: &str| std::fs::read_to_string(path.join(name)).unwrap();
    for text in [
        PAPER.to_owned(),
        format!("{PAPER}{WITH_EFFECTS}"),
        file("robot.toml"),
        file("twil.toml"),
    ] {
        let model = model(&text);
        let mut simulator = Simulator::<f64>::new(&model, &model.values());
        // Longer than the memory of the delay, whose ring must not grow.
        let counted = allocations(10_000, |k| {
            let volts = if k / 50 % 2 == 0 { 9.0 } else { -9.0 };
            simulator.advance((k + 1) as f64 * PERIOD, &[volts, -volts]);
        });
        assert_eq!(counted, 0);
        assert!(simulator.state().iter().all(|x| x.is_finite()));
    }
}

/// A simulated robot as a driver.
struct Simulated {
    simulator: Simulator<'static, f64>,
    volts: [f64; 2],
    reads: usize,
}

impl Driver<f64> for Simulated {
    type Error = DriverFault;
    fn read(&mut self, measured: &mut [f64]) -> Result<Sample<f64>, DriverFault> {
        let time = self.reads as f64 * PERIOD;
        if self.reads > 0 {
            self.simulator.advance(time, &self.volts);
        }
        self.reads += 1;
        measured.copy_from_slice(&self.simulator.state()[..2]);
        Ok(Sample { time, fresh: true })
    }
    fn write(&mut self, command: &[f64], applied: &mut [f64]) -> Result<(), DriverFault> {
        self.volts.copy_from_slice(command);
        applied.copy_from_slice(command);
        Ok(())
    }
    fn safe_stop(&mut self) -> Result<(), DriverFault> {
        self.volts = [0.0; 2];
        Ok(())
    }
}

/// Learns the paper's forward regression with an estimator chosen at run time.
struct Learner {
    estimator: Box<dyn Estimator<f64>>,
    before: [f64; 2],
}

impl Observer<f64> for Learner {
    fn observe(&mut self, seen: &Observation<'_, f64>) {
        let (measured, applied) = (seen.measured, seen.applied);
        let [v, omega] = self.before;
        let phi = [v, omega * omega, applied[0] + applied[1]];
        self.estimator.update(&phi, (measured[0] - v) / PERIOD);
        self.before.copy_from_slice(measured);
    }
}

#[test]
fn a_loop_of_boxed_parts_allocates_nothing() {
    let model: &'static Model = Box::leak(Box::new(model(PAPER)));
    let settings: FeedbackLinearizingPiSettings =
        toml::from_str("settling_time_s = 0.45\nlimit = 12.0").unwrap();
    let driver: Box<dyn Driver<f64, Error = DriverFault>> = Box::new(Simulated {
        simulator: Simulator::new(model, &model.values()),
        volts: [0.0; 2],
        reads: 0,
    });
    let clock: Box<dyn Clock> = Box::new(SimulatedClock::default());
    let controller: Box<dyn Controller<f64>> = settings.build(model, PERIOD).unwrap();
    let observer = Learner {
        estimator: forgetting().build(&[0.0; 3]).unwrap(),
        before: [0.0; 2],
    };
    let zero = vec![0.0; 2];
    let mut composed = Loop::new(
        driver,
        controller,
        model.affine().unwrap(),
        observer,
        clock,
        PERIOD,
        zero.clone(),
        zero.clone(),
        zero.clone(),
        zero,
    );
    let counted = allocations(2000, |k| {
        let v = if k / 100 % 2 == 0 { 0.2 } else { -0.1 };
        composed.tick(&[v, -3.0 * v]).unwrap();
    });
    assert_eq!(counted, 0);
    let theta = composed.observer.estimator.theta();
    // Euler's regression sees (e^{K_A T} - 1)/T.
    let euler = ((-15.146 * PERIOD).exp() - 1.0) / PERIOD;
    assert!((theta[0] - euler).abs() < 0.1, "{theta:?}");
}
