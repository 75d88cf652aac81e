//! The loop: read, identify, control, write, once per period.

use crate::controller::AffineModel;
use crate::supervisor::{Action, Event, Supervise};
use crate::{
    Clock, Command, ControlError, Controller, Driver, DriverError, Innovation, Limits, Real, Sample,
};

/// The time of a tick, for a controller.
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

    /// The innovation of the `row`-th regression at the last observation; `None` where there was nothing to learn, or
    /// no such regression.
    fn innovation(&self, row: usize) -> Option<Innovation<S>> {
        let _ = row;
        None
    }

    /// The innovation that other values of the model's parameters would have had.
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
/// `B` is the buffer type: `[S; N]` without an allocator, `Vec<S>` on a host. `W` is a
/// [`Supervisor`](crate::supervisor::Supervisor), or none. The loop allocates nothing after it was built.
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
    /// The same for references that are asked for ahead of their time.
    pub target_limits: Option<Limits<B>>,
    /// Limits of the inputs, between controller and driver.
    pub input_limits: Option<Limits<B>>,
    period: f64,
    /// The period as the loop's scalar, s.
    seconds: S,
    index: u64,
    /// When the first tick began, by the clock.
    origin: f64,
    reference: B,
    target: B,
    controlled: B,
    measured: B,
    command: B,
    limited: B,
    applied: B,
    outcome: Command,
}

/// What one tick did; borrowed from the loop's buffers.
#[derive(Clone, Copy, Debug)]
pub struct TickRecord<'a, S> {
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
    /// The controller's remark on it; saturated also where the loop's own limits clamped an input.
    pub outcome: Command,
    /// What the supervisor did at this tick.
    pub event: Option<Event<S>>,
    /// The controller has the last good model instead of the learned one.
    pub fallen: bool,
    /// How long after its time the tick began, s.
    pub late: f64,
    /// How long it took from there until the command was written, s.
    pub busy: f64,
}

/// When, how fresh the sample was, what the controller says, and what the supervisor did.
type Advance<S> = (Tick<S>, Sample<S>, Command, Option<Event<S>>);

impl<S, D, C, M, O, K, B> Loop<S, D, C, M, O, K, B>
where
    S: Real,
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
            target_limits: None,
            input_limits: None,
            period,
            seconds: S::of(period),
            index: 0,
            origin: 0.0,
            reference: controlled.clone(),
            target: controlled.clone(),
            controlled,
            measured,
            limited: command.clone(),
            command,
            applied,
            outcome: Command::default(),
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
            target_limits: self.target_limits,
            input_limits: self.input_limits,
            period: self.period,
            seconds: self.seconds,
            index: self.index,
            origin: self.origin,
            reference: self.reference,
            target: self.target,
            controlled: self.controlled,
            measured: self.measured,
            command: self.command,
            limited: self.limited,
            applied: self.applied,
            outcome: self.outcome,
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

    /// Waits for the next period, then reads, learns, supervises, controls and writes.
    ///
    /// On any error the driver has been stopped safely when this returns.
    ///
    /// # Errors
    ///
    /// [`TickError`] where driver or controller fail, or where the supervisor stops the loop.
    pub fn tick(&mut self, reference: &[S]) -> Result<TickRecord<'_, S>, TickError<D::Error, S>> {
        self.tick_towards(reference, reference)
    }

    /// As [`Loop::tick`], with the references that hold when the next command arrives at the plant:
    /// the controller gets `target`, [`AffineModel::ahead`] of time; `reference` is what holds now,
    /// for who watches or logs.
    ///
    /// # Errors
    ///
    /// As [`Loop::tick`].
    pub fn tick_towards(
        &mut self,
        reference: &[S],
        target: &[S],
    ) -> Result<TickRecord<'_, S>, TickError<D::Error, S>> {
        if self.index == 0 {
            self.origin = self.clock.now();
        }
        let due = self.origin + self.index as f64 * self.period;
        self.clock.wait_until(due);
        let began = self.clock.now();
        match self.advance(reference, target) {
            Ok((tick, sample, outcome, event)) => Ok(TickRecord {
                late: began - due,
                busy: self.clock.now() - began,
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

    fn advance(
        &mut self,
        reference: &[S],
        target: &[S],
    ) -> Result<Advance<S>, TickError<D::Error, S>> {
        let tick = Tick {
            index: self.index,
            time: S::of(self.index as f64 * self.period),
            period: self.seconds,
        };
        let sample = self
            .driver
            .read(self.measured.as_mut())
            .map_err(TickError::Driver)?;
        for (wanted, limits, from) in [
            (&mut self.reference, &mut self.reference_limits, reference),
            (&mut self.target, &mut self.target_limits, target),
        ] {
            for (to, from) in wanted.as_mut().iter_mut().zip(from) {
                *to = *from;
            }
            if let Some(limits) = limits {
                limits.clamp(tick.period, wanted.as_mut());
            }
        }
        // Until its step a controller with references of its own has those of the last one.
        self.controller.demand(self.reference.as_mut());
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
        self.controller.sampled(&sample);
        self.outcome = self
            .controller
            .step(
                &tick,
                self.target.as_ref(),
                controlled,
                &mut self.model,
                self.command.as_mut(),
            )
            .map_err(TickError::Control)?;
        self.controller.demand(self.reference.as_mut());
        for (to, from) in self.limited.as_mut().iter_mut().zip(self.command.as_ref()) {
            *to = *from;
        }
        if let Some(limits) = &mut self.input_limits {
            self.outcome.saturated |= limits.clamp(tick.period, self.limited.as_mut());
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
    ///
    /// # Errors
    ///
    /// That of [`Driver::safe_stop`].
    pub fn stop(&mut self) -> Result<(), D::Error> {
        self.driver.safe_stop()
    }
}

#[cfg(test)]
mod tests;
