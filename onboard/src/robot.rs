//! The loop aboard, made from a configuration.

use loopsight_core::{Array, Command, Loop, Plant};
use loopsight_link::{Configuration, ControllerGains, Unusable};

use crate::law::OnboardLaw;
use crate::parts::{Parts, PerInput, PerParameter};
use crate::{AffinePlant, Efforts, Learner, Port, Prompted};

/// The loop aboard: driver, model, learning and control law, as a configuration says.
pub struct Robot<R: Parts> {
    inner: Inner<R>,
    gains: ControllerGains,
    parameters: PerParameter<R>,
}

type Inner<R> = Loop<
    <R as Parts>::Scalar,
    Port<<R as Parts>::Scalar, PerInput<R>>,
    <R as Parts>::Law,
    AffinePlant<R>,
    Option<Learner<R>>,
    Prompted,
    PerInput<R>,
>;

impl<R: Parts<Scalar = f32>> Robot<R> {
    /// The loop of `configuration`, `period` in s.
    ///
    /// # Errors
    ///
    /// The first thing in the configuration that does not fit these [`Parts`], or cannot be used.
    pub fn new(configuration: &Configuration, period: f64) -> Result<Self, Unusable> {
        let (model, learner, parameters) = parts(configuration, period)?;
        let gains = &configuration.controller;
        let controller = R::Law::new(gains, period).ok_or(Unusable::Controller)?;
        let zero = PerInput::<R>::filled(0.0);
        let inner = Loop::new(
            Port::default(),
            controller,
            model,
            learner,
            Prompted,
            period,
            zero,
            zero,
            zero,
            zero,
        );
        Ok(Self {
            inner,
            gains: gains.clone(),
            parameters,
        })
    }

    /// Takes an improved model while it runs. Model and learning start from it. The control law keeps its
    /// integrals if its gains are the same.
    ///
    /// # Errors
    ///
    /// As [`Robot::new`]; the robot then goes on as before.
    pub fn improve(&mut self, configuration: &Configuration, period: f64) -> Result<(), Unusable> {
        let mut next = Self::new(configuration, period)?;
        if next.gains == self.gains {
            core::mem::swap(&mut next.inner.controller, &mut self.inner.controller);
        }
        next.inner.driver.applied = self.inner.driver.applied;
        *self = next;
        Ok(())
    }

    /// One tick: what the control law says of its command. [`Robot::applied`] is what the motors get.
    ///
    /// `None` where there is no command: then the motors are at rest.
    pub fn tick(
        &mut self,
        measured: PerInput<R>,
        fresh: bool,
        reference: &[f32],
    ) -> Option<Command> {
        self.inner.driver.measured = measured;
        self.inner.driver.fresh = fresh;
        Some(self.inner.tick(reference).ok()?.outcome)
    }

    /// From now on the supply gives inputs up to this magnitude.
    pub fn give_at_most(&mut self, most: f32) {
        self.inner.driver.most = most;
    }

    /// What the motors get.
    pub fn applied(&self) -> &PerInput<R> {
        &self.inner.driver.applied
    }

    /// The plant's parameters, the learned ones as they are estimated.
    pub fn parameters(&self) -> &PerParameter<R> {
        match &self.inner.observer {
            Some(learner) => learner.values(),
            None => &self.parameters,
        }
    }

    /// Controlled states whose estimator learned from the last tick, one bit each.
    pub fn learned(&self) -> u8 {
        self.inner.observer.as_ref().map_or(0, Learner::learned)
    }
}

/// Model and learning of a configuration, and the parameters that both start from.
type Made<R> = (AffinePlant<R>, Option<Learner<R>>, PerParameter<R>);

fn parts<R: Parts<Scalar = f32>>(
    configuration: &Configuration,
    period: f64,
) -> Result<Made<R>, Unusable> {
    let meta = &R::Plant::META;
    if configuration.plant != meta.id {
        return Err(Unusable::Plant);
    }
    let parameters = *PerParameter::<R>::from_slice(&configuration.parameters)
        .filter(|p| {
            let mut declared = meta.parameters.iter().zip(p.as_ref());
            declared.all(|(d, v)| v.is_finite() && d.admits(f64::from(*v)))
        })
        .ok_or(Unusable::Parameters)?;
    let bands = *PerInput::<R>::from_slice(&configuration.bands)
        .filter(|b| b.as_ref().iter().all(|v| v.is_finite() && *v >= 0.0))
        .ok_or(Unusable::Controller)?;
    let efforts = Efforts::new(&configuration.effects, &parameters)?;
    let learner = (configuration.learning.as_ref())
        .map(|learning| {
            Learner::new(
                learning,
                parameters,
                efforts.clone(),
                configuration.means,
                period,
            )
        })
        .transpose()?;
    let model = AffinePlant::new(parameters, efforts, bands);
    Ok((model, learner, parameters))
}
