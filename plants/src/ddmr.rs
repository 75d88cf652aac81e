//! Differential-drive mobile robot with DC motors.

mod tables;

use crate::declare_plant;
use loopsight_core::{ControlAffine, Derived, Parameterization, Plant, PlantMeta, Real, Unshown};

use tables::{
    CHANNELS, FEEDFORWARD, INPUTS, INTEGRALS, LUMPED, OUTPUTS, PHYSICAL, STATES, UNSHOWN,
};

/// Differential-drive mobile robot (DDMR) with DC motors, pose included.
///
/// ```text
/// v'     = K_A v     + K_B ω²  + K_C ((V_r + w_r) + (V_l + w_l)) + w_v      (37), first row
/// ω'     = K_D ω     + K_E v ω + K_F ((V_r + w_r) - (V_l + w_l)) + w_ω      (37), second row
/// θ'     = ω      s' = v      x' = v cos θ      y' = v sin θ                (1)(2)
/// φ'_r   = (v + b ω)/r        φ'_l = (v - b ω)/r                            (9)(10) inverted
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `v`, `ω` | forward speed, yaw rate of the point midway between the wheels | m/s, rad/s |
/// | `x, y, θ`, `s` | pose, distance travelled | m, m, rad, m |
/// | `V_r`, `V_l` | motor voltages | V |
/// | `w_r`, `w_l` | efforts at the wheels, as the motor voltage that would have the same effect | V |
/// | `w_v`, `w_ω` | accelerations added to the body | m/s², rad/s² |
/// | `b`, `r` | half track, wheel radius | m |
///
/// The lumped `K_A … K_F` follow from physical parameters by (30)–(35), see [`Ddmr::lumped`].
///
/// Assumptions: planar motion, wheels that roll without slipping, equal motors, armature
/// inductance neglected (its time constant is far below the mechanical one).
///
/// Reference: T. G. Alves, W. F. Lages, R. V. B. Henriques (2018), "Parametric Identification and
/// Controller Design for a Differential-Drive Mobile Robot", IFAC PapersOnLine 51-15, 437–442,
/// equations (1)–(37).
#[derive(Clone, Copy, Debug)]
pub struct Ddmr;

/// The physical parameters of the robot, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Physical<S> {
    /// Mass of the robot, wheels included, kg.
    pub mass: S,
    /// Moment of inertia about the vertical axis through the centre of mass, kg m².
    pub yaw_inertia: S,
    /// Centre of mass ahead of the axle, m.
    pub mass_offset: S,
    /// Wheel radius `r`, m.
    pub wheel_radius: S,
    /// Half the distance between the wheels `b`, m.
    pub half_track: S,
    /// Torque constant `K_T`, N m/A.
    pub torque_constant: S,
    /// Back-emf constant `K_a`, V s/rad.
    pub back_emf_constant: S,
    /// Armature resistance `R_a`, Ohm.
    pub resistance: S,
    /// Wheel speed over motor speed `n` (below 1 for a reduction gear).
    pub gear_ratio: S,
    /// Rotor inertia `J`, kg m².
    pub rotor_inertia: S,
    /// Viscous friction `f` at the rotor, N m s/rad.
    pub viscous_friction: S,
}

impl Ddmr {
    /// The lumped parameters `[K_A … K_F]` from the physical ones, (30)–(35).
    ///
    /// With `k5 = d`, `k6 = -m d/(I + m d²)`, `k7 = 1/(m r)`, `k8 = b/(r (I + m d²))` of (17) and
    /// `c = r/(2 b)`:
    ///
    /// ```text
    /// D1  = r n² + 2 J k7                        D2  = c n² + J k8
    /// K_A = -2 k7 (K_T K_a/R_a + f)/D1           K_D = -k8 (K_T K_a/R_a + f)/D2
    /// K_B = k5 r n²/D1                           K_E = k6 c n²/D2
    /// K_C = r n K_T k7/(R_a D1)                  K_F = c n K_T k8/(R_a D2)
    /// ```
    ///
    /// The paper uses `c` in (18)–(35) without defining it. Inverting (9)(10) gives
    /// `φ'_r - φ'_l = 2 b ω/r`, which (18)(19) write as `ω/c`: so `c = r/(2b)`, not the half
    /// track itself; only then do the units of (33)–(35) agree and `K_D/K_A = b K_F/K_C`.
    pub fn lumped<S: Real>(of: &Physical<S>) -> [S; 6] {
        let two = S::of(2.0);
        let about_axle = of.yaw_inertia + of.mass * of.mass_offset * of.mass_offset;
        let k5 = of.mass_offset;
        let k6 = -of.mass * of.mass_offset / about_axle;
        let k7 = S::of(1.0) / (of.mass * of.wheel_radius);
        let k8 = of.half_track / (of.wheel_radius * about_axle);
        let r = of.wheel_radius;
        let c = of.wheel_radius / (two * of.half_track);
        let n = of.gear_ratio;
        let d1 = r * n * n + two * of.rotor_inertia * k7;
        let d2 = c * n * n + of.rotor_inertia * k8;
        let damping =
            of.torque_constant * of.back_emf_constant / of.resistance + of.viscous_friction;
        let drive = n * of.torque_constant / of.resistance;
        [
            -two * k7 * damping / d1,
            k5 * r * n * n / d1,
            r * drive * k7 / d1,
            -k8 * damping / d2,
            k6 * c * n * n / d2,
            c * drive * k8 / d2,
        ]
    }
}

