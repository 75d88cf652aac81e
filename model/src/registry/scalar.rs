//! The scalars that composed models run with on a host.

use loopsight_core::{Dynamics, Physics, Real};

use crate::{Dual, NarrowDual};

/// A scalar that composed models are run with on a host.
pub trait HostReal: Real {
    /// The plant for this scalar.
    fn dynamics(any: &'static dyn AnyDynamics) -> &'static dyn Dynamics<Self>;
    /// The effect for this scalar.
    fn physics(any: &'static dyn AnyPhysics) -> &'static dyn Physics<Self>;
}

macro_rules! host_real {
    ($($scalar:ty),*) => {$(
        impl HostReal for $scalar {
            fn dynamics(any: &'static dyn AnyDynamics) -> &'static dyn Dynamics<Self> {
                any
            }
            fn physics(any: &'static dyn AnyPhysics) -> &'static dyn Physics<Self> {
                any
            }
        }
    )*};
}
host_real!(f32, f64, Dual, NarrowDual);

/// A plant for every scalar a host uses.
pub trait AnyDynamics:
    Dynamics<f32> + Dynamics<f64> + Dynamics<Dual> + Dynamics<NarrowDual>
{
}
impl<T: Dynamics<f32> + Dynamics<f64> + Dynamics<Dual> + Dynamics<NarrowDual>> AnyDynamics for T {}

/// An effect for every scalar a host uses.
pub trait AnyPhysics: Physics<f32> + Physics<f64> + Physics<Dual> + Physics<NarrowDual> {}
impl<T: Physics<f32> + Physics<f64> + Physics<Dual> + Physics<NarrowDual>> AnyPhysics for T {}
