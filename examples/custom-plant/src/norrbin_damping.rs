//! What the water does to a hull that turns fast.

use loopsight_core::{Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role};
use loopsight_model::declare_effect;

/// Norrbin's damping: a force against the motion that grows with the cube of the speed.
///
/// ```text
/// w = -cubic · flow³
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `flow` | speed at the channel; at a hull the yaw rate | e.g. rad/s |
/// | `cubic` | damping per cubed speed | that of the channel over that of the flow cubed |
///
/// A ship turns less than its rudder angle promises: twice the rudder is not twice the turn.
///
/// Assumptions: the same to both sides, no delay between the turn and the flow around the hull.
///
/// Reference: N. H. Norrbin (1963), "On the design and analysis of the zig-zag test on base of
/// quasi-linear frequency response", Swedish State Shipbuilding Experimental Tank, Göteborg.
#[derive(Clone, Copy, Debug)]
pub struct NorrbinDamping;

impl Effect for NorrbinDamping {
    const META: EffectMeta = EffectMeta {
        id: "norrbin_damping",
        summary: "damping of a hull that grows with the cube of the yaw rate",
        symptom: "slow turns are right, fast turns are slower than the model's, by a share that grows with the square of the rate",
        remedy: "feed the damping forward; ask the controller for turns that the rudder can hold",
        equation: "w = -cubic flow^3",
        reference: "Norrbin (1963), On the design and analysis of the zig-zag test on base of quasi-linear frequency response",
        example: "[[effect]]\n[effect.norrbin_damping]\nat = [\"hull\"]\ncubic = 4.0\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow],
        parameters: &[
            Parameter::new("cubic", "n", "channel/flow^3", "damping per cubed speed")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .scaled(1e-4),
        ],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        let flow = at.get(Role::Flow);
        -p[0] * flow * flow * flow
    }
}

declare_effect!(NorrbinDamping, "norrbin_damping");

#[cfg(test)]
mod tests {
    use super::*;

    fn at_rate(flow: f64) -> f64 {
        let reading = Reading::nothing().with(Role::Flow, &flow);
        NorrbinDamping::contribution(&reading, &[], &[4.0])
    }

    #[test]
    fn opposes_the_turn_and_grows_eightfold_with_twice_the_rate() {
        assert_eq!(at_rate(0.5), -0.5);
        assert_eq!(at_rate(-1.0), 4.0);
    }
}
