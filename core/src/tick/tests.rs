//! The loop, in single precision and without an allocator.

use super::*;
use crate::{DriverFault, SimulatedClock};

/// `y' = u`, sampled exactly, in single precision and without an allocator: as on a robot.
struct Integrator {
    y: f32,
    u: f32,
    time: f32,
}

impl Driver<f32> for Integrator {
    type Error = DriverFault;
    fn read(&mut self, measured: &mut [f32]) -> Result<Sample<f32>, DriverFault> {
        self.y += 0.5 * self.u;
        self.time += 0.5;
        measured[0] = self.y;
        let (time, fresh) = (self.time, true);
        Ok(Sample { time, fresh })
    }
    fn write(&mut self, command: &[f32], applied: &mut [f32]) -> Result<(), DriverFault> {
        self.u = command[0].clamp(-1.0, 1.0);
        applied[0] = self.u;
        Ok(())
    }
    fn safe_stop(&mut self) -> Result<(), DriverFault> {
        self.u = 0.0;
        Ok(())
    }
}

/// `y' = gain u`.
struct Gain(f32);

impl AffineModel<f32> for Gain {
    fn size(&self) -> usize {
        1
    }
    fn evaluate(&mut self, _: &[f32], drift: &mut [f32], input_matrix: &mut [f32]) {
        drift[0] = 0.0;
        input_matrix[0] = self.0;
    }
    fn learn(&mut self, parameter: usize, value: f32) {
        if parameter == 0 {
            self.0 = value;
        }
    }
}

/// Asks for `(reference - measured)/gain` and says when that is more than 1.
struct Proportional;

impl Controller<f32> for Proportional {
    fn step(
        &mut self,
        _: &Tick<f32>,
        reference: &[f32],
        measured: &[f32],
        model: &mut dyn AffineModel<f32>,
        command: &mut [f32],
    ) -> Result<Command, ControlError> {
        let (mut drift, mut gain) = ([0.0], [0.0]);
        model.evaluate(measured, &mut drift, &mut gain);
        command[0] = (reference[0] - measured[0] - drift[0]) / gain[0];
        let saturated = command[0].abs() > 1.0;
        let held = false;
        Ok(Command { saturated, held })
    }
    fn reset(&mut self) {}
}

/// Divides the change by what was applied, where the command was within its limits.
#[derive(Default)]
struct Quotient {
    before: Option<f32>,
    gain: Option<f32>,
    passed_over: usize,
}

impl Observer<f32> for Quotient {
    fn observe(&mut self, seen: &Observation<'_, f32>) {
        assert_eq!(seen.applied[0], seen.command[0].clamp(-1.0, 1.0));
        assert_eq!(seen.outcome.saturated, seen.command[0].abs() > 1.0);
        assert!(seen.tick.index > 0 && seen.sample.fresh);
        if seen.outcome.saturated {
            self.passed_over += 1;
        } else if let Some(before) = self.before
            && seen.applied[0] != 0.0
        {
            let rate = (seen.measured[0] - before) / seen.tick.period;
            self.gain = Some(rate / seen.applied[0]);
        }
        self.before = Some(seen.measured[0]);
    }
    fn teach(&self, model: &mut dyn AffineModel<f32>) {
        if let Some(gain) = self.gain {
            model.learn(0, gain);
        }
    }
}

fn composed<O: Observer<f32>>(
    observer: O,
) -> Loop<f32, Integrator, Proportional, Gain, O, SimulatedClock, [f32; 1]> {
    let driver = Integrator {
        y: 0.0,
        u: 0.0,
        time: 0.0,
    };
    let zero = [0.0];
    Loop::new(
        driver,
        Proportional,
        Gain(4.0),
        observer,
        SimulatedClock::default(),
        0.5,
        zero,
        zero,
        zero,
        zero,
    )
}

#[test]
fn what_was_learned_reaches_the_controller_in_the_same_tick() {
    let mut adaptive = composed(Some(Quotient::default()));
    // 6/4 is more than 1: that period is not learned from, the one after it is.
    for (k, gain) in [4.0, 4.0, 1.0, 1.0].into_iter().enumerate() {
        let reference = if k == 0 { 6.0 } else { 1.0 };
        adaptive.tick(&[reference]).unwrap();
        assert_eq!(adaptive.model.0, gain, "tick {k}");
    }
    assert_eq!(adaptive.observer.as_ref().unwrap().passed_over, 1);
}

#[test]
fn who_learns_nothing_teaches_nothing() {
    let mut plain = composed(());
    let mut none = composed(None::<Quotient>);
    for _ in 0..5 {
        plain.tick(&[0.5]).unwrap();
        none.tick(&[0.5]).unwrap();
    }
    assert_eq!((plain.model.0, none.model.0), (4.0, 4.0));
}