impl Plant for Ddmr {
    const META: PlantMeta = PlantMeta {
        id: "ddmr",
        summary: "differential-drive mobile robot with two DC motors",
        equation: "v' = K_A v + K_B ω² + K_C (V_r + V_l);  ω' = K_D ω + K_E v ω + K_F (V_r - V_l);  \
                   θ' = ω;  x' = v cos θ;  y' = v sin θ",
        reference: "Alves, Lages, Henriques (2018), IFAC PapersOnLine 51-15, 437-442, equations (1)-(37)",
        assumptions: "planar motion, rolling without slip, equal motors, armature inductance neglected",
        example: "[plant.ddmr]\nK_A = -15.146\nK_B = 0.005\nK_C = 0.136\nK_D = -9.573\nK_E = -3.945\nK_F = 0.656\nhalf_track = 0.131\nwheel_radius = 0.05\n",
        states: &STATES,
        inputs: &INPUTS,
        outputs: &OUTPUTS,
        integrals: &INTEGRALS,
        channels: &CHANNELS,
        parameters: &LUMPED,
        parameterizations: &[Parameterization {
            id: "physical",
            summary: "mass, inertia, geometry and motor constants, from which K_A…K_F follow",
            parameters: &PHYSICAL,
        }],
        controlled: &[0, 1],
    };

    const DERIVED: &'static [Derived] = &FEEDFORWARD;

    const UNSHOWN: &'static [Unshown] = &UNSHOWN;

    /// The place in the plane.
    const TRAIL: &'static [usize] = &[4, 5];

    fn derivative<S: Real>(x: &[S; 6], u: &[S; 2], w: &[S; 4], p: &[S; 8]) -> [S; 6] {
        let mut rate = Self::motion(x, u, w, p);
        let [v, _, heading, ..] = *x;
        let (sin, cos) = heading.sin_cos();
        rate[4] = v * cos;
        rate[5] = v * sin;
        rate
    }

    fn motion<S: Real>(x: &[S; 6], u: &[S; 2], w: &[S; 4], p: &[S; 8]) -> [S; 6] {
        let [v, omega, ..] = *x;
        let [k_a, k_b, k_c, k_d, k_e, k_f, _, _] = *p;
        let right = u[0] + w[0];
        let left = u[1] + w[1];
        // What does not depend on the state is a sum of its own: a step waits for no more of it than it must.
        let (along, around) = (k_c * (right + left) + w[2], k_f * (right - left) + w[3]);
        [
            k_a * v + k_b * omega * omega + along,
            k_d * omega + k_e * v * omega + around,
            omega,
            v,
            S::zero(),
            S::zero(),
        ]
    }

    fn output<S: Real>(index: usize, x: &[S; 6], u: &[S; 2], p: &[S; 8]) -> S {
        let [v, omega, heading, travel, _, _] = *x;
        let [.., half_track, wheel_radius] = *p;
        match index {
            0 => (v + half_track * omega) / wheel_radius,
            1 => (v - half_track * omega) / wheel_radius,
            2 => v + half_track * omega,
            3 => v - half_track * omega,
            4 => (travel + half_track * heading) / wheel_radius,
            5 => (travel - half_track * heading) / wheel_radius,
            6 => {
                let [right, left] = armature(x, u, p);
                u[0] * right + u[1] * left
            }
            7 => u[0] * u[0] + u[1] * u[1],
            8 => armature(x, u, p)[0],
            9 => armature(x, u, p)[1],
            10 => omega * omega,
            _ => -v * omega,
        }
    }

    fn outputs<S: Real>(which: &[usize], x: &[S; 6], u: &[S; 2], p: &[S; 8], y: &mut [S]) {
        let mut both = None;
        for index in which {
            let Some(to) = y.get_mut(*index) else {
                continue;
            };
            *to = match index {
                // The voltages over the two windings have their terms in common.
                8 | 9 => both.get_or_insert_with(|| armature(x, u, p))[index - 8],
                _ => Self::output(*index, x, u, p),
            };
        }
    }

