//! The loop of a configuration.

use loopsight_controllers::FeedbackLinearizingPi;
use loopsight_core::{Command, ControlAffine, Loop, Plant};
use loopsight_link::{Configuration, ControllerGains, Unusable};
use nalgebra::{Const, SVector};

use crate::{Efforts, Learner, Model, Port, Prompted};

/// A loop in fixed sizes, as a configuration says.
pub struct Robot<
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
    const R: usize,
> {
    inner: Inner<P, NX, NU, NW, NP, NY, R>,
    gains: ControllerGains,
    parameters: [f32; NP],
}

type Inner<
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
    const R: usize,
> = Loop<
    f32,
    Port<f32, NU>,
    FeedbackLinearizingPi<f32, Const<NU>>,
    Model<f32, P, NX, NU, NW, NP, NY>,
    Option<Learner<f32, P, NX, NU, NW, NP, NY, R>>,
    Prompted,
    [f32; NU],
>;

/// What one tick came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Done<const NU: usize> {
    /// What the motors get.
    pub applied: [f32; NU],
    /// What the control law says of it.
    pub outcome: Command,
}

impl<
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
    const R: usize,
> Robot<P, NX, NU, NW, NP, NY, R>
where
    P: Plant<NX, NU, NW, NP, NY> + ControlAffine<NU, NU, NW, NP>,
{
    /// The loop of `configuration`, `period` in s.
    pub fn new(configuration: &Configuration, period: f64) -> Result<Self, Unusable> {
        let (model, learner, parameters) = parts(configuration, period)?;
        let gains = &configuration.controller;
        let vector = |list: &[f64]| {
            let list = <[f64; NU]>::try_from(list).map_err(|_| Unusable::Controller)?;
            Ok(SVector::from(list))
        };
        let controller = FeedbackLinearizingPi::new(
            &vector(&gains.proportional)?,
            &vector(&gains.integral)?,
            &vector(&gains.limit)?,
            period,
        )
        .map_err(|_| Unusable::Controller)?;
        let zero = [0.0; NU];
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

    /// Takes an improved model while it runs: model and learning start from it, the control law keeps its
    /// integrals where its gains are the same.
    pub fn improve(&mut self, configuration: &Configuration, period: f64) -> Result<(), Unusable> {
        let mut next = Self::new(configuration, period)?;
        if next.gains == self.gains {
            core::mem::swap(&mut next.inner.controller, &mut self.inner.controller);
        }
        next.inner.driver.applied = self.inner.driver.applied;
        *self = next;
        Ok(())
    }

    /// One tick. `None` where there is no command: then the motors are at rest.
    pub fn tick(
        &mut self,
        measured: [f32; NU],
        fresh: bool,
        reference: &[f32],
    ) -> Option<Done<NU>> {
        self.inner.driver.measured = measured;
        self.inner.driver.fresh = fresh;
        let outcome = self.inner.tick(reference).ok()?.outcome;
        Some(Done {
            applied: self.inner.driver.applied,
            outcome,
        })
    }

    /// From now on the supply gives inputs up to this magnitude.
    pub fn give_at_most(&mut self, most: f32) {
        self.inner.driver.most = most;
    }

    /// What the motors get.
    pub fn applied(&self) -> &[f32; NU] {
        &self.inner.driver.applied
    }

    /// The plant's parameters, the learned ones as they are estimated.
    pub fn parameters(&self) -> &[f32; NP] {
        match &self.inner.observer {
            Some(learner) => learner.values(),
            None => &self.parameters,
        }
    }

    /// Rows that the last tick taught, one bit each.
    pub fn learned(&self) -> u8 {
        self.inner.observer.as_ref().map_or(0, Learner::learned)
    }
}

type Parts<
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
    const R: usize,
> = (
    Model<f32, P, NX, NU, NW, NP, NY>,
    Option<Learner<f32, P, NX, NU, NW, NP, NY, R>>,
    [f32; NP],
);

fn parts<
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
    const R: usize,
>(
    configuration: &Configuration,
    period: f64,
) -> Result<Parts<P, NX, NU, NW, NP, NY, R>, Unusable>
where
    P: Plant<NX, NU, NW, NP, NY> + ControlAffine<NU, NU, NW, NP>,
{
    if configuration.plant != P::META.id {
        return Err(Unusable::Plant);
    }
    let parameters = <[f32; NP]>::try_from(configuration.parameters.as_slice())
        .ok()
        .filter(|p| {
            let declared = P::META.parameters.iter().zip(p);
            declared
                .clone()
                .all(|(d, v)| v.is_finite() && d.admits(f64::from(*v)))
        })
        .ok_or(Unusable::Parameters)?;
    let bands = <[f32; NU]>::try_from(configuration.bands.as_slice())
        .ok()
        .filter(|b| b.iter().all(|v| v.is_finite() && *v >= 0.0))
        .ok_or(Unusable::Controller)?;
    let efforts = Efforts::new::<P, NX, NW, NP, NY>(&configuration.effects, &parameters)?;
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
    Ok((Model::new(parameters, efforts, bands), learner, parameters))
}
