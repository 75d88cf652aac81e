//! The effects that a robot can compensate, by their identifiers.

use loopsight_core::{Effect, EffectMeta, Physics, Reading, Real};
use loopsight_link::PARAMETERS;
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

            /// What it adds to its channel with the parameters `p`, in the channel's unit. `nominal` and
            /// `side` are those of a [`Reading`], `signal` is what it reads there, in its order.
            #[inline(always)]
            pub(crate) fn contribution<S: Real>(
                self,
                nominal: S,
                side: S,
                signal: impl Fn(usize) -> S,
                p: &[S; PARAMETERS],
            ) -> S {
                match self {
                    $(Known::$effect => {
                        let meta = &$effect::META;
                        let read: [S; READS] = core::array::from_fn(|k| match meta.reads.get(k) {
                            Some(_) => signal(k),
                            None => S::zero(),
                        });
                        let nothing = Reading {
                            nominal,
                            side,
                            ..Reading::nothing()
                        };
                        let reads = meta.reads.iter().zip(&read);
                        let reading =
                            reads.fold(nothing, |at, (role, signal)| at.with(*role, signal));
                        let p = &p[..meta.parameters.len()];
                        Physics::contribution(&$effect, &reading, &[], p)
                    })+
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

/// Most signals that one of them reads at a channel.
pub(crate) const READS: usize = {
    let (mut most, mut k) = (0, 0);
    while k < Known::ALL.len() {
        let reads = Known::ALL[k].meta().reads.len();
        if reads > most {
            most = reads;
        }
        k += 1;
    }
    most
};

impl Known {
    /// The effect `id`, where it is known aboard.
    pub fn named(id: &str) -> Option<Self> {
        (Self::ALL.iter().copied()).find(|known| known.meta().id == id)
    }
}
