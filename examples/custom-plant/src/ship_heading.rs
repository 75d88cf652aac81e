//! A ship that is steered with its rudder.

use loopsight_core::{
    Channel, Parameter, Parameterization, Place, Plant, PlantMeta, Reads, Real, Role, Signal,
};
use loopsight_model::declare_plant;

/// The heading of a ship at constant speed.
///
/// ```text
/// r' = -d r + c δ + w        ψ' = r
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `r`, `ψ` | yaw rate and heading, positive to starboard | rad/s, rad |
/// | `δ` | rudder angle, positive turns to starboard | rad |
/// | `d` | damping of the turn | 1/s |
/// | `c` | effectiveness of the rudder | 1/s² |
/// | `w` | yaw acceleration that effects add | rad/s² |
///
/// From the gain `K` and the time constant `T` of a turning test, `T r' + r = K δ`:
///
/// ```text
/// d = 1/T        c = K/T
/// ```
///
/// Assumptions: constant speed, small drift angle, a ship that comes to rest in yaw by itself.
///
/// Reference: K. Nomoto, T. Taguchi, K. Honda, S. Hirano (1957), "On the steering qualities of
/// ships", International Shipbuilding Progress 4(35), 354–370.
#[derive(Clone, Copy, Debug)]
pub struct ShipHeading;

const PARAMETERS: [Parameter; 2] = [
    Parameter::new("damping", "d", "1/s", "damping of the turn by the hull")
        .within(0.0, f64::INFINITY)
        .scaled(0.1),
    Parameter::new(
        "effectiveness",
        "c",
        "1/s^2",
        "yaw acceleration per rudder angle",
    )
    .scaled(0.1),
];

const NOMOTO: [Parameter; 2] = [
    Parameter::new("gain", "K", "1/s", "yaw rate per rudder angle, in the end").scaled(0.1),
    Parameter::new("time_constant", "T", "s", "time constant of the yaw rate")
        .above(0.0)
        .nonlinear(),
];

/// What an effect finds where the rudder and the hull turn the ship.
const STEERING: [Reads; 2] = [Reads(Role::Flow, "yaw_rate"), Reads(Role::Drive, "rudder")];

const CHANNELS: [Channel; 5] = [
    Channel {
        id: "hull",
        place: Place::Effort(0),
        unit: "rad/s^2",
        equation: "r' -> r' + w",
        reads: &STEERING,
        side: 0,
        size: 0.01,
        doc: "the hull in the water; efforts as yaw acceleration",
    },
    Channel {
        id: "inertia",
        place: Place::Rate(0),
        unit: "rad/s^2",
        equation: "r' -> r' + w(r')",
        reads: &STEERING,
        side: 0,
        size: 0.01,
        doc: "the yaw acceleration itself: where the mass acts",
    },
    Channel {
        id: "rudder",
        place: Place::Input(0),
        unit: "rad",
        equation: "δ -> δ + w(δ)",
        reads: &STEERING,
        side: 0,
        size: 0.05,
        doc: "between the commanded rudder angle and the rudder",
    },
    Channel {
        id: "gyro",
        place: Place::Output(0),
        unit: "rad/s",
        equation: "r_measured = r + w",
        reads: &STEERING,
        side: 0,
        size: 0.01,
        doc: "measurement of the yaw rate",
    },
    Channel {
        id: "compass",
        place: Place::Output(1),
        unit: "rad",
        equation: "ψ_measured = ψ + w",
        reads: &STEERING,
        side: 0,
        size: 0.05,
        doc: "measurement of the heading",
    },
];

impl Plant for ShipHeading {
    const META: PlantMeta = PlantMeta {
        id: "ship_heading",
        summary: "a ship at constant speed, steered with its rudder",
        equation: "r' = -d r + c δ;  ψ' = r",
        reference: "Nomoto, Taguchi, Honda, Hirano (1957), International Shipbuilding Progress 4(35), 354-370",
        assumptions: "constant speed, small drift angle, stable on a straight course",
        example: "[plant.ship_heading]\ndamping = 0.5\neffectiveness = 0.25\n",
        states: &[
            Signal::new("yaw_rate", "r", "rad/s", "yaw rate, positive to starboard").sized(0.01),
            Signal::new("heading", "ψ", "rad", "heading, positive to starboard").sized(0.05),
        ],
        inputs: &[Signal::new("rudder", "δ", "rad", "angle of the rudder").sized(0.05)],
        outputs: &[],
        integrals: &[("yaw_rate", "heading")],
        channels: &CHANNELS,
        parameters: &PARAMETERS,
        parameterizations: &[Parameterization {
            id: "nomoto",
            summary: "gain and time constant, as a turning test gives them",
            parameters: &NOMOTO,
        }],
        controlled: &[0],
    };

    fn derivative<S: Real>(x: &[S; 2], u: &[S; 1], w: &[S; 1], p: &[S; 2]) -> [S; 2] {
        let ([yaw_rate, _heading], [rudder]) = (*x, *u);
        let [damping, effectiveness] = *p;
        [effectiveness * rudder - damping * yaw_rate + w[0], yaw_rate]
    }

    fn output<S: Real>(_index: usize, _x: &[S; 2], _u: &[S; 1], _p: &[S; 2]) -> S {
        S::zero()
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 2]> {
        match (set, from) {
            (0, &[gain, time_constant]) => Some([S::one() / time_constant, gain / time_constant]),
            _ => None,
        }
    }
}

declare_plant!(ShipHeading, "ship_heading");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_rudder_turns_the_ship_as_the_turning_test_says() {
        let (gain, time_constant, rudder) = (0.5, 2.0, 0.3);
        let p = ShipHeading::lower(0, &[gain, time_constant]).unwrap();
        let rate = |r: f64| ShipHeading::derivative(&[r, 1.0], &[rudder], &[0.0], &p);
        // At first all of the rudder accelerates, in the end all of it holds the turn.
        assert!((rate(0.0)[0] - gain * rudder / time_constant).abs() < 1e-15);
        assert!(rate(gain * rudder)[0].abs() < 1e-15);
        assert_eq!(rate(0.125)[1], 0.125);
        assert!(ShipHeading::lower(1, &[gain, time_constant]).is_none());
    }
}
