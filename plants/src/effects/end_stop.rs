//! A joint or slide that runs against a stop that gives.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, End, Parameter, PlaceKind, Reading, Real, Role, Shows};

/// End stops: what runs against one is pushed back, the harder the deeper and the faster it comes.
///
/// ```text
/// w = -stiffness · d (1 + loss · d')    at the upper stop, d = position - upper > 0
/// w = +stiffness · d (1 + loss · d')    at the lower stop, d = lower - position > 0
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `position` | of the joint or slide at the channel | e.g. rad |
/// | `d`, `d'` | how deep it is in the stop, and how fast it goes deeper | that of the position, that of the flow |
/// | `lower`, `upper` | where the stops begin; one that the file does not give is not there | that of the position |
/// | `stiffness` | force per depth of a stop that is pressed slowly | that of the channel over that of the position |
/// | `loss` | share by which the force is larger per speed going in, and smaller coming out | one over that of the flow, e.g. s/rad |
///
/// A stop pushes and never pulls: what leaves faster than `1/loss` leaves the stop behind. What comes in with a small
/// speed `v` leaves with `v (1 - 2/3 loss · v)`, whatever its mass and the stiffness are; with any speed, `v₁` in and `v₂`
/// out,
///
/// ```text
/// v₁ - ln(1 + loss v₁)/loss = -v₂ - ln(1 - loss v₂)/loss
/// ```
///
/// A damper beside a spring would strike with a force at the first touch, and pull at the last; this force begins and ends
/// at zero.
///
/// Assumptions: both stops are alike; rubber, or metal that bends, whose force grows in proportion to the depth. A vehicle
/// has no such place: what rolls on meets walls, not stops.
///
/// References: K. H. Hunt, F. R. E. Crossley (1975), "Coefficient of restitution interpreted as damping in vibroimpact",
/// Journal of Applied Mechanics 42(2), 440–445: the force `λ xⁿ x' + k xⁿ` with `n = 1`. Their coefficient of restitution
/// `1 - α v` comes from `λ = 3/2 α k`, so `loss = 3/2 α`.
#[derive(Clone, Copy, Debug)]
pub struct EndStop;

/// Where a stop is that is not there, in sizes of the position.
const FAR: f64 = 1e6;

impl Effect for EndStop {
    const META: EffectMeta = EffectMeta {
        id: "end_stop",
        summary: "a stop at an end of the way, which gives a little and throws back",
        symptom: "the position comes to one value and stays there, or turns round at once, while the model's goes on; inside the range the model is right",
        remedy: "keep the reference within the stops; slow down before them; a softer or better damped buffer",
        equation: "w = -stiffness d (1 + loss d') where d = position - upper > 0, w = stiffness d (1 + loss d') where d = lower - position > 0; it never pulls",
        reference: "Hunt, Crossley (1975), Coefficient of restitution interpreted as damping in vibroimpact, J. Applied Mechanics 42(2), 440-445",
        example: "[[effect]]\n[effect.end_stop]\nat = [\"shaft\"]\nlower = -1.5\nupper = 2.0\nstiffness = 60.0\nloss = 0.4\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow, Role::Position],
        // What rolls on has no stops.
        yields_to: &[Role::Heading],
        parameters: &[
            Parameter::new(
                "lower",
                "q_l",
                "position",
                "where the lower stop begins; far away where there is none",
            )
            .or(-FAR)
            .nonlinear()
            .scaled(0.05)
            .limiting(End::Lower),
            Parameter::new(
                "upper",
                "q_u",
                "position",
                "where the upper stop begins; far away where there is none",
            )
            .or(FAR)
            .nonlinear()
            .scaled(0.05)
            .limiting(End::Upper),
            Parameter::new(
                "stiffness",
                "k_s",
                "channel/position",
                "force per depth of a stop that is pressed slowly",
            )
            .within(0.0, f64::INFINITY)
            .or(0.0)
            .scaled(5.0),
            Parameter::new(
                "loss",
                "c_s",
                "1/flow",
                "share by which a stop pushes harder per speed of what comes in",
            )
            .within(0.0, f64::INFINITY)
            .or(0.0)
            .nonlinear()
            .scaled(0.1)
            .starting_at(&[0.3]),
        ],
        shows: Shows::AtEnd,
        rarity: 1,
        max_step_s: 0.001,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 4]) -> S {
        let [lower, upper, stiffness, loss] = *p;
        let (position, flow) = (at.get(Role::Position), at.get(Role::Flow));
        let push = |depth: S, deeper: S| {
            let share = S::one() + loss * deeper;
            let touches = depth > S::zero() && share > S::zero();
            if touches {
                stiffness * depth * share
            } else {
                S::zero()
            }
        };
        push(lower - position, -flow) - push(position - upper, flow)
    }
}

declare_effect!(EndStop, "end_stop");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    const P: [f64; 4] = [-1.5, 2.0, 60.0, 0.4];

    fn force(position: f64, flow: f64) -> f64 {
        let at = reading(&[(Role::Position, position), (Role::Flow, flow)]);
        EndStop::contribution(&at, &[], &P)
    }

    #[test]
    fn pushes_back_into_the_range_and_never_pulls() {
        assert_eq!(force(1.9, 3.0), 0.0);
        assert_eq!(force(-1.4, -3.0), 0.0);
        assert!((force(2.1, 0.0) + 6.0).abs() < 1e-12);
        assert!((force(-1.7, 0.0) - 12.0).abs() < 1e-12);
        // Harder for what comes in.
        assert!((force(2.1, 2.0) + 6.0 * 1.8).abs() < 1e-12);
        assert!((force(-1.7, -2.0) - 12.0 * 1.8).abs() < 1e-12);
        // And not at all for what leaves faster than the stop follows.
        assert_eq!(force(2.1, -2.6), 0.0);
        assert_eq!(force(-1.7, 2.6), 0.0);
    }

    #[test]
    fn a_stop_that_is_not_given_is_not_there() {
        let [lower, upper] = [0, 1].map(|i| EndStop::META.parameters[i].default);
        let p = [lower.unwrap(), upper.unwrap(), 60.0, 0.4];
        let at = |position: f64| {
            let at = reading(&[(Role::Position, position), (Role::Flow, 1.0)]);
            EndStop::contribution(&at, &[], &p)
        };
        assert!([-1e4, 0.0, 1e4].iter().all(|x| at(*x) == 0.0));
    }

    /// Speed with which a mass leaves the upper stop that came in with `v`.
    fn thrown_back(mass: f64, v: f64) -> f64 {
        const H: f64 = 1e-6;
        let (mut x, mut speed) = (P[1], v);
        while x >= P[1] {
            let middle = speed + 0.5 * H * force(x, speed) / mass;
            let way = x + 0.5 * H * speed;
            speed += H * force(way, middle) / mass;
            x += H * middle;
        }
        -speed
    }

    /// The speeds before and after, from `v dv = -k/m d (1 + c v) dd`: neither mass nor stiffness is in them.
    #[test]
    fn throws_back_as_hunt_and_crossley_say() {
        let loss = P[3];
        let of = |v: f64| v / loss - (loss * v).ln_1p() / (loss * loss);
        for (mass, v) in [(1.0, 0.5), (1.0, 3.0), (5.0, 3.0)] {
            let out = thrown_back(mass, v);
            assert!((of(v) - of(-out)).abs() < 1e-4 * of(v), "{v}: {out}");
        }
        let slow = 0.1;
        let restitution = 1.0 - 2.0 / 3.0 * loss * slow;
        assert!((thrown_back(1.0, slow) / slow - restitution).abs() < 2e-3);
    }
}
