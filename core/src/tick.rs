//! The loop: read, identify, control, write, once per period.

use crate::controller::AffineModel;
use crate::supervisor::{Action, Event, Supervise};
use crate::{
    Clock, Command, ControlError, Controller, Driver, DriverError, Innovation, Limits, Real, Sample,
};

/// Where in time a controller is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick<S> {
    /// Number of this tick, from 0.
    pub index: u64,
    /// Time of the tick, s since the loop started.
    pub time: S,
    /// The loop's period, s.
    pub period: S,
}

/// What happened in the period that ends at a tick: all that can be learned from.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a, S> {
    /// The tick at which the period ends.
    pub tick: Tick<S>,
    /// How old the measurement at the end of the period is.
    pub sample: Sample<S>,
    /// What was measured at the end of the period.
    pub measured: &'a [S],
    /// What the controller asked for at the beginning of the period.
    pub command: &'a [S],
    /// What the driver applied during the period.
    pub applied: &'a [S],
    /// What the controller said of `command`.
    pub outcome: Command,
}

/// Learns from the loop's samples, and hands what it learned to the controller's model.
///
/// Implemented by `identification::Identification` on a host; `()` learns nothing. Neither method
/// allocates.
pub trait Observer<S: Real> {
    /// Takes what happened since the tick before. Not called at the first tick.
    fn observe(&mut self, observation: &Observation<'_, S>);

    /// Certainty equivalence: hands learned values to `model` by [`AffineModel::learn`]. Called
    /// after every [`Observer::observe`], before the controller's step; by default nothing is handed
    /// over and the controller keeps the model it was built with.
    fn teach(&self, model: &mut dyn AffineModel<S>) {
        let _ = model;
    }

    /// What the last observation told the `row`-th regression that was not expected; `None` where
    /// there was nothing to learn, or no such regression.
    fn innovation(&self, row: usize) -> Option<Innovation<S>> {
        let _ = row;
        None
    }

    /// What other values of the model's parameters would have left unexplained of the same.
    fn residual(&self, row: usize, values: &[S]) -> Option<S> {
        let _ = (row, values);
        None
    }

    /// Starts over from these values of the model's parameters.
    fn restart(&mut self, values: &[S]) {
        let _ = values;
    }
}

impl<S: Real> Observer<S> for () {
    fn observe(&mut self, _: &Observation<'_, S>) {}
}

impl<S: Real, O: Observer<S>> Observer<S> for Option<O> {
    fn observe(&mut self, observation: &Observation<'_, S>) {
        if let Some(observer) = self {
            observer.observe(observation);
        }
    }

    fn teach(&self, model: &mut dyn AffineModel<S>) {
        if let Some(observer) = self {
            observer.teach(model);
        }
    }

    fn innovation(&self, row: usize) -> Option<Innovation<S>> {
        self.as_ref().and_then(|o| o.innovation(row))
    }

    fn residual(&self, row: usize, values: &[S]) -> Option<S> {
        self.as_ref().and_then(|o| o.residual(row, values))
    }

    fn restart(&mut self, values: &[S]) {
        if let Some(observer) = self {
            observer.restart(values);
        }
    }
}

/// Why a loop ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TickError<E, S = f64> {
    /// The driver failed or finished.
    Driver(E),
    /// The controller could not compute a command.
    Control(ControlError),
    /// The supervisor stopped the loop.
    Supervisor(Event<S>),
}

impl<E: DriverError, S> TickError<E, S> {
    /// True when the run simply came to its end.
    pub fn is_end(&self) -> bool {
        matches!(self, TickError::Driver(e) if e.kind() == crate::DriverFault::Finished)
    }
}

/// A control loop composed of a driver, a controller, a model of the plant, an observer that
/// learns, and a clock.
///
/// `B` is the buffer type: `[S; N]` without an allocator, `Vec<S>` on a host. `W` watches over it: a
/// [`Supervisor`](crate::supervisor::Supervisor), or nobody. The loop allocates nothing after it was built.
#[derive(Debug)]
pub struct Loop<S, D, C, M, O, K, B, W = ()> {
    /// What stands between the loop and the robot.
    pub driver: D,
    /// The control law.
    pub controller: C,
    /// The plant as the controller sees it.
    pub model: M,
    /// What learns from the samples.
    pub observer: O,
    /// Simulated or real time.
    pub clock: K,
    /// Decides whether what was learned is used, and stops the loop.
    pub supervisor: W,
    /// Limits of the references of the controlled signals.
    pub reference_limits: Option<Limits<B>>,
    /// Limits of the inputs, between controller and driver.
    pub input_limits: Option<Limits<B>>,
    period: f64,
    index: u64,
    reference: B,
    controlled: B,
    measured: B,
    command: B,
    limited: B,
    applied: B,
    outcome: Command,
    marker: core::marker::PhantomData<S>,
}

/// What one tick did; borrowed from the loop's buffers.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a, S> {
    /// When.
    pub tick: Tick<S>,
    /// How old the measurement is.
    pub sample: Sample<S>,
    /// What the controlled signals should be, within the limits.
    pub reference: &'a [S],
    /// Everything the driver measured.
    pub measured: &'a [S],
    /// What the controller asked for.
    pub command: &'a [S],
    /// What the driver applied.
    pub applied: &'a [S],
    /// What the controller says of it; saturated also where the loop's own limits held an input.
    pub outcome: Command,
    /// What the supervisor did at this tick.
    pub event: Option<Event<S>>,
    /// The controller has the last good model instead of the learned one.
    pub fallen: bool,
}

