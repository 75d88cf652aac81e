//! What the effects of a model add to the efforts of its plant.

use heapless::Vec;
use loopsight_core::{Array, Place, Plant, Real};
use loopsight_link::{Attachment, CHANNELS, EFFECTS, PARAMETERS, Unusable};

use crate::effects::EffectSet;
use crate::parts::{Parts, PerEffort, PerInput, PerParameter, PerState};

/// The effects of a model on the efforts of a plant.
///
/// ```text
/// w[c] = Σ over the effects on channel c, each with the sum of those before it as its nominal
/// s = c y                                                   a signal that an effect reads
/// ```
///
/// The same order, and the same source of every effect, as in a simulation on a host.
///
/// | symbol | what |
/// |---|---|
/// | `y` | controlled states, as many as the plant has inputs |
/// | `s` | a signal: one of the controlled states, or an output that is linear in them, as speeds are |
/// | `c` | its row, found by moving each of the states by one; it does not depend on what is learned |
pub struct Efforts<R: Parts> {
    acting: Vec<Acting<R>, { EFFECTS * CHANNELS }>,
}

impl<R: Parts> Clone for Efforts<R> {
    fn clone(&self) -> Self {
        Self {
            acting: self.acting.clone(),
        }
    }
}

/// An effect at one of its channels.
struct Acting<R: Parts> {
    effect: R::Effects,
    effort: usize,
    side: R::Scalar,
    /// `c` of the signals that it reads there, in its order.
    reads: <R::Effects as EffectSet>::Reads<PerInput<R>>,
    values: [R::Scalar; PARAMETERS],
}

impl<R: Parts> Clone for Acting<R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R: Parts> Copy for Acting<R> {}

impl<R: Parts> Efforts<R> {
    /// No effects.
    pub fn none() -> Self {
        Self { acting: Vec::new() }
    }

    /// The effects of a configuration, for a plant with the parameters `p`.
    ///
    /// # Errors
    ///
    /// The first effect that is not among [`Parts::Effects`], has other values than its parameters, acts on
    /// something else than efforts, or reads a signal that is not linear in the controlled states.
    pub fn new(attachments: &[Attachment], p: &PerParameter<R>) -> Result<Self, Unusable> {
        let mut efforts = Self::none();
        for (index, attachment) in attachments.iter().enumerate() {
            let at = index as u8;
            let effect = R::Effects::named(&attachment.id).ok_or(Unusable::Effect(at))?;
            let meta = effect.meta();
            let finite = attachment.values.iter().all(|v| v.is_finite());
            if meta.parameters.len() != attachment.values.len() || !finite {
                return Err(Unusable::Effect(at));
            }
            let mut values = [R::Scalar::of(0.0); PARAMETERS];
            for (to, from) in values.iter_mut().zip(&attachment.values) {
                *to = R::Scalar::of(f64::from(*from));
            }
            for channel in &attachment.channels {
                let channel = R::Plant::META.channels.get(usize::from(*channel));
                let channel = channel.ok_or(Unusable::Channel(at))?;
                let Place::Effort(effort) = channel.place else {
                    return Err(Unusable::Channel(at));
                };
                let mut reads = Array::filled(PerInput::<R>::filled(R::Scalar::of(0.0)));
                let rows: &mut <R::Effects as EffectSet>::Reads<PerInput<R>> = &mut reads;
                for (to, role) in rows.as_mut().iter_mut().zip(meta.reads) {
                    let name = channel.read(*role).ok_or(Unusable::Channel(at))?;
                    *to = signal::<R>(name, p).ok_or(Unusable::Reads(at))?;
                }
                let acting = Acting {
                    effect,
                    effort,
                    side: R::Scalar::of(f64::from(channel.side)),
                    reads,
                    values,
                };
                let full = |_| Unusable::Effect(at);
                efforts.acting.push(acting).map_err(full)?;
            }
        }
        Ok(efforts)
    }

    /// The efforts where the controlled states are `y`.
    #[inline(always)]
    pub fn at(&self, y: &PerInput<R>) -> PerEffort<R> {
        let mut w = PerEffort::<R>::filled(R::Scalar::of(0.0));
        for acting in &self.acting {
            let effort = &mut w[acting.effort];
            *effort += acting.contribution(*effort, y);
        }
        w
    }
}

impl<R: Parts> Acting<R> {
    /// What it adds to an effort that is `nominal` without it. A function of its own: inlined into a tick,
    /// its constants would be loaded before it is known which effect it is.
    #[inline(never)]
    fn contribution(&self, nominal: R::Scalar, y: &PerInput<R>) -> R::Scalar {
        let signal = |k: usize| {
            let row = self.reads[k].as_ref().iter();
            let products = row.zip(y.as_ref()).map(|(c, y)| *c * *y);
            products
                .reduce(|sum, product| sum + product)
                .unwrap_or(R::Scalar::of(0.0))
        };
        (self.effect).contribution(nominal, self.side, signal, &self.values)
    }
}

/// `c` of the signal `name`, where it is linear in the controlled states alone. Everything else is not known
/// aboard. Found by moving them and the rest, in the plant's own equations.
fn signal<R: Parts>(name: &str, p: &PerParameter<R>) -> Option<PerInput<R>> {
    let of = R::Scalar::of;
    let meta = &R::Plant::META;
    let controlled = meta.controlled;
    let unit = |i: usize| PerInput::<R>::from_fn(|k| of(if k == i { 1.0 } else { 0.0 }));
    if let Some(state) = meta.states.iter().position(|s| s.id == name) {
        return controlled.iter().position(|i| *i == state).map(unit);
    }
    let index = meta.outputs.iter().position(|s| s.id == name)?;
    let output = |y: &PerInput<R>, rest: f64, p: &PerParameter<R>| {
        let mut x = PerState::<R>::filled(of(rest));
        for (i, y) in controlled.iter().zip(y.as_ref()) {
            x[*i] = *y;
        }
        R::Plant::output(index, &x, &PerInput::<R>::filled(of(rest)), p)
    };
    let row = |p: &PerParameter<R>| PerInput::<R>::from_fn(|i| output(&unit(i), 0.0, p));
    let c = row(p);
    let mut others = *p;
    for (value, parameter) in others.as_mut().iter_mut().zip(meta.parameters) {
        if parameter.linear {
            *value = *value * of(1.7) + R::Scalar::of(1.0);
        }
    }
    let linear = [[0.3, -1.1], [-2.3, 0.7], [0.0, 0.0]].iter().all(|pair| {
        let y = PerInput::<R>::from_fn(|i| of(pair[i % 2] * (1 + i / 2) as f64));
        let products = || c.as_ref().iter().zip(y.as_ref()).map(|(c, y)| *c * *y);
        let sum = products().fold(R::Scalar::of(0.0), |sum, product| sum + product);
        let size = products().fold(R::Scalar::of(0.0), |sum, product| sum + product.abs());
        [0.0, 1.0, -0.6].iter().all(|rest| {
            let off = (output(&y, *rest, p) - sum).abs();
            off <= of(1e-5) * size
        })
    });
    (linear && row(&others).as_ref() == c.as_ref()).then_some(c)
}
