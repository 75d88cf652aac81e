//! A robot on the bench: its driver, one command per period, with the model beside it.

use loopsight_core::{Clock, Driver as _, Limits};
use loopsight_model::model::Model;
use loopsight_model::registry::HostDriver;
use loopsight_model::simulate::Simulator;

use crate::error::{Error, Result};
use crate::watch::CancelToken;
use crate::words::number;

/// The bring-up ends after this time without a fresh sample, s.
const STALE: f64 = 0.2;

/// The result of a motion, of robot or model: the integrals of the measured signals, and their largest
/// magnitudes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Motion {
    pub(super) moved: Vec<f64>,
    pub(super) expected: Vec<f64>,
    pub(super) largest: Vec<f64>,
    /// Largest magnitude that was applied, by input.
    pub(super) applied: Vec<f64>,
    /// The measured signals at the end.
    pub(super) last: Vec<f64>,
}

/// Drives a robot tick by tick, and stops it whatever happens.
pub(super) struct Bench<'m> {
    model: &'m Model,
    driver: HostDriver,
    clock: Box<dyn Clock>,
    limits: Option<Limits<Vec<f64>>>,
    period: f64,
    /// When the next tick is due by the clock; none is before the first.
    due: Option<f64>,
    stale_s: f64,
    measured: Vec<f64>,
    applied: Vec<f64>,
    /// Magnitudes of the measured signals that no motion here may reach.
    pub(super) most: Vec<f64>,
    cancel: CancelToken,
    stopped: bool,
}

impl<'m> Bench<'m> {
    pub(super) fn new(
        model: &'m Model,
        driver: HostDriver,
        clock: Box<dyn Clock>,
        limits: Option<Limits<Vec<f64>>>,
        period: f64,
        cancel: CancelToken,
    ) -> Self {
        let (ny, nu) = (model.measured.len(), model.plant.inputs.len());
        Self {
            model,
            driver,
            clock,
            limits,
            period,
            due: None,
            stale_s: 0.0,
            measured: vec![0.0; ny],
            applied: vec![0.0; nu],
            most: vec![f64::INFINITY; ny],
            cancel,
            stopped: false,
        }
    }

    /// Stops the robot. Returns the reason for stopping, if any, with what else went wrong.
    fn fail(&mut self, why: String) -> Error {
        let stopped = self.driver.safe_stop();
        self.stopped = true;
        Error::work(match stopped {
            Ok(()) => format!("{why}; the robot was stopped"),
            Err(error) => format!("{why}, and the robot could not be stopped safely: {error}"),
        })
    }

    /// Stops the robot, for good.
    pub(super) fn stop(&mut self) -> Result<()> {
        self.stopped = true;
        self.driver
            .safe_stop()
            .map_err(|e| Error::work(format!("the robot could not be stopped safely: {e}")))
    }

    /// Waits for the next period. Ticks that were missed are not made up for, because a person took that time.
    fn wait(&mut self) {
        let due = self.due.unwrap_or_else(|| self.clock.now());
        self.clock.wait_until(due);
        let now = self.clock.now();
        let late = now - due > self.period;
        self.due = Some(if late { now } else { due } + self.period);
    }

    /// Waits for the next period, reads, and checks whether the robot may go on.
    fn read(&mut self) -> Result<()> {
        self.wait();
        if self.cancel.is_cancelled() {
            return Err(self.fail("stopped by Ctrl-C".to_owned()));
        }
        let sample = match self.driver.read(&mut self.measured) {
            Ok(sample) => sample,
            Err(error) => return Err(self.fail(error.to_string())),
        };
        self.stale_s = if sample.fresh {
            0.0
        } else {
            self.stale_s + self.period
        };
        // Half a period for the rounding of the sum.
        if self.stale_s > STALE + 0.5 * self.period {
            return Err(self.fail(format!("no fresh sample for {} s", number(STALE))));
        }
        for (i, m) in self.model.measured.iter().enumerate() {
            let (y, most) = (self.measured[i], self.most[i]);
            // NaN is too much as well.
            if y.is_nan() || y.abs() > most {
                let why = format!(
                    "{} is {} {}, more than the {} that no motion here should reach",
                    m.signal.id,
                    number(y),
                    m.signal.unit,
                    number(most)
                );
                return Err(self.fail(why));
            }
        }
        Ok(())
    }