/// When, how fresh the sample was, what the controller says, and what the supervisor did.
type Advance<S> = (Tick<S>, Sample<S>, Command, Option<Event<S>>);

impl<S, D, C, M, O, K, B> Loop<S, D, C, M, O, K, B>
where
    B: Clone,
{
    /// Composes a loop. The first `reference.len()` measured signals are the controlled states;
    /// `measured`, `command` and `controlled` are buffers of the right lengths.
    #[allow(
        clippy::too_many_arguments,
        reason = "one argument per part of the loop"
    )]
    pub fn new(
        driver: D,
        controller: C,
        model: M,
        observer: O,
        clock: K,
        period: f64,
        measured: B,
        command: B,
        applied: B,
        controlled: B,
    ) -> Self {
        Self {
            driver,
            controller,
            model,
            observer,
            clock,
            supervisor: (),
            reference_limits: None,
            input_limits: None,
            period,
            index: 0,
            reference: controlled.clone(),
            controlled,
            measured,
            limited: command.clone(),
            command,
            applied,
            outcome: Command::default(),
            marker: core::marker::PhantomData,
        }
    }

    /// The same loop with a supervisor.
    pub fn supervised<W>(self, supervisor: W) -> Loop<S, D, C, M, O, K, B, W> {
        Loop {
            driver: self.driver,
            controller: self.controller,
            model: self.model,
            observer: self.observer,
            clock: self.clock,
            supervisor,
            reference_limits: self.reference_limits,
            input_limits: self.input_limits,
            period: self.period,
            index: self.index,
            reference: self.reference,
            controlled: self.controlled,
            measured: self.measured,
            command: self.command,
            limited: self.limited,
            applied: self.applied,
            outcome: self.outcome,
            marker: self.marker,
        }
    }
}

impl<S, D, C, M, O, K, B, W> Loop<S, D, C, M, O, K, B, W>
where
    S: Real,
    D: Driver<S>,
    C: Controller<S>,
    M: AffineModel<S>,
    O: Observer<S>,
    K: Clock,
    B: AsRef<[S]> + AsMut<[S]>,
    W: Supervise<S>,
{
    /// The loop's period, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Waits for the next period, then reads, learns, judges and teaches, controls and writes.
    ///
    /// On any error the driver has been stopped safely when this returns.
    pub fn tick(&mut self, reference: &[S]) -> Result<Step<'_, S>, TickError<D::Error, S>> {
        self.clock.wait_until(self.index as f64 * self.period);
        match self.advance(reference) {
            Ok((tick, sample, outcome, event)) => Ok(Step {
                tick,
                sample,
                reference: self.reference.as_ref(),
                measured: self.measured.as_ref(),
                command: self.command.as_ref(),
                applied: self.applied.as_ref(),
                outcome,
                event,
                fallen: self.supervisor.fallen(),
            }),
            Err(error) => {
                // The first error is the one that matters; a failing stop cannot be helped here.
                let _ = self.driver.safe_stop();
                Err(error)
            }
        }
    }

    fn advance(&mut self, reference: &[S]) -> Result<Advance<S>, TickError<D::Error, S>> {
        let tick = Tick {
            index: self.index,
            time: S::of(self.index as f64 * self.period),
            period: S::of(self.period),
        };
        let sample = self
            .driver
            .read(self.measured.as_mut())
            .map_err(TickError::Driver)?;
        for (to, from) in self.reference.as_mut().iter_mut().zip(reference) {
            *to = *from;
        }
        if let Some(limits) = &mut self.reference_limits {
            limits.hold(tick.period, self.reference.as_mut());
        }
        let seen = Observation {
            tick,
            sample,
            measured: self.measured.as_ref(),
            command: self.command.as_ref(),
            applied: self.applied.as_ref(),
            outcome: self.outcome,
        };
        let mut event = None;
        if self.index > 0 {
            self.observer.observe(&seen);
            event = self.supervisor.judge(
                &seen,
                self.reference.as_ref(),
                &mut self.observer,
                &mut self.model,
            );
            if let Some(event) = event.filter(|e| e.action == Action::Stopped) {
                return Err(TickError::Supervisor(event));
            }
        }
        let controlled = self.controlled.as_mut();
        for (to, from) in controlled.iter_mut().zip(self.measured.as_ref()) {
            *to = *from;
        }
        self.model.track(&seen, controlled);
        self.outcome = self
            .controller
            .step(
                &tick,
                self.reference.as_ref(),
                controlled,
                &mut self.model,
                self.command.as_mut(),
            )
            .map_err(TickError::Control)?;
        for (to, from) in self.limited.as_mut().iter_mut().zip(self.command.as_ref()) {
            *to = *from;
        }
        if let Some(limits) = &mut self.input_limits {
            self.outcome.saturated |= limits.hold(tick.period, self.limited.as_mut());
        }
        self.driver
            .write(self.limited.as_ref(), self.applied.as_mut())
            .map_err(TickError::Driver)?;
        if let Some(limits) = &mut self.input_limits {
            limits.start(self.applied.as_ref());
        }
        self.index += 1;
        Ok((tick, sample, self.outcome, event))
    }

    /// Brings the actuators to rest.
    pub fn stop(&mut self) -> Result<(), D::Error> {
        self.driver.safe_stop()
    }
}

#[cfg(test)]
mod tests {
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
            self.u = command[0].held(-1.0, 1.0);
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
            assert_eq!(seen.applied[0], seen.command[0].held(-1.0, 1.0));
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
}
