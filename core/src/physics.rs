//! Effects behind one interface for any of them, and how an effect gets there.

use core::ops::Range;

use crate::{NoPast, Reading, Real, Role};

/// One channel that an effect without memory acts at.
#[derive(Clone, Debug)]
pub struct Spot {
    /// Where what it adds goes: the index of the input, the effort or the state's rate.
    pub to: usize,
    /// See [`Reading::side`].
    pub side: f64,
    /// See [`Reading::is_position`].
    pub is_position: bool,
    /// See [`Reading::reads`].
    pub reads: [Option<usize>; Role::COUNT],
    /// Its states among [`Now::z`].
    pub z: Range<usize>,
    /// See [`Reading::shortest`].
    pub shortest: f64,
}

/// What effects are evaluated with at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Now<'a, S> {
    /// Time since the start of the run, s.
    pub time: f64,
    /// All signals of the plant: states, inputs, outputs.
    pub signals: &'a [S],
    /// States of effects.
    pub z: &'a [S],
}

/// The object-safe view of an effect for one scalar, on slices. Made by
/// [`declare_effect!`](crate::declare_effect); a call with wrong lengths contributes zero.
pub trait Physics<S: Real>: Send + Sync {
    /// See [`Effect::contribution`](crate::Effect::contribution).
    fn contribution(&self, at: &Reading<'_, S>, z: &[S], p: &[S]) -> S;
    /// See [`Effect::state_derivative`](crate::Effect::state_derivative).
    fn state_derivative(&self, at: &Reading<'_, S>, z: &[S], p: &[S], dz: &mut [S]);
    /// See [`Effect::initial_state`](crate::Effect::initial_state).
    fn initial_state(&self, at: &Reading<'_, S>, p: &[S], z: &mut [S]);
    /// See [`Effect::confine`](crate::Effect::confine).
    fn confine(&self, z: &mut [S], p: &[S]) {
        let _ = (z, p);
    }
    /// Adds to `to` what the effect contributes at each of the `spots`, one after another, and puts the rates of its
    /// states there into `dz`: all channels in one call.
    fn act(&self, spots: &[Spot], now: &Now<'_, S>, p: &[S], to: &mut [S], dz: &mut [S]) {
        for spot in spots {
            let (Some(to), Some(z)) = (to.get_mut(spot.to), now.z.get(spot.z.clone())) else {
                continue;
            };
            let at = Reading {
                time: now.time,
                from: now.time,
                to: now.time,
                nominal: *to,
                side: S::of(spot.side),
                is_position: spot.is_position,
                roles: [None; Role::COUNT],
                reads: Some(&spot.reads),
                signals: now.signals,
                shortest: spot.shortest,
                past: &NoPast,
            };
            if let (false, Some(dz)) = (z.is_empty(), dz.get_mut(spot.z.clone())) {
                self.state_derivative(&at, z, p, dz);
            }
            *to += self.contribution(&at, z, p);
        }
    }
}

/// Makes an [`Effect`](crate::Effect) available behind [`Physics`].
///
/// The sizes are those of [`Effect::META`](crate::Effect::META); an effect written for others does not compile. Nor does an id
/// that is not the one in `META`.
///
/// The macro of the same name in `loopsight-model` does this and adds the effect to the registry. A crate
/// that builds with and without `std` chooses between the two once, in its `lib.rs`.
///
/// [`Effect`](crate::Effect) has an example.
#[macro_export]
macro_rules! declare_effect {
    ($effect:ident, $id:literal) => {
        const _: () = assert!(
            $crate::__private::same_text(<$effect as $crate::Effect>::META.id, $id),
            "the id of the effect differs from that of its EffectMeta"
        );

        impl $crate::EffectArrays for $effect {
            type State<T: Copy + Send> = [T; <$effect as $crate::Effect>::META.states];
            type Parameters<T: Copy + Send> =
                [T; <$effect as $crate::Effect>::META.parameters.len()];
        }

        impl<S: $crate::Real> $crate::Physics<S> for $effect {
            #[inline(always)]
            fn contribution(&self, at: &$crate::Reading<'_, S>, z: &[S], p: &[S]) -> S {
                let (Ok(z), Ok(p)) = (z.try_into(), p.try_into()) else {
                    return S::of(0.0);
                };
                <$effect as $crate::Effect>::contribution::<S>(at, z, p)
            }
            fn state_derivative(
                &self,
                at: &$crate::Reading<'_, S>,
                z: &[S],
                p: &[S],
                dz: &mut [S],
            ) {
                let (Ok(z), Ok(p)) = (z.try_into(), p.try_into()) else {
                    return;
                };
                let rate = <$effect as $crate::Effect>::state_derivative::<S>(at, z, p);
                for (to, from) in dz.iter_mut().zip(rate) {
                    *to = from;
                }
            }
            fn initial_state(&self, at: &$crate::Reading<'_, S>, p: &[S], z: &mut [S]) {
                let Ok(p) = p.try_into() else {
                    return;
                };
                let state = <$effect as $crate::Effect>::initial_state::<S>(at, p);
                for (to, from) in z.iter_mut().zip(state) {
                    *to = from;
                }
            }
            fn confine(&self, z: &mut [S], p: &[S]) {
                let (Ok(from), Ok(p)) = ((&*z).try_into(), p.try_into()) else {
                    return;
                };
                let state = <$effect as $crate::Effect>::confine::<S>(from, p);
                for (to, from) in z.iter_mut().zip(state) {
                    *to = from;
                }
            }
        }
    };
}