    fn write(&mut self, command: &mut [f64]) -> Result<()> {
        if let Some(limits) = &mut self.limits {
            limits.clamp(self.period, command);
        }
        match self.driver.write(command, &mut self.applied) {
            Ok(()) => Ok(()),
            Err(error) => Err(self.fail(error.to_string())),
        }
    }

    /// One period at 0.
    pub(super) fn rest(&mut self) -> Result<()> {
        self.read()?;
        self.write(&mut vec![0.0; self.applied.len()])
    }

    /// Applies `command(time)` for `duration` s, from rest; `None` writes nothing at all.
    pub(super) fn drive(
        &mut self,
        duration: f64,
        command: impl Fn(f64) -> Option<Vec<f64>>,
    ) -> Result<Motion> {
        let (ny, nu) = (self.measured.len(), self.applied.len());
        let mut simulator = Simulator::<f64>::new(self.model, &self.model.values());
        let mut predicted = vec![0.0; ny];
        let mut motion = Motion {
            moved: vec![0.0; ny],
            expected: vec![0.0; ny],
            largest: vec![0.0; ny],
            applied: vec![0.0; nu],
            last: vec![0.0; ny],
        };
        let ticks = (duration / self.period).ceil().max(1.0) as u64;
        for tick in 0..ticks {
            let time = tick as f64 * self.period;
            self.read()?;
            if tick > 0 {
                simulator.advance(time, &self.applied);
                simulator.measure(&mut predicted);
                for (i, (y, expected)) in self.measured.iter().zip(&predicted).enumerate() {
                    motion.moved[i] += y * self.period;
                    motion.expected[i] += expected * self.period;
                    motion.largest[i] = motion.largest[i].max(y.abs());
                }
            }
            match command(time) {
                Some(mut command) => self.write(&mut command)?,
                None => self.applied.fill(0.0),
            }
            for (largest, applied) in motion.applied.iter_mut().zip(&self.applied) {
                *largest = applied.abs().max(*largest);
            }
        }
        motion.last.copy_from_slice(&self.measured);
        Ok(motion)
    }

    /// What the model alone makes of `command(time)`.
    pub(super) fn expect(
        &self,
        duration: f64,
        command: impl Fn(f64) -> Vec<f64>,
    ) -> (Vec<f64>, Vec<f64>) {
        let mut simulator = Simulator::<f64>::new(self.model, &self.model.values());
        let ny = self.measured.len();
        let (mut moved, mut largest, mut now) = (vec![0.0; ny], vec![0.0; ny], vec![0.0; ny]);
        for tick in 1..=(duration / self.period).ceil().max(1.0) as u64 {
            let time = tick as f64 * self.period;
            simulator.advance(time, &command(time - self.period));
            simulator.measure(&mut now);
            for (i, y) in now.iter().enumerate() {
                moved[i] += y * self.period;
                largest[i] = f64::max(largest[i], y.abs());
            }
        }
        (moved, largest)
    }
}

