//! What the effects of a model add to the efforts of its plant.

use heapless::Vec;
use loopsight_core::{NoPast, Place, Plant, Reading, Real, Role};
use loopsight_link::{Attachment, CHANNELS, EFFECTS, PARAMETERS, Unusable};

use crate::Known;

/// Most roles that an effect reads at a channel.
const ROLES: usize = 4;

/// The effects of a model on the efforts of a plant.
///
/// ```text
/// w[c] = Σ over the effects on channel c, each with the sum of those before it as its nominal
/// ```
///
/// The same order, and the same source of every effect, as in a simulation on a host.
#[derive(Clone)]
pub struct Efforts<S: 'static, const NX: usize> {
    effects: Vec<Acting<S>, EFFECTS>,
    /// Which state of the plant is the `i`-th controlled one.
    controlled: &'static [usize],
}

/// One effect, at all its channels.
#[derive(Clone)]
struct Acting<S: 'static> {
    known: Known,
    values: Vec<S, PARAMETERS>,
    channels: Vec<At<S>, CHANNELS>,
    /// What it sees at the present channel; roles that it does not read are never written.
    reading: Reading<'static, S>,
}

/// A channel that an effect is at.
#[derive(Clone)]
struct At<S> {
    effort: usize,
    side: S,
    /// Roles and where their signals are: states first, then outputs (inputs are not offered).
    reads: Vec<(Role, Where), ROLES>,
}

#[derive(Clone, Copy)]
enum Where {
    State(usize),
    Output(usize),
}

impl<S: Real, const NX: usize> Efforts<S, NX> {
    /// No effects.
    pub fn none<P, const NU: usize, const NW: usize, const NP: usize, const NY: usize>() -> Self
    where
        P: Plant<NX, NU, NW, NP, NY>,
    {
        Self {
            effects: Vec::new(),
            controlled: P::META.controlled,
        }
    }

    /// The effects of a configuration, for the plant `P`.
    pub fn new<P, const NU: usize, const NW: usize, const NP: usize, const NY: usize>(
        attachments: &[Attachment],
    ) -> Result<Self, Unusable>
    where
        P: Plant<NX, NU, NW, NP, NY>,
    {
        let mut efforts = Self::none::<P, NU, NW, NP, NY>();
        for (index, attachment) in attachments.iter().enumerate() {
            let at = index as u8;
            let known = Known::named(&attachment.id).ok_or(Unusable::Effect(at))?;
            let meta = known.meta();
            let finite = attachment.values.iter().all(|v| v.is_finite());
            if meta.parameters.len() != attachment.values.len() || !finite {
                return Err(Unusable::Effect(at));
            }
            let values = attachment.values.iter().map(|v| S::of(f64::from(*v)));
            let mut acting = Acting {
                known,
                values: values.collect(),
                channels: Vec::new(),
                reading: Reading {
                    time: 0.0,
                    from: 0.0,
                    to: 0.0,
                    nominal: S::zero(),
                    side: S::zero(),
                    is_position: false,
                    roles: [S::zero(); Role::COUNT],
                    signals: &[],
                    past: &NoPast,
                },
            };
            for channel in &attachment.channels {
                let channel =
                    (P::META.channels.get(usize::from(*channel))).ok_or(Unusable::Channel(at))?;
                let Place::Effort(effort) = channel.place else {
                    return Err(Unusable::Channel(at));
                };
                let mut reads = Vec::new();
                for role in meta.reads {
                    let name = channel.read(*role).ok_or(Unusable::Channel(at))?;
                    let place = find::<P, NX, NU, NW, NP, NY>(name).ok_or(Unusable::Reads(at))?;
                    reads
                        .push((*role, place))
                        .map_err(|_| Unusable::Reads(at))?;
                }
                let side = S::of(f64::from(channel.side));
                let place = At {
                    effort,
                    side,
                    reads,
                };
                let full = |_| Unusable::Effect(at);
                acting.channels.push(place).map_err(full)?;
            }
            let full = |_| Unusable::Effect(at);
            efforts.effects.push(acting).map_err(full)?;
        }
        Ok(efforts)
    }

    /// The efforts where the controlled states are `y`.
    #[inline(always)]
    pub fn at<P, const NU: usize, const NW: usize, const NP: usize, const NY: usize>(
        &mut self,
        y: &[S; NU],
        p: &[S; NP],
    ) -> [S; NW]
    where
        P: Plant<NX, NU, NW, NP, NY>,
    {
        let mut w = [S::zero(); NW];
        if self.effects.is_empty() {
            return w;
        }
        let mut x = [S::zero(); NX];
        for (state, value) in self.controlled.iter().zip(y) {
            x[*state] = *value;
        }
        for acting in &mut self.effects {
            let reading = &mut acting.reading;
            for at in &acting.channels {
                for (role, place) in &at.reads {
                    reading.roles[*role as usize] = match *place {
                        Where::State(i) => x[i],
                        Where::Output(i) => output::<S, P, NX, NU, NW, NP, NY>(i, &x, p),
                    };
                }
                let effort = &mut w[at.effort];
                (reading.nominal, reading.side) = (*effort, at.side);
                *effort += acting.known.contribution(reading, &acting.values);
            }
        }
        w
    }
}

/// An output that reads no inputs. Not inlined: a compiler would work out all of them.
#[inline(never)]
fn output<
    S,
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
>(
    index: usize,
    x: &[S; NX],
    p: &[S; NP],
) -> S
where
    S: Real,
    P: Plant<NX, NU, NW, NP, NY>,
{
    P::output(index, x, &[S::zero(); NU], p)
}

/// The signal `name`, where it follows from the controlled states alone: everything else is not known
/// aboard. Found by moving the rest.
fn find<P, const NX: usize, const NU: usize, const NW: usize, const NP: usize, const NY: usize>(
    name: &str,
) -> Option<Where>
where
    P: Plant<NX, NU, NW, NP, NY>,
{
    let controlled = P::META.controlled;
    if let Some(i) = P::META.states.iter().position(|s| s.id == name) {
        return controlled.contains(&i).then_some(Where::State(i));
    }
    let i = P::META.outputs.iter().position(|s| s.id == name)?;
    let p: [f64; NP] = core::array::from_fn(|j| 0.7 + 0.1 * j as f64);
    let at = |rest: f64| {
        let x = core::array::from_fn(|j| if controlled.contains(&j) { 0.3 } else { rest });
        P::output(i, &x, &[rest; NU], &p)
    };
    (at(0.0) == at(1.0) && at(0.0) == at(-0.6)).then_some(Where::Output(i))
}
