//! What the effects of a model add to the efforts of its plant.

use heapless::Vec;
use loopsight_core::{Place, Plant, Real};
use loopsight_link::{Attachment, CHANNELS, EFFECTS, PARAMETERS, Unusable};

use crate::Known;
use crate::effects::READS;

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
/// | `y` | controlled states, `NU` of them |
/// | `s` | a signal: one of the controlled states, or an output that is linear in them, as speeds are |
/// | `c` | how, found by moving each of the states by one; what is learned does not move it |
#[derive(Clone)]
pub struct Efforts<S, const NU: usize> {
    acting: Vec<Acting<S, NU>, { EFFECTS * CHANNELS }>,
}

/// An effect at one of its channels.
#[derive(Clone)]
pub(crate) struct Acting<S, const NU: usize> {
    known: Known,
    effort: usize,
    side: S,
    /// `c` of the signals that it reads there, in its order.
    reads: [[S; NU]; READS],
    values: [S; PARAMETERS],
}

impl<S: Real, const NU: usize> Efforts<S, NU> {
    /// No effects.
    pub fn none() -> Self {
        Self { acting: Vec::new() }
    }

    /// The effects of a configuration, for the plant `P` with the parameters `p`.
    pub fn new<P, const NX: usize, const NW: usize, const NP: usize, const NY: usize>(
        attachments: &[Attachment],
        p: &[S; NP],
    ) -> Result<Self, Unusable>
    where
        P: Plant<NX, NU, NW, NP, NY>,
    {
        let mut efforts = Self::none();
        for (index, attachment) in attachments.iter().enumerate() {
            let at = index as u8;
            let known = Known::named(&attachment.id).ok_or(Unusable::Effect(at))?;
            let meta = known.meta();
            let finite = attachment.values.iter().all(|v| v.is_finite());
            if meta.parameters.len() != attachment.values.len() || !finite {
                return Err(Unusable::Effect(at));
            }
            let mut values = [S::zero(); PARAMETERS];
            for (to, from) in values.iter_mut().zip(&attachment.values) {
                *to = S::of(f64::from(*from));
            }
            for channel in &attachment.channels {
                let channel =
                    (P::META.channels.get(usize::from(*channel))).ok_or(Unusable::Channel(at))?;
                let Place::Effort(effort) = channel.place else {
                    return Err(Unusable::Channel(at));
                };
                let mut reads = [[S::zero(); NU]; READS];
                for (to, role) in reads.iter_mut().zip(meta.reads) {
                    let name = channel.read(*role).ok_or(Unusable::Channel(at))?;
                    *to = signal::<S, P, NX, NU, NW, NP, NY>(name, p).ok_or(Unusable::Reads(at))?;
                }
                let acting = Acting {
                    known,
                    effort,
                    side: S::of(f64::from(channel.side)),
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
    pub fn at<const NW: usize>(&self, y: &[S; NU]) -> [S; NW] {
        let mut w = [S::zero(); NW];
        for acting in &self.acting {
            let effort = &mut w[acting.effort];
            *effort += acting.contribution(*effort, y);
        }
        w
    }
}

impl<S: Real, const NU: usize> Acting<S, NU> {
    /// What it adds to an effort that is `nominal` without it. On its own: within a tick its constants would
    /// be loaded, and what they displace saved, before it is known which effect it is.
    #[inline(never)]
    fn contribution(&self, nominal: S, y: &[S; NU]) -> S {
        let signal = |k: usize| {
            let products = self.reads[k].iter().zip(y).map(|(c, y)| *c * *y);
            products
                .reduce(|sum, product| sum + product)
                .unwrap_or(S::zero())
        };
        (self.known).contribution(nominal, self.side, signal, &self.values)
    }
}

/// `c` of the signal `name`, where it is linear in the controlled states alone: everything else is not known
/// aboard. Found by moving them and the rest, in the plant's own equations.
fn signal<
    S,
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
>(
    name: &str,
    p: &[S; NP],
) -> Option<[S; NU]>
where
    S: Real,
    P: Plant<NX, NU, NW, NP, NY>,
{
    let controlled = P::META.controlled;
    let unit = |i: usize| core::array::from_fn(|k| if k == i { S::one() } else { S::zero() });
    if let Some(state) = P::META.states.iter().position(|s| s.id == name) {
        return controlled.iter().position(|i| *i == state).map(unit);
    }
    let index = P::META.outputs.iter().position(|s| s.id == name)?;
    let output = |y: &[S; NU], rest: f64, p: &[S; NP]| {
        let mut x = [S::of(rest); NX];
        for (i, y) in controlled.iter().zip(y) {
            x[*i] = *y;
        }
        P::output(index, &x, &[S::of(rest); NU], p)
    };
    let of = |p: &[S; NP]| core::array::from_fn(|i| output(&unit(i), 0.0, p));
    let c: [S; NU] = of(p);
    let mut others = *p;
    for (value, parameter) in others.iter_mut().zip(P::META.parameters) {
        if parameter.linear {
            *value = *value * S::of(1.7) + S::one();
        }
    }
    let linear = [[0.3, -1.1], [-2.3, 0.7], [0.0, 0.0]].iter().all(|pair| {
        let y: [S; NU] = core::array::from_fn(|i| S::of(pair[i % 2] * (1 + i / 2) as f64));
        let products = || c.iter().zip(&y).map(|(c, y)| *c * *y);
        let sum = products().fold(S::zero(), |sum, product| sum + product);
        let size = products().fold(S::zero(), |sum, product| sum + product.abs());
        [0.0, 1.0, -0.6].iter().all(|rest| {
            let off = (output(&y, *rest, p) - sum).abs();
            off <= S::of(1e-5) * size
        })
    });
    (linear && of(&others) == c).then_some(c)
}