impl Drop for Bench<'_> {
    fn drop(&mut self) {
        if !self.stopped {
            // Whoever left early has said why.
            let _ = self.driver.safe_stop();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use loopsight_core::{Driver, DriverFault, Sample};
    use loopsight_model::registry::HostDriverError;

    use super::*;

    /// What a driver was asked: `r`ead, `w`rite, `s`top; and a clock that a test turns.
    #[derive(Clone, Default)]
    struct Seen(Arc<Mutex<(String, f64, Vec<f64>)>>);

    struct Fake {
        seen: Seen,
        measured: f64,
        fresh: bool,
        fails: bool,
    }

    impl Driver<f64> for Fake {
        type Error = HostDriverError;
        fn read(
            &mut self,
            measured: &mut [f64],
        ) -> std::result::Result<Sample<f64>, HostDriverError> {
            self.seen.0.lock().unwrap().0.push('r');
            measured.fill(self.measured);
            let (time, fresh) = (0.0, self.fresh);
            Ok(Sample { time, fresh })
        }
        fn write(
            &mut self,
            command: &[f64],
            applied: &mut [f64],
        ) -> std::result::Result<(), HostDriverError> {
            self.seen.0.lock().unwrap().0.push('w');
            applied.copy_from_slice(command);
            let message = "a pin failed".to_owned();
            let fault = DriverFault::Io;
            if self.fails {
                Err(HostDriverError { fault, message })
            } else {
                Ok(())
            }
        }
        fn safe_stop(&mut self) -> std::result::Result<(), HostDriverError> {
            self.seen.0.lock().unwrap().0.push('s');
            Ok(())
        }
    }

    impl Clock for Seen {
        fn now(&mut self) -> f64 {
            self.0.lock().unwrap().1
        }
        fn wait_until(&mut self, deadline: f64) {
            let mut state = self.0.lock().unwrap();
            state.2.push(deadline);
            state.1 = state.1.max(deadline);
        }
    }

    fn model() -> Model {
        let text = "[plant.oscillator]\nstiffness_per_mass = 1.0\ndamping_per_mass = 1.0\ninverse_mass = 1.0\n[log.measured.position]\n";
        Model::from_toml("model.toml", text).unwrap().0
    }

    fn bench<'m>(model: &'m Model, seen: &Seen, spoil: impl FnOnce(&mut Fake)) -> Bench<'m> {
        let mut driver = Fake {
            seen: seen.clone(),
            measured: 0.0,
            fresh: true,
            fails: false,
        };
        spoil(&mut driver);
        let cancel = CancelToken::new();
        let clock = Box::new(seen.clone());
        Bench::new(model, Box::new(driver), clock, None, 0.01, cancel)
    }

    #[test]
    fn ticks_begin_when_the_first_is_asked_for_and_none_is_made_up_for() {
        let (model, seen) = (model(), Seen::default());
        seen.0.lock().unwrap().1 = 20.0;
        let mut bench = bench(&model, &seen, |_| ());
        bench.rest().unwrap();
        bench.rest().unwrap();
        // Nobody looked for half a minute.
        seen.0.lock().unwrap().1 = 50.0;
        bench.rest().unwrap();
        bench.rest().unwrap();
        let waited = seen.0.lock().unwrap().2.clone();
        let expected = [20.0, 20.01, 20.02, 50.01];
        assert_eq!(waited.len(), expected.len());
        for (waited, expected) in waited.iter().zip(expected) {
            assert!((waited - expected).abs() < 1e-9, "{waited} s, {expected} s");
        }
    }

    #[test]
    fn whatever_goes_wrong_the_robot_is_stopped() {
        let model = model();
        let ends = |spoil: fn(&mut Fake), most: f64, interrupted: bool| {
            let seen = Seen::default();
            let mut bench = bench(&model, &seen, spoil);
            bench.most.fill(most);
            if interrupted {
                bench.cancel.cancel();
            }
            let failed = bench.drive(1.0, |_| Some(vec![0.0])).is_err();
            drop(bench);
            let asked = seen.0.lock().unwrap().0.clone();
            (failed, asked)
        };
        let said = |failed, asked: &str| (failed, asked.to_owned());
        assert_eq!(ends(|d| d.fails = true, 1.0, false), said(true, "rws"));
        assert_eq!(ends(|d| d.measured = 2.0, 1.0, false), said(true, "rs"));
        assert_eq!(
            ends(|d| d.measured = f64::NAN, 1.0, false),
            said(true, "rs")
        );
        assert_eq!(ends(|_| (), 1.0, true), said(true, "s"));
        let stale = ends(|d| d.fresh = false, 1.0, false);
        assert_eq!(stale, said(true, &("rw".repeat(20) + "rs")));
        // Also where nothing did, and somebody left.
        assert_eq!(
            ends(|_| (), 1.0, false),
            said(false, &("rw".repeat(100) + "s"))
        );
    }
}