    fn derived<S: Real>(index: usize, p: &[S; 8]) -> S {
        let [k_a, _, k_c, ..] = *p;
        let two = S::of(2.0);
        match index {
            0 => -k_a / (two * k_c),
            _ => S::of(1.0) / (two * k_c),
        }
    }

    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; 8]> {
        if set != 0 {
            return None;
        }
        let [m, i, d, r, b, k_t, k_a, r_a, n, j, f] = *<&[S; 11]>::try_from(from).ok()?;
        let [ka, kb, kc, kd, ke, kf] = Self::lumped(&Physical {
            mass: m,
            yaw_inertia: i,
            mass_offset: d,
            wheel_radius: r,
            half_track: b,
            torque_constant: k_t,
            back_emf_constant: k_a,
            resistance: r_a,
            gear_ratio: n,
            rotor_inertia: j,
            viscous_friction: f,
        });
        Some([ka, kb, kc, kd, ke, kf, b, r])
    }
}

/// Voltages over the windings, right and left: what drives less what `K_A` and `K_D` take.
fn armature<S: Real>(x: &[S; 6], u: &[S; 2], p: &[S; 8]) -> [S; 2] {
    let [v, omega, ..] = *x;
    let [k_a, _, k_c, k_d, _, k_f, ..] = *p;
    let half = S::of(0.5);
    let forward = (quotient(k_a, k_c) * v).times(half);
    let turning = (quotient(k_d, k_f) * omega).times(half);
    [u[0] + forward + turning, u[1] + forward - turning]
}

/// `a/b`, zero where `b` is: a motor without drive has no back-emf to speak of.
fn quotient<S: Real>(a: S, b: S) -> S {
    if b.abs() > S::of(1e-9) {
        a / b
    } else {
        S::zero()
    }
}

/// `u' = -f2(u) + G2 V`, (27)–(29): the drift is `-f2`, the input matrix `G2`.
impl ControlAffine for Ddmr {
    fn drift<S: Real>(y: &[S; 2], p: &[S; 8]) -> [S; 2] {
        let [v, omega] = *y;
        let [k_a, k_b, _, k_d, k_e, ..] = *p;
        [k_a * v + k_b * omega * omega, k_d * omega + k_e * v * omega]
    }

    fn input_matrix<S: Real>(_y: &[S; 2], p: &[S; 8]) -> [[S; 2]; 2] {
        let [_, _, k_c, _, _, k_f, ..] = *p;
        [[k_c, k_c], [k_f, -k_f]]
    }

    fn push<S: Real>(_y: &[S; 2], w: &[S; 4], p: &[S; 8]) -> [S; 2] {
        let [_, _, k_c, _, _, k_f, ..] = *p;
        let [right, left, forward, yaw] = *w;
        [k_c * (right + left) + forward, k_f * (right - left) + yaw]
    }
}

declare_plant!(Ddmr, "ddmr");

#[cfg(test)]
mod tests {
    use super::*;

    const ROBOT: Physical<f64> = Physical {
        mass: 9.0,
        yaw_inertia: 0.19,
        mass_offset: 0.03,
        wheel_radius: 0.05,
        half_track: 0.131,
        torque_constant: 0.03,
        back_emf_constant: 0.031,
        resistance: 1.9,
        gear_ratio: 1.0 / 40.0,
        rotor_inertia: 4e-6,
        viscous_friction: 2e-6,
    };

    /// Accelerations from first principles: currents, rotor, gear, Newton and Euler about the
    /// axle, with the rotor's own acceleration solved for instead of eliminated on paper.
    fn first_principles(of: &Physical<f64>, v: f64, omega: f64, volts: [f64; 2]) -> [f64; 2] {
        let about_axle = of.yaw_inertia + of.mass * of.mass_offset.powi(2);
        // Unknowns: v', ω'. Wheel torque = (K_T i - J φ_m'' - f φ_m')/n with φ_m' = φ'/n.
        let n = of.gear_ratio;
        let side = |sign: f64, volt: f64| {
            let shaft = (v + sign * of.half_track * omega) / of.wheel_radius;
            let current = (volt - of.back_emf_constant * shaft / n) / of.resistance;
            (of.torque_constant * current - of.viscous_friction * shaft / n) / n
        };
        let reflected = of.rotor_inertia / (n * n);
        let (tau_r, tau_l) = (side(1.0, volts[0]), side(-1.0, volts[1]));
        // m v' = m d ω² + (τ_r + τ_l)/r with τ -= reflected (v' ± b ω')/r
        let effective_mass = of.mass + 2.0 * reflected / of.wheel_radius.powi(2);
        let effective_inertia =
            about_axle + 2.0 * reflected * (of.half_track / of.wheel_radius).powi(2);
        [
            (of.mass * of.mass_offset * omega * omega + (tau_r + tau_l) / of.wheel_radius)
                / effective_mass,
            (-of.mass * of.mass_offset * v * omega
                + of.half_track / of.wheel_radius * (tau_r - tau_l))
                / effective_inertia,
        ]
    }

