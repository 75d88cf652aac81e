//! Effects: physics that can be added to a plant, at its channels.

use crate::{Parameter, PlaceKind, Real, Role};

/// What an effect says about itself.
#[derive(Clone, Copy, Debug)]
pub struct EffectMeta {
    /// Identifier in TOML, e.g. `coulomb_friction`.
    pub id: &'static str,
    /// One sentence: what it is.
    pub summary: &'static str,
    /// What a person sees in the residual when it is missing.
    pub symptom: &'static str,
    /// What can be done about it, in the controller or with a screwdriver.
    pub remedy: &'static str,
    /// The equation in plain text.
    pub equation: &'static str,
    /// Where it comes from: author, year, equation or page.
    pub reference: &'static str,
    /// A TOML entry that adds it.
    pub example: &'static str,
    /// Kinds of places it attaches to.
    pub places: &'static [PlaceKind],
    /// Roles it reads at its channel; a channel that does not offer them all is refused.
    pub reads: &'static [Role],
    /// Channels that offer one of these are refused: they are left to a more specific effect or to
    /// the plant itself.
    pub yields_to: &'static [Role],
    /// It acts oppositely on two sides; a channel without a [`crate::Channel::side`] is refused.
    pub sided: bool,
    /// Its parameters, shared by all the channels of one instance. In their units `channel` stands
    /// for the unit of the channel, `flow` and `position` for those of the signals with these
    /// roles there; such parameters count in sizes, see [`crate::Channel::size`].
    pub parameters: &'static [Parameter],
    /// Acts on all its channels together, as one instance: one supply, one body.
    pub shared_only: bool,
    /// How rare it is: 0 nearly every machine has it, 1 common, 2 rare. Orders explanations that a
    /// recording cannot tell apart.
    pub rarity: u8,
    /// Ids of effects that it contains as special cases: it has to earn its further parameters.
    pub simpler: &'static [&'static str],
    /// States per channel it is attached to.
    pub states: usize,
    /// It looks back in time at its channel, through [`Reading::past`]. Such effects are evaluated
    /// first at their channel, once per integration step.
    pub memory: bool,
    /// Longest integration step that follows its states, s: a model with it takes none longer, whatever
    /// its plant and its file allow.
    pub max_step_s: f64,
}

impl EffectMeta {
    /// Nothing filled in, and nothing special: what most effects write `..EffectMeta::PLAIN` for.
    pub const PLAIN: Self = Self {
        id: "",
        summary: "",
        symptom: "",
        remedy: "",
        equation: "",
        reference: "",
        example: "",
        places: &[],
        reads: &[],
        yields_to: &[],
        sided: false,
        shared_only: false,
        rarity: 1,
        simpler: &[],
        parameters: &[],
        states: 0,
        memory: false,
        max_step_s: f64::INFINITY,
    };
}

/// What an effect sees at one of its channels at one instant.
///
/// For an effect with memory the contribution is one that holds over `from..to`.
#[derive(Clone, Copy)]
pub struct Reading<'a, S> {
    /// Time since the start of the run, s.
    pub time: f64,
    /// Start of the interval over which the contribution holds, s since the start of the run.
    pub from: f64,
    /// End of that interval, s.
    pub to: f64,
    /// The channel's value without this effect: the command on an input, the signal on an output,
    /// the nominal rate on a body channel, the sum of the other efforts on an effort channel.
    pub nominal: S,
    /// `+1`, `-1` or `0`, see [`crate::Channel::side`].
    pub side: S,
    /// The channel's own signal is the one that plays [`Role::Position`]: an angle, not its rate.
    pub is_position: bool,
    /// The signals by role, where the channel binds one and the effect declares it.
    pub roles: [Option<&'a S>; Role::COUNT],
    /// All signals of the plant: states, inputs, outputs. Outputs that nobody asked for may be of
    /// an earlier instant.
    pub signals: &'a [S],
    /// The channel's nominal value in the past.
    pub past: &'a dyn Past<S>,
}

impl<'a, S: Real> Reading<'a, S> {
    /// A reading in which everything is zero, and nothing has a past.
    pub fn nothing() -> Self {
        Self {
            time: 0.0,
            from: 0.0,
            to: 0.0,
            nominal: S::zero(),
            side: S::zero(),
            is_position: false,
            roles: [None; Role::COUNT],
            signals: &[],
            past: &NoPast,
        }
    }

    /// The same with the signal that plays `role`.
    pub fn with(mut self, role: Role, signal: &'a S) -> Self {
        self.roles[role as usize] = Some(signal);
        self
    }

