//! What the effects of a model add to the efforts of its plant.

use heapless::Vec;
use loopsight_core::{NoPast, Physics, Place, Plant, Reading, Real, Role};
use loopsight_link::{Attachment, CHANNELS, EFFECTS, PARAMETERS, Unusable};

use crate::effects::effect;

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
    bounds: Vec<Bound<S>, { EFFECTS * CHANNELS }>,
    values: Vec<Vec<S, PARAMETERS>, EFFECTS>,
    /// Which state of the plant is the `i`-th controlled one.
    controlled: &'static [usize],
}

/// One effect at one of its channels.
#[derive(Clone)]
struct Bound<S: 'static> {
    physics: &'static dyn Physics<S>,
    effect: usize,
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
            bounds: Vec::new(),
            values: Vec::new(),
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
            let (meta, physics) = effect::<S>(&attachment.id).ok_or(Unusable::Effect(at))?;
            let finite = attachment.values.iter().all(|v| v.is_finite());
            if meta.parameters.len() != attachment.values.len() || !finite {
                return Err(Unusable::Effect(at));
            }
            let values = attachment.values.iter().map(|v| S::of(f64::from(*v)));
            let full = |_| Unusable::Effect(at);
            efforts
                .values
                .push(values.collect())
                .map_err(|_| Unusable::Effect(at))?;
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
                let bound = Bound {
                    physics,
                    effect: index,
                    effort,
                    side: S::of(f64::from(channel.side)),
                    reads,
                };
                efforts.bounds.push(bound).map_err(|b| full(b.effect))?;
            }
        }
        Ok(efforts)
    }

    /// The efforts where the controlled states are `y`.
    #[inline]
    pub fn at<P, const NU: usize, const NW: usize, const NP: usize, const NY: usize>(
        &self,
        y: &[S; NU],
        p: &[S; NP],
    ) -> [S; NW]
    where
        P: Plant<NX, NU, NW, NP, NY>,
    {
        let mut w = [S::zero(); NW];
        if self.bounds.is_empty() {
            return w;
        }
        let mut x = [S::zero(); NX];
        for (state, value) in self.controlled.iter().zip(y) {
            x[*state] = *value;
        }
        let u = [S::zero(); NU];
        for bound in &self.bounds {
            let mut roles = [S::zero(); Role::COUNT];
            for (role, place) in &bound.reads {
                roles[*role as usize] = match *place {
                    Where::State(i) => x[i],
                    Where::Output(i) => P::output(i, &x, &u, p),
                };
            }
            let reading = Reading {
                time: 0.0,
                from: 0.0,
                to: 0.0,
                nominal: w[bound.effort],
                side: bound.side,
                is_position: false,
                roles,
                signals: &[],
                past: &NoPast,
            };
            let values = self.values[bound.effect].as_slice();
            w[bound.effort] += bound.physics.contribution(&reading, &[], values);
        }
        w
    }
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