    #[test]
    fn lumped_parameters_agree_with_first_principles() {
        let k = Ddmr::lumped(&ROBOT);
        let p = [
            k[0],
            k[1],
            k[2],
            k[3],
            k[4],
            k[5],
            ROBOT.half_track,
            ROBOT.wheel_radius,
        ];
        for (v, omega, volts) in [
            (0.2, 1.0, [9.0, -3.0]),
            (-0.4, 0.3, [1.0, 2.0]),
            (0.0, -2.0, [0.0, 0.0]),
        ] {
            let expected = first_principles(&ROBOT, v, omega, volts);
            let rate = Ddmr::derivative(&[v, omega, 0.0, 0.0, 0.0, 0.0], &volts, &[0.0; 4], &p);
            for i in 0..2 {
                assert!(
                    (rate[i] - expected[i]).abs() < 1e-12 * expected[i].abs().max(1.0),
                    "{i}: {} instead of {}",
                    rate[i],
                    expected[i]
                );
            }
        }
    }

    /// A rigid body with its centre of mass off the axle obeys K_B >= 0 >= K_E, and
    /// K_D/K_A = b K_F/K_C.
    #[test]
    fn lumped_parameters_obey_their_laws() {
        let [k_a, k_b, k_c, k_d, k_e, k_f] = Ddmr::lumped(&ROBOT);
        assert!(k_a < 0.0 && k_d < 0.0 && k_c > 0.0 && k_f > 0.0);
        assert!(k_b > 0.0 && k_e < 0.0);
        assert!(((k_d / k_a) / (k_f / k_c) - ROBOT.half_track).abs() < 1e-12);
    }

    #[test]
    fn control_affine_view_agrees_with_the_derivative() {
        let p = [-15.146, 0.005, 0.136, -9.573, -3.945, 0.656, 0.131, 0.05];
        let (y, u, w) = ([0.1, -0.7], [5.0, -2.0], [0.3, -0.9, 0.2, -1.1]);
        let f = Ddmr::drift(&y, &p);
        let g = Ddmr::input_matrix(&y, &p);
        let h = Ddmr::push(&y, &w, &p);
        let rate = Ddmr::derivative(&[y[0], y[1], 0.3, 0.0, 0.0, 0.0], &u, &w, &p);
        for i in 0..2 {
            let affine: f64 = f[i] + g[i][0] * u[0] + g[i][1] * u[1] + h[i];
            assert!((affine - rate[i]).abs() < 1e-14);
        }
    }

    /// Nothing depends on the place in the plane, and the motion without it is the motion with it.
    #[test]
    fn the_trail_moves_nothing() {
        let p = [-15.146, 0.005, 0.136, -9.573, -3.945, 0.656, 0.131, 0.05];
        let (u, w) = ([5.0, -2.0], [0.3, -0.9, 0.2, -1.1]);
        let (here, there) = (
            [0.1, -0.7, 0.4, 2.0, 0.0, 0.0],
            [0.1, -0.7, 0.4, 2.0, 3.0, -8.0],
        );
        let mut rate = Ddmr::derivative(&here, &u, &w, &p);
        assert_eq!(rate, Ddmr::derivative(&there, &u, &w, &p));
        for i in 0..OUTPUTS.len() {
            let at = |x| Ddmr::output(i, x, &u, &p);
            assert_eq!(at(&here), at(&there));
        }
        for i in Ddmr::TRAIL {
            assert!(rate[*i] != 0.0);
            rate[*i] = 0.0;
        }
        assert_eq!(rate, Ddmr::motion(&here, &u, &w, &p));
    }

    #[test]
    fn kinematics_agree_with_the_wheels() {
        let p = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.131, 0.05];
        let y = [0, 1].map(|i| Ddmr::output(i, &[0.2, 1.0, 0.0, 0.0, 0.0, 0.0], &[0.0; 2], &p));
        assert!((0.05 * (y[0] + y[1]) / 2.0 - 0.2f64).abs() < 1e-15);
        assert!((0.05 * (y[0] - y[1]) / (2.0 * 0.131) - 1.0f64).abs() < 1e-14);
    }
}
