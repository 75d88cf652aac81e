//! The two machines of motors and wheels, as parts one could weigh and measure.

use crate::truth::Quantity;

/// A machine whose motors turn shafts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Driven {
    /// Differential-drive robot after the Twil: two geared DC motors, odometry.
    Twil,
    /// One geared DC motor turning one inertia: an arm, a lift, a flywheel.
    Axis,
}

/// A geared DC motor.
///
/// ```text
/// V = R i + L i' + K_a Ω/n        τ = (K_T i - f Ω/n)/n - J/n² Ω'
/// ```
///
/// `Ω`: speed of the gear's output shaft, rad/s; `τ`: torque there, N m; `n`: output over motor
/// speed. The gear is lossless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Torque constant `K_T`, N m/A.
    pub torque_constant: f64,
    /// Back-emf constant `K_a`, V s/rad.
    pub back_emf_constant: f64,
    /// Armature resistance `R`, Ohm.
    pub resistance: f64,
    /// Armature inductance `L`, H.
    pub inductance: f64,
    /// Output speed over motor speed `n`.
    pub gear_ratio: f64,
    /// Viscous friction `f` at the rotor, N m s/rad.
    pub rotor_friction: f64,
    /// Inertia of the rotor as it acts at the output, `J/n²`, kg m².
    pub reflected_inertia: f64,
}

impl Motor {
    /// Torque at the output per volt, at standstill: `K_T/(R n)`, N m/V. It is also what one volt
    /// of equivalent motor voltage means for a torque at the shaft.
    pub fn torque_per_volt(&self) -> f64 {
        self.torque_constant / (self.resistance * self.gear_ratio)
    }
}

/// What the motors move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Mass without rotors' and wheels' inertia, kg; on the axis: the load's inertia, kg m².
    pub mass: f64,
    /// Moment of inertia about the vertical through the midpoint of the axle, rotors and wheels
    /// rolling not counted, kg m². Without meaning on the axis.
    pub inertia: f64,
    /// Moment of inertia of one wheel about its axle, kg m².
    pub wheel_inertia: f64,
    /// Nominal wheel radius, m; 1 on the axis.
    pub wheel_radius: f64,
    /// Half the distance between the wheels, m.
    pub half_track: f64,
}

/// The lumped parameters of (37) that a machine has for `L → 0`; on the axis `K_A`, `K_C` alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lumped {
    /// Damping, 1/s.
    pub k_a: f64,
    /// Acceleration per volt on each motor, m/s²/V; on the axis rad/s²/V.
    pub k_c: f64,
    /// Yaw damping, 1/s.
    pub k_d: f64,
    /// Yaw acceleration per volt of difference, rad/s²/V.
    pub k_f: f64,
}

/// The paper's θ1 and θ2 without K_B and K_E: the clean robot has its centre of mass on the axle.
const TWIL: Lumped = Lumped {
    k_a: -15.146,
    k_c: 0.136,
    k_d: -9.573,
    k_f: 0.656,
};
const AXIS: Lumped = Lumped {
    k_a: -6.0,
    k_c: 2.0,
    k_d: 0.0,
    k_f: 0.0,
};

/// Time constant of the windings `L/R`, s, unless another is asked for.
pub(crate) const ELECTRICAL_TIME_CONSTANT: f64 = 1e-4;
/// Torque constant and back-emf constant, N m/A and V s/rad: equal in SI units.
const MOTOR_CONSTANT: f64 = 0.0265;
/// Output over motor speed.
const GEAR_RATIO: f64 = 0.01;
/// Inertia of a rotor at the output, kg m².
const REFLECTED_INERTIA: f64 = 0.0065;
/// Inertia of a wheel, kg m²: a disc of 0.8 kg.
const WHEEL_INERTIA: f64 = 0.001;
/// Radius of the robot's wheels, m, as in the example of the Twil.
const WHEEL_RADIUS: f64 = 0.05;
/// Mass of the robot with the inertia of everything that turns while it drives, kg.
const EFFECTIVE_MASS: f64 = 30.0;

