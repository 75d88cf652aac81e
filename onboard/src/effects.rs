//! The effects that are compiled into a firmware.

use loopsight_core::{Array, Effect, EffectMeta, Reading, Real, Role, Shows};
use loopsight_link::PARAMETERS;

/// A set of effects that a robot can compensate. Written by [`aboard!`](crate::aboard).
///
/// There is no registry without `std`, so a firmware lists its effects. The set is an enumeration and its
/// evaluation a `match`: what a tick evaluates is compiled into it.
pub trait EffectSet: Copy + Send + Sync + 'static {
    /// One element per signal that an effect reads; as long as the most that one of them reads.
    type Reads<T: Copy + Send>: Array<T> + Copy + Send;

    /// The effect `id`; `None` where it is not in the set.
    fn named(id: &str) -> Option<Self>;

    /// What it declares.
    fn meta(self) -> &'static EffectMeta;

    /// What it adds to its channel with the parameters `p`, in the channel's unit.
    ///
    /// `nominal` and `side` are those of a [`Reading`]. `signal(k)` is the `k`-th signal that it reads.
    fn contribution<S: Real>(
        self,
        nominal: S,
        side: S,
        signal: impl Fn(usize) -> S,
        p: &[S; PARAMETERS],
    ) -> S;
}

/// An effect can be compensated aboard: it acts at once, as a force, and reads speeds only.
///
/// It may have no states, no memory, and no more parameters than a message holds. What changes with the time of a
/// recording ([`Shows::OneRun`]) knows nothing of a loop's.
pub const fn acts_aboard(meta: &EffectMeta) -> bool {
    let mut k = 0;
    while k < meta.reads.len() {
        if !matches!(meta.reads[k], Role::Flow | Role::Forward | Role::Yaw) {
            return false;
        }
        k += 1;
    }
    let mut on_efforts = false;
    k = 0;
    while k < meta.places.len() {
        on_efforts |= matches!(meta.places[k], loopsight_core::PlaceKind::Effort);
        k += 1;
    }
    let timeless = !matches!(meta.shows, Shows::OneRun);
    on_efforts && timeless && !meta.is_dynamic() && meta.parameters.len() <= PARAMETERS
}

/// The most signals that one of these effects reads.
#[doc(hidden)]
pub const fn most_reads(metas: &[&EffectMeta]) -> usize {
    let (mut most, mut k) = (0, 0);
    while k < metas.len() {
        if metas[k].reads.len() > most {
            most = metas[k].reads.len();
        }
        k += 1;
    }
    most
}

/// What the effect `E` adds to its channel; `A` is [`EffectSet::Reads`].
#[doc(hidden)]
#[inline(always)]
pub fn contribution<E: Effect, S: Real, A: Array<S>>(
    nominal: S,
    side: S,
    signal: impl Fn(usize) -> S,
    p: &[S; PARAMETERS],
) -> S {
    let meta = &E::META;
    let read = A::from_fn(|k| match meta.reads.get(k) {
        Some(_) => signal(k),
        None => S::zero(),
    });
    let nothing = Reading {
        nominal,
        side,
        ..Reading::nothing()
    };
    let reads = meta.reads.iter().zip(read.as_ref());
    let reading = reads.fold(nothing, |at, (role, signal)| at.with(*role, signal));
    match E::Parameters::<S>::from_first(p) {
        Some(p) => E::contribution(&reading, &E::State::filled(S::zero()), p),
        None => S::zero(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Parts, Twil};
    use loopsight_plants::effects::*;

    type Library = <Twil as Parts>::Effects;

    #[test]
    fn a_set_knows_its_effects_by_their_ids() {
        let known = Library::named("coulomb_friction").unwrap();
        assert_eq!(known.meta().id, "coulomb_friction");
        assert!(Library::named("backlash").is_none());
    }

    #[test]
    fn what_has_states_or_a_memory_or_reads_a_position_does_not_act_aboard() {
        for meta in [
            &Backlash::META,
            &InputDelay::META,
            &TorqueRipple::META,
            &SensorScale::META,
        ] {
            assert!(!acts_aboard(meta), "{}", meta.id);
        }
    }
}
