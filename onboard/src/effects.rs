//! The effects that a robot can compensate, by their identifiers.

use loopsight_core::{Effect, EffectMeta, Physics, Real};
use loopsight_plants::effects::{
    ConstantForce, CoulombFriction, DirectionalFriction, QuadraticDrag, ScrubFriction,
    StribeckFriction, ViscousFriction,
};

/// What an effect declares, and how it acts.
type Known<S> = (&'static EffectMeta, &'static dyn Physics<S>);

/// The effect `id`, where this library has it aboard: those that act at once, as forces, and read
/// nothing but how their channel moves.
///
/// There is no registry without `std`, so what a robot knows is written down here.
pub fn effect<S: Real>(id: &str) -> Option<Known<S>> {
    let known: [Known<S>; 7] = [
        (&ConstantForce::META, &ConstantForce),
        (&CoulombFriction::META, &CoulombFriction),
        (&DirectionalFriction::META, &DirectionalFriction),
        (&QuadraticDrag::META, &QuadraticDrag),
        (&ScrubFriction::META, &ScrubFriction),
        (&StribeckFriction::META, &StribeckFriction),
        (&ViscousFriction::META, &ViscousFriction),
    ];
    known.into_iter().find(|(meta, _)| meta.id == id)
}
