//! A mass on a spring.

use crate::declare_plant;
use loopsight_core::{
    Channel, ControlAffine, Derived, Parameter, Parameterization, Place, Plant, PlantMeta, Reads,
    Real, Role, Signal,
};

/// A mass on a spring with a damper, driven by a force.
///
/// ```text
/// v' = (F + w)/m - (d/m) v - (k/m) q        q' = v
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `q`, `v` | position from rest, velocity | m, m/s |
/// | `F` | force | N |
/// | `w` | effort at the mass, a force | N |
/// | `m`, `d`, `k` | mass, damping, stiffness | kg, N s/m, N/m |
///
/// The parameters of the equations are `k/m`, `d/m` and `1/m`: with force and position measured
/// these three, and no more, are what a recording determines. With `k = 0` it is a slide that a
/// force drives.
///
/// Where the position alone is measured a fit needs a first guess of `k/m`, `(2π f)²` of the resonance:
/// the regressions that other fits start from would need the velocity too.
///
/// Assumptions: one degree of freedom, linear; `cubic_stiffness`, `coulomb_friction` and the like are
/// effects at the mass. `viscous_friction` and `linear_stiffness` there cannot be told from `d`
/// and `k`.
///
/// Reference: J. P. Den Hartog (1956), "Mechanical Vibrations", 4th edition, McGraw-Hill, chapter 2;
/// with a cubic spring it is the Silverbox of T. Wigren, J. Schoukens (2013), "Three free data sets
/// for development and benchmarking in nonlinear system identification", European Control
/// Conference, 2933–2938.
#[derive(Clone, Copy, Debug)]
pub struct Oscillator;

const LUMPED: [Parameter; 3] = [
    Parameter::new(
        "stiffness_per_mass",
        "k/m",
        "1/s^2",
        "stiffness over mass: square of the natural angular frequency",
    )
    .within(0.0, f64::INFINITY),
    Parameter::new("damping_per_mass", "d/m", "1/s", "damping over mass")
        .within(0.0, f64::INFINITY),
    Parameter::new(
        "inverse_mass",
        "1/m",
        "1/kg",
        "acceleration per force, one over the mass",
    ),
];

const PHYSICAL: [Parameter; 3] = [
    Parameter::new("mass", "m", "kg", "the mass that moves")
        .above(0.0)
        .nonlinear(),
    Parameter::new("stiffness", "k", "N/m", "force of the spring per way")
        .within(0.0, f64::INFINITY)
        .nonlinear(),
    Parameter::new("damping", "d", "N s/m", "force of the damper per speed")
        .within(0.0, f64::INFINITY)
        .nonlinear(),
];

const MASS: [Reads; 3] = [
    Reads(Role::Flow, "velocity"),
    Reads(Role::Position, "position"),
    Reads(Role::Drive, "force"),
];

const CHANNELS: [Channel; 5] = [
    Channel {
        id: "mass",
        place: Place::Effort(0),
        unit: "N",
        equation: "F -> F + w",
        reads: &MASS,
        side: 0,
        size: 1.0,
        doc: "the mass; efforts are forces on it",
    },
    Channel {
        id: "inertia",
        place: Place::Rate(0),
        unit: "m/s^2",
        equation: "v' -> v' + w(v')",
        reads: &MASS,
        side: 0,
        size: 1.0,
        doc: "the acceleration itself: where the mass acts",
    },
    Channel {
        id: "input",
        place: Place::Input(0),
        unit: "N",
        equation: "F -> F + w(F)",
        reads: &MASS,
        side: 0,
        size: 1.0,
        doc: "between the commanded and the effective force",
    },
    Channel {
        id: "sensor.velocity",
        place: Place::Output(0),
        unit: "m/s",
        equation: "v_measured = v + w",
        reads: &MASS,
        side: 0,
        size: 1.0,
        doc: "measurement of the velocity",
    },
    Channel {
        id: "sensor.position",
        place: Place::Output(1),
        unit: "m",
        equation: "q_measured = q + w",
        reads: &MASS,
        side: 0,
        size: 1.0,
        doc: "measurement of the position",
    },
];

