//! A vessel that runs over.

use crate::declare_effect;
use loopsight_core::{Effect, EffectMeta, End, Parameter, PlaceKind, Reading, Real, Role, Shows};

/// Overflow: what stands above the edge of a vessel runs over it, and is lost.
///
/// ```text
/// w = -2/3 √(2 g) · edge · (head - limit)^(3/2)   where head > limit, else 0
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `head` | level of the liquid | m |
/// | `limit` | height of the edge over the outlet | m |
/// | `edge` | length of the edge over the area of the vessel, discharge coefficient included | 1/m |
/// | `g` | 9.80665 | m/s² |
///
/// This is the law of a weir: the liquid stands a little above the edge, and the higher the more runs over it. A tank of
/// 0.02 m² whose whole rim runs over has an `edge` of some 15 1/m, and of 0.1 l/s the last 2 mm show.
///
/// The most that is taken, 1000 1/m, is the rim of a pipe of 4 mm. A fit of a model that lacks something else makes the edge
/// as sharp as it may, and beyond that its derivatives have no end.
///
/// Assumptions: what runs over is lost to the plant. Of two tanks one above the other a part may fall into the lower
/// one: that is an effect of one's own there (`[effect.expression]` at `tank.lower`). The edge is level, and liquid over
/// it comes to it slowly.
///
/// One inflow that runs over shows one level above the edge. `limit` and `edge` are told apart by inflows of several sizes
/// only: of two levels of a pump either may be off, by as much as the sensor's resolution hides.
///
/// References: G. Poleni (1717), "De motu aquae mixto"; M. C. Potter, D. C. Wiggert (2002), "Mechanics of Fluids", 3rd
/// edition, section 10.4, sharp-crested weirs; M. Schoukens, J. P. Noël (2017), "Three benchmarks addressing open
/// challenges in nonlinear system identification", IFAC PapersOnLine 50-1, 446–451, section 3 (tanks that overflow).
#[derive(Clone, Copy, Debug)]
pub struct Overflow;

/// `2/3 √(2 g)`, √m/s.
const WEIR: f64 = 2.952_460;

impl Effect for Overflow {
    const META: EffectMeta = EffectMeta {
        id: "overflow",
        summary: "a vessel that runs over: what stands above its edge is lost",
        symptom: "the level rises to one height and stays there while more flows in, and the model's rises on; afterwards the model has too much for as long as the vessel takes to empty",
        remedy: "keep the level below the edge: limit the inflow by the level; a higher vessel, or an overflow that leads back",
        equation: "w = -2/3 sqrt(2 g) edge (head - limit)^(3/2) where head > limit, else 0",
        reference: "Potter, Wiggert (2002), Mechanics of Fluids, 3rd ed., section 10.4 (weirs); Schoukens, Noël (2017), IFAC PapersOnLine 50-1, 446-451, section 3",
        example: "[[effect]]\n[effect.overflow]\nat = [\"tank.upper\"]\nlimit = 0.25\nedge = 15.0\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Head],
        // An outlet is no vessel.
        yields_to: &[Role::Flow],
        parameters: &[
            Parameter::new("limit", "h_e", "head", "height of the edge over the outlet")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .nonlinear()
                .scaled(0.02)
                .limiting(End::Upper),
            Parameter::new(
                "edge",
                "b_e",
                "1/head",
                "length of the edge over the area of the vessel",
            )
            .within(0.0, 1000.0)
            .or(0.0)
            .scaled(0.5),
        ],
        shows: Shows::AtEnd,
        rarity: 1,
        max_step_s: 0.0025,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        let over = at.get(Role::Head) - p[0];
        if over <= S::zero() {
            return S::zero();
        }
        -S::of(WEIR) * p[1] * over * over.sqrt()
    }
}

declare_effect!(Overflow, "overflow");

#[cfg(test)]
mod tests {
    use crate::effects::testing::*;

    use super::*;

    #[test]
    fn runs_over_its_edge_as_a_weir_does() {
        let p = [0.25, 15.0];
        let at = |head| Overflow::contribution(&reading(&[(Role::Head, head)]), &[], &p);
        assert_eq!(at(0.25), 0.0);
        assert_eq!(at(0.1), 0.0);
        let expected = 2.0 / 3.0 * (2.0f64 * 9.806_65).sqrt() * 15.0 * 0.002f64.powf(1.5);
        assert!((at(0.252) / -expected - 1.0).abs() < 1e-6);
    }
}