impl Driven {
    /// Name in messages and file names.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Driven::Twil => "twil",
            Driven::Axis => "axis",
        }
    }

    /// The parameters of (37) that the machine has by construction.
    pub fn lumped(self) -> Lumped {
        match self {
            Driven::Twil => TWIL,
            Driven::Axis => AXIS,
        }
    }

    /// Voltage per speed of a shaft that the damping is, back-emf and viscous friction, V s/rad.
    pub(crate) fn back_emf(self, wheel_radius: f64) -> f64 {
        let k = self.lumped();
        match self {
            Driven::Twil => -k.k_a * wheel_radius / (2.0 * k.k_c),
            Driven::Axis => -k.k_a / k.k_c,
        }
    }

    /// [`Driven::lumped`] by name.
    pub(crate) fn quantities(self) -> Vec<Quantity> {
        let k = self.lumped();
        let quantity = |name, value, unit| Quantity { name, value, unit };
        match self {
            Driven::Twil => vec![
                quantity("K_A", k.k_a, "1/s"),
                quantity("K_B", 0.0, "m/rad^2"),
                quantity("K_C", k.k_c, "m/s^2/V"),
                quantity("K_D", k.k_d, "1/s"),
                quantity("K_E", 0.0, "1/m"),
                quantity("K_F", k.k_f, "rad/s^2/V"),
            ],
            Driven::Axis => vec![
                quantity("K_A", k.k_a, "1/s"),
                quantity("K_C", k.k_c, "rad/s^2/V"),
            ],
        }
    }

    /// Header of a log.
    pub(crate) fn columns(self) -> &'static [&'static str] {
        match self {
            Driven::Twil => &[
                "time_s",
                "voltage_right_V",
                "voltage_left_V",
                "linear_velocity_m_per_s",
                "angular_velocity_rad_per_s",
            ],
            Driven::Axis => &["time_s", "voltage_V", "speed_rad_per_s"],
        }
    }

    /// Number of motors.
    pub(crate) fn drives(self) -> usize {
        match self {
            Driven::Twil => 2,
            Driven::Axis => 1,
        }
    }

    /// The parts, chosen so that the lumped parameters come out exactly.
    ///
    /// With `g = K_T/(R n)` the torque per volt, `c = (K_T K_a/R + f)/n²` the damping at the shaft
    /// and `M`, `I` mass and yaw inertia with rotors and wheels, Newton and Euler say
    ///
    /// ```text
    /// M v' = (τ_r + τ_l)/r     I ω' = b (τ_r - τ_l)/r     τ = g V - c φ'     φ'_r,l = (v ± b ω)/r
    /// K_A = -2 c/(r² M)     K_C = g/(r M)     K_D = -2 c b²/(r² I)     K_F = b g/(r I)
    /// ```
    ///
    /// which, solved for the parts with `M`, `r`, `n`, `K_T = K_a` chosen, is
    ///
    /// ```text
    /// b = (K_D/K_A)/(K_F/K_C)     g = K_C r M     c = -K_A r² M/2     I = b g/(r K_F)
    /// R = K_T/(g n)     f = c n² - K_T K_a/R
    /// ```
    ///
    /// The axis has the same motor, but for `f`, on `I = g/K_C`, with `c = -K_A I`.
    pub fn parts(self) -> (Motor, Body) {
        let k = self.lumped();
        let r = WHEEL_RADIUS;
        let g = TWIL.k_c * r * EFFECTIVE_MASS;
        let turning = REFLECTED_INERTIA + WHEEL_INERTIA;
        let (damping, body) = match self {
            Driven::Twil => {
                let b = (k.k_d / k.k_a) / (k.k_f / k.k_c);
                let effective_inertia = b * g / (r * k.k_f);
                let body = Body {
                    mass: EFFECTIVE_MASS - 2.0 * turning / (r * r),
                    inertia: effective_inertia - 2.0 * turning * b * b / (r * r),
                    wheel_inertia: WHEEL_INERTIA,
                    wheel_radius: r,
                    half_track: b,
                };
                (-k.k_a * r * r * EFFECTIVE_MASS / 2.0, body)
            }
            Driven::Axis => {
                let effective_inertia = g / k.k_c;
                let body = Body {
                    mass: effective_inertia - turning,
                    inertia: 1.0,
                    wheel_inertia: WHEEL_INERTIA,
                    wheel_radius: 1.0,
                    half_track: 0.0,
                };
                (-k.k_a * effective_inertia, body)
            }
        };
        let resistance = MOTOR_CONSTANT / (g * GEAR_RATIO);
        let motor = Motor {
            torque_constant: MOTOR_CONSTANT,
            back_emf_constant: MOTOR_CONSTANT,
            resistance,
            inductance: ELECTRICAL_TIME_CONSTANT * resistance,
            gear_ratio: GEAR_RATIO,
            rotor_friction: damping * GEAR_RATIO * GEAR_RATIO
                - MOTOR_CONSTANT * MOTOR_CONSTANT / resistance,
            reflected_inertia: REFLECTED_INERTIA,
        };
        (motor, body)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_possible_and_give_the_lumped_parameters() {
        for robot in [Driven::Twil, Driven::Axis] {
            let (motor, body) = robot.parts();
            let k = robot.lumped();
            assert!(motor.rotor_friction > 0.0 && motor.resistance > 0.0);
            assert!(body.mass > 0.0 && body.inertia > 0.0);
            let n = motor.gear_ratio;
            let g = motor.torque_per_volt();
            let c = (motor.torque_constant * motor.back_emf_constant / motor.resistance
                + motor.rotor_friction)
                / (n * n);
            let turning = motor.reflected_inertia + body.wheel_inertia;
            let r = body.wheel_radius;
            let b = body.half_track;
            let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
            if robot == Driven::Twil {
                let m = body.mass + 2.0 * turning / (r * r);
                let i = body.inertia + 2.0 * turning * b * b / (r * r);
                close(-2.0 * c / (r * r * m), k.k_a);
                close(g / (r * m), k.k_c);
                close(-2.0 * c * b * b / (r * r * i), k.k_d);
                close(b * g / (r * i), k.k_f);
                close(m, 30.0);
                assert!((0.13..0.132).contains(&b));
            } else {
                close(-c / (body.mass + turning), k.k_a);
                close(g / (body.mass + turning), k.k_c);
            }
        }
    }
}