impl Plant for Oscillator {
    const META: PlantMeta = PlantMeta {
        id: "oscillator",
        summary: "a mass on a spring with a damper, driven by a force",
        equation: "v' = F/m - (d/m) v - (k/m) q;  q' = v",
        reference: "Den Hartog (1956), Mechanical Vibrations, 4th ed., chapter 2; Wigren, Schoukens (2013), European Control Conference, 2933-2938 (the Silverbox)",
        assumptions: "one degree of freedom, linear spring and damper",
        example: "[plant.oscillator.physical]\nmass = 2.0\nstiffness = 800.0\ndamping = 4.0\n",
        states: &[
            Signal::new("velocity", "v", "m/s", "velocity of the mass"),
            Signal::new("position", "q", "m", "position of the mass from rest"),
        ],
        inputs: &[Signal::new("force", "F", "N", "force on the mass")],
        outputs: &[],
        integrals: &[("velocity", "position")],
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "mass, stiffness and damping",
            parameters: &PHYSICAL,
        }],
        controlled: &[0],
    };

    const DERIVED: &'static [Derived] = &[
        Derived::new(
            "natural_frequency",
            "rad/s",
            "sqrt(k/m)",
            "angular frequency without damping",
        ),
        Derived::new(
            "damping_ratio",
            "1",
            "(d/m)/(2 sqrt(k/m))",
            "damping as a share of the critical one",
        ),
    ];

    fn derivative<S: Real>(x: &[S; 2], u: &[S; 1], w: &[S; 1], p: &[S; 3]) -> [S; 2] {
        let [v, q] = *x;
        [p[2] * (u[0] + w[0]) - p[1] * v - p[0] * q, v]
    }

    fn output<S: Real>(_index: usize, _x: &[S; 2], _u: &[S; 1], _p: &[S; 3]) -> S {
        S::zero()
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 3]> {
        if set != 0 {
            return None;
        }
        let [mass, stiffness, damping] = *<&[S; 3]>::try_from(from).ok()?;
        Some([stiffness / mass, damping / mass, S::one() / mass])
    }

    fn derived<S: Real>(index: usize, p: &[S; 3]) -> S {
        // Without a spring there is no oscillation; the root has no derivative there.
        if p[0] <= S::zero() {
            return S::zero();
        }
        let frequency = p[0].sqrt();
        match index {
            0 => frequency,
            _ => p[1] / (S::of(2.0) * frequency),
        }
    }
}

impl ControlAffine for Oscillator {
    fn drift<S: Real>(y: &[S; 1], p: &[S; 3]) -> [S; 1] {
        [-p[1] * y[0]]
    }
    fn input_matrix<S: Real>(_y: &[S; 1], p: &[S; 3]) -> [[S; 1]; 1] {
        [[p[2]]]
    }
    fn push<S: Real>(_y: &[S; 1], w: &[S; 1], p: &[S; 3]) -> [S; 1] {
        [p[2] * w[0]]
    }
}

declare_plant!(Oscillator, "oscillator");

#[cfg(test)]
mod tests {
    use loopsight_core::rk4_step;

    use super::*;

    /// `q(t) = F/k (1 - e^{-ζω₀t} (cos ω_d t + ζω₀/ω_d sin ω_d t))`, Den Hartog (1956), section 2.5.
    #[test]
    fn a_step_of_force_rings_down_to_the_spring() {
        let (mass, stiffness, damping, force) = (2.0f64, 800.0, 4.0, 10.0);
        let p: [f64; 3] = Oscillator::lower(0, &[mass, stiffness, damping]).unwrap();
        let (natural, ratio) = (Oscillator::derived(0, &p), Oscillator::derived(1, &p));
        assert!((natural - 20.0).abs() < 1e-12 && (ratio - 0.05).abs() < 1e-12);
        let (decay, ringing) = (ratio * natural, natural * (1.0 - ratio * ratio).sqrt());
        let mut x = [0.0; 2];
        let h = 1e-3;
        for k in 1..=2000 {
            rk4_step(&mut x, h, |x| {
                Oscillator::derivative(x, &[force - 1.0], &[1.0], &p)
            });
            let t = h * f64::from(k);
            let swing = (ringing * t).cos() + decay / ringing * (ringing * t).sin();
            let q = force / stiffness * (1.0 - (-decay * t).exp() * swing);
            assert!((x[1] - q).abs() < 1e-9, "{t}: {} {q}", x[1]);
        }
    }
}
