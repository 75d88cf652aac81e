//! The loop: read, identify, control, write, once per period.

use crate::controller::AffineModel;
use crate::{Clock, Command, ControlError, Controller, Driver, DriverError, Real, Sample};

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

/// Learns from the loop's samples; the loop hands it what was applied and what was measured.
///
/// Implemented by `identification::Identification` on a host; `()` learns nothing.
pub trait Observer<S: Real> {
    /// Inputs `applied` during the period that ends at `tick`, and what was measured at its end.
    fn observe(&mut self, tick: &Tick<S>, sample: &Sample<S>, measured: &[S], applied: &[S]);
}

impl<S: Real> Observer<S> for () {
    fn observe(&mut self, _: &Tick<S>, _: &Sample<S>, _: &[S], _: &[S]) {}
}

/// Why a loop ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TickError<E> {
    /// The driver failed or finished.
    Driver(E),
    /// The controller could not compute a command.
    Control(ControlError),
}

impl<E: DriverError> TickError<E> {
    /// True when the run simply came to its end.
    pub fn is_end(&self) -> bool {
        matches!(self, TickError::Driver(e) if e.kind() == crate::DriverFault::Finished)
    }
}

/// A control loop composed of a driver, a controller, a model of the plant, an observer that
/// learns, and a clock.
///
/// `B` is the buffer type: `[S; N]` without an allocator, `Vec<S>` on a host. The loop allocates
/// nothing after it was built.
#[derive(Debug)]
pub struct Loop<S, D, C, M, O, K, B> {
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
    period: f64,
    index: u64,
    controlled: B,
    measured: B,
    command: B,
    applied: B,
    marker: core::marker::PhantomData<S>,
}

/// What one tick did; borrowed from the loop's buffers.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a, S> {
    /// When.
    pub tick: Tick<S>,
    /// How old the measurement is.
    pub sample: Sample<S>,
    /// Everything the driver measured.
    pub measured: &'a [S],
    /// What the controller asked for.
    pub command: &'a [S],
    /// What the driver applied.
    pub applied: &'a [S],
    /// What the controller says of it.
    pub outcome: Command,
}

/// When, how fresh the sample was, and what the controller says.
type Advance<S> = (Tick<S>, Sample<S>, Command);

impl<S, D, C, M, O, K, B> Loop<S, D, C, M, O, K, B>
where
    S: Real,
    D: Driver<S>,
    C: Controller<S>,
    M: AffineModel<S>,
    O: Observer<S>,
    K: Clock,
    B: AsRef<[S]> + AsMut<[S]>,
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
            period,
            index: 0,
            controlled,
            measured,
            command,
            applied,
            marker: core::marker::PhantomData,
        }
    }

    /// The loop's period, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Waits for the next period, then reads, learns, controls and writes.
    ///
    /// On any error the driver has been stopped safely when this returns.
    pub fn tick(&mut self, reference: &[S]) -> Result<Step<'_, S>, TickError<D::Error>> {
        self.clock.wait_until(self.index as f64 * self.period);
        match self.advance(reference) {
            Ok((tick, sample, outcome)) => Ok(Step {
                tick,
                sample,
                measured: self.measured.as_ref(),
                command: self.command.as_ref(),
                applied: self.applied.as_ref(),
                outcome,
            }),
            Err(error) => {
                // The first error is the one that matters; a failing stop cannot be helped here.
                let _ = self.driver.safe_stop();
                Err(error)
            }
        }
    }

    fn advance(&mut self, reference: &[S]) -> Result<Advance<S>, TickError<D::Error>> {
        let tick = Tick {
            index: self.index,
            time: S::of(self.index as f64 * self.period),
            period: S::of(self.period),
        };
        let sample = self
            .driver
            .read(self.measured.as_mut())
            .map_err(TickError::Driver)?;
        if self.index > 0 {
            self.observer.observe(
                &tick,
                &sample,
                self.measured.as_ref(),
                self.applied.as_ref(),
            );
        }
        let controlled = self.controlled.as_mut();
        for (to, from) in controlled.iter_mut().zip(self.measured.as_ref()) {
            *to = *from;
        }
        let outcome = self
            .controller
            .step(
                &tick,
                reference,
                controlled,
                &mut self.model,
                self.command.as_mut(),
            )
            .map_err(TickError::Control)?;
        self.driver
            .write(self.command.as_ref(), self.applied.as_mut())
            .map_err(TickError::Driver)?;
        self.index += 1;
        Ok((tick, sample, outcome))
    }

    /// Brings the actuators to rest.
    pub fn stop(&mut self) -> Result<(), D::Error> {
        self.driver.safe_stop()
    }
}
