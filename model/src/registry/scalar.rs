//! The scalars that composed models run with on a host.

use loopsight_core::{Dynamics, Physics, Real};

use crate::dual::died_out;
use crate::{Dual, NarrowDual, TinyDual};

/// A scalar that composed models are run with on a host.
pub trait HostReal: Real {
    /// The plant for this scalar.
    fn dynamics(any: &'static dyn AnyDynamics) -> &'static dyn Dynamics<Self>;
    /// The effect for this scalar.
    fn physics(any: &'static dyn AnyPhysics) -> &'static dyn Physics<Self>;
    /// The number with zero for a value, and for each derivative, that is below 1.5e-154: its square is no normal number.
    fn settled(self) -> Self;
}

macro_rules! host_real {
    ($($scalar:ty: $settled:expr),*) => {$(
        impl HostReal for $scalar {
            fn dynamics(any: &'static dyn AnyDynamics) -> &'static dyn Dynamics<Self> {
                any
            }
            fn physics(any: &'static dyn AnyPhysics) -> &'static dyn Physics<Self> {
                any
            }
            #[inline(always)]
            fn settled(self) -> Self {
                $settled(self)
            }
        }
    )*};
}
host_real!(
    // Single precision is for loops in real time, whose ticks are few.
    f32: core::convert::identity,
    f64: died_out,
    Dual: Dual::settled,
    NarrowDual: NarrowDual::settled,
    TinyDual: TinyDual::settled
);

macro_rules! for_every_scalar {
    ($(#[doc = $doc:literal])+ $name:ident of $part:ident: $first:ty $(, $scalar:ty)*) => {
        $(#[doc = $doc])+
        pub trait $name: $part<$first> $(+ $part<$scalar>)* {}
        impl<T: $part<$first> $(+ $part<$scalar>)*> $name for T {}
    };
}
for_every_scalar!(
    /// A plant for every scalar a host uses.
    AnyDynamics of Dynamics: f32, f64, Dual, NarrowDual, TinyDual
);
for_every_scalar!(
    /// An effect for every scalar a host uses.
    AnyPhysics of Physics: f32, f64, Dual, NarrowDual, TinyDual
);