    /// The signal that plays `role` at this channel; zero where the effect does not declare that.
    #[inline(always)]
    pub fn get(&self, role: Role) -> S {
        self.roles[role as usize].copied().unwrap_or_else(S::zero)
    }
}

/// The past of one channel. A reading may be kept, and taken to another thread with whoever keeps it.
pub trait Past<S>: Sync {
    /// Mean of the channel's nominal value between two instants, s since the start of the run.
    ///
    /// Differentiable in both bounds. Before the run began the value is that at its start.
    fn mean(&self, from: S, to: S) -> S;
}

/// For effects without memory: a past that is always zero.
#[derive(Clone, Copy, Debug)]
pub struct NoPast;

impl<S: Real> Past<S> for NoPast {
    fn mean(&self, _from: S, _to: S) -> S {
        S::zero()
    }
}

/// A physical effect, as its author writes it: what it adds to a channel.
///
/// `NP` parameters shared by all channels of an instance, `NZ` states per channel. The value is
/// immutable; parameters and states live outside. Derivatives come from the scalar: a fit calls it
/// with dual numbers, a microcontroller with `f32`.
pub trait Effect<const NP: usize, const NZ: usize>: Sized + Send + Sync + 'static {
    /// Names, places, parameters, equation, symptom, remedy, reference.
    const META: EffectMeta;

    /// What is added to the channel, in the channel's unit.
    fn contribution<S: Real>(at: &Reading<'_, S>, z: &[S; NZ], p: &[S; NP]) -> S;

    /// The rate of the effect's states.
    fn state_derivative<S: Real>(at: &Reading<'_, S>, z: &[S; NZ], p: &[S; NP]) -> [S; NZ] {
        let _ = (at, z, p);
        [S::zero(); NZ]
    }

    /// The states at the start of a run, as if the reading had been constant before.
    fn initial_state<S: Real>(at: &Reading<'_, S>, p: &[S; NP]) -> [S; NZ] {
        let _ = (at, p);
        [S::zero(); NZ]
    }
}

/// The object-safe view of an effect for one scalar, on slices. Made by
/// [`declare_effect!`](crate::declare_effect); a call with wrong lengths contributes zero.
pub trait Physics<S: Real>: Send + Sync {
    /// See [`Effect::contribution`].
    fn contribution(&self, at: &Reading<'_, S>, z: &[S], p: &[S]) -> S;
    /// See [`Effect::state_derivative`].
    fn state_derivative(&self, at: &Reading<'_, S>, z: &[S], p: &[S], dz: &mut [S]);
    /// See [`Effect::initial_state`].
    fn initial_state(&self, at: &Reading<'_, S>, p: &[S], z: &mut [S]);
}

/// Makes an [`Effect`] available behind [`Physics`].
///
/// The macro of the same name in `loopsight-model` does this and adds the effect to the registry, see
/// [`declare_plant!`](crate::declare_plant).
///
/// ```ignore
/// declare_effect!(CoulombFriction, "coulomb_friction", <2, 0>);
/// ```
#[macro_export]
macro_rules! declare_effect {
    ($effect:ident, $id:literal, <$np:literal, $nz:literal>) => {
        const _: () = assert!(
            <$effect as $crate::Effect<$np, $nz>>::META.parameters.len() == $np
                && <$effect as $crate::Effect<$np, $nz>>::META.states == $nz,
            "the sizes of the effect differ from its EffectMeta"
        );

        impl<S: $crate::Real> $crate::Physics<S> for $effect {
            fn contribution(&self, at: &$crate::Reading<'_, S>, z: &[S], p: &[S]) -> S {
                let (Ok(z), Ok(p)) = (z.try_into(), p.try_into()) else {
                    return S::of(0.0);
                };
                <$effect as $crate::Effect<$np, $nz>>::contribution(at, z, p)
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
                let rate: [S; $nz] =
                    <$effect as $crate::Effect<$np, $nz>>::state_derivative(at, z, p);
                for (to, from) in dz.iter_mut().zip(rate) {
                    *to = from;
                }
            }
            fn initial_state(&self, at: &$crate::Reading<'_, S>, p: &[S], z: &mut [S]) {
                let Ok(p) = p.try_into() else {
                    return;
                };
                let state: [S; $nz] = <$effect as $crate::Effect<$np, $nz>>::initial_state(at, p);
                for (to, from) in z.iter_mut().zip(state) {
                    *to = from;
                }
            }
        }
    };
}
