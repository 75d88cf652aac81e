//! The effects that a robot can compensate, by their identifiers.

use loopsight_core::{Effect, EffectMeta, Physics, Reading, Real};
use loopsight_plants::effects::{
    ConstantForce, CoulombFriction, DirectionalFriction, QuadraticDrag, ScrubFriction,
    StribeckFriction, ViscousFriction,
};

/// Writes the effects down once; a `match` instead of a table of functions, so that what a tick evaluates is
/// compiled into it.
macro_rules! aboard {
    ($($effect:ident),+) => {
        /// An effect that this library has aboard: one of those that act at once, as forces, and read nothing
        /// but how their channel moves.
        ///
        /// There is no registry without `std`, so what a robot knows is written down here.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum Known {
            $(#[doc = concat!("See [`", stringify!($effect), "`].")] $effect,)+
        }

        impl Known {
            /// All of them.
            const ALL: &[Known] = &[$(Known::$effect),+];

            /// What it declares.
            pub const fn meta(self) -> &'static EffectMeta {
                match self {
                    $(Known::$effect => &$effect::META,)+
                }
            }

            /// What it adds to its channel with the parameters `p`, in the channel's unit.
            #[inline]
            pub fn contribution<S: Real>(self, at: &Reading<'_, S>, p: &[S]) -> S {
                match self {
                    $(Known::$effect => Physics::contribution(&$effect, at, &[], p),)+
                }
            }
        }
    };
}

aboard!(
    ConstantForce,
    CoulombFriction,
    DirectionalFriction,
    QuadraticDrag,
    ScrubFriction,
    StribeckFriction,
    ViscousFriction
);

impl Known {
    /// The effect `id`, where it is known aboard.
    pub fn named(id: &str) -> Option<Self> {
        (Self::ALL.iter().copied()).find(|known| known.meta().id == id)
    }
}
