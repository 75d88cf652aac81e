//! Effects at the body: ground, centre of mass, payload.

use crate::contact::{Twisting, Tyre};
use crate::driven::Driven;
use crate::physics::{GRAVITY, Payload, Physics, Slope};
use crate::truth::Concealed;

/// Mass and yaw inertia with rotors and wheels that roll, kg and kg m²; on the axis the inertia of
/// the shaft twice.
fn effective(m: &Physics) -> [f64; 2] {
    let turning = m.motor.reflected_inertia + m.body.wheel_inertia;
    match m.robot {
        Driven::Axis => [m.body.mass + turning; 2],
        Driven::Twil => {
            let per_wheel = 2.0 * turning / m.body.wheel_radius.powi(2);
            let lever = m.body.half_track.powi(2);
            [m.body.mass + per_wheel, m.body.inertia + per_wheel * lever]
        }
    }
}

/// Dry friction against turning of a tenth of what the motors can do.
pub(super) fn scrub(m: &mut Physics, mut of: Concealed) -> Concealed {
    of.at = vec!["body.yaw"];
    let level = 1.2 * of.size;
    let torque = level * effective(m)[1];
    m.scrub += torque;
    of.fitted("level", level, "rad/s^2")
        .physical("torque", torque, "N m")
}

/// A floor that rises by 3°.
pub(super) fn slope(m: &mut Physics, mut of: Concealed) -> Concealed {
    of.at = vec!["body.forward"];
    let angle = 3.0f64.to_radians() * of.size;
    let direction = 0.6f64;
    m.slope = Some(Slope { angle, direction });
    let amplitude = GRAVITY * angle.sin() * m.body.mass / effective(m)[0];
    of.fitted("cosine", -amplitude * direction.cos(), "m/s^2")
        .fitted("sine", -amplitude * direction.sin(), "m/s^2")
        .physical("angle", angle, "rad")
        .physical("uphill", direction, "rad")
}

/// Centre of mass 80 mm ahead of the axle.
pub(super) fn offset(m: &mut Physics, mut of: Concealed) -> Concealed {
    of.at = vec!["body.forward", "body.yaw"];
    let offset = 0.08 * of.size;
    m.mass_offset += offset;
    let [mass, inertia] = effective(m);
    let unbalance = m.body.mass * offset;
    of.fitted("forward", unbalance / mass, "m/rad^2")
        .fitted("yaw", unbalance / inertia, "1/m")
        .physical("mass_offset", offset, "m")
}

/// Tyres with a coefficient of friction of 0.2. The limit in volts is that of the peak, the time constant
/// that of a wheel with its rotor against the damping of its motor.
pub(super) fn slip(m: &mut Physics, mut of: Concealed) -> Concealed {
    let tyre = Tyre {
        friction: 0.2 / of.size,
        slip: 0.003,
    };
    m.tyre = Some(tyre);
    let traction = tyre.friction * 0.5 * m.body.mass * GRAVITY;
    let sliding = Tyre::sliding();
    let torque_per_volt = m.motor.torque_per_volt();
    let turning = m.motor.reflected_inertia + m.body.wheel_inertia;
    let damping = torque_per_volt * m.robot.back_emf(m.body.wheel_radius);
    of.approximate = true;
    of.fitted(
        "limit",
        traction * m.body.wheel_radius / torque_per_volt,
        "V",
    )
    .fitted("sliding", sliding, "1")
    .fitted("wheel", turning / damping, "s")
    .physical("friction", tyre.friction, "1")
    .physical("largest_traction", traction, "N")
    .physical("sliding_traction", sliding * traction, "N")
    .physical("slip_scale", tyre.slip, "m/s")
}

/// A third of the axis' inertia behind a shaft on which it swings with 40 rad/s; the encoder sits at the motor.
pub(super) fn coupling(m: &mut Physics, mut of: Concealed) -> Concealed {
    let (ratio, frequency, damping) = (0.5 * of.size, 40.0, 0.05);
    let inertia = effective(m)[0] * ratio / (1.0 + ratio);
    let shaft = Twisting::swinging(inertia, frequency, damping);
    m.body.mass -= inertia;
    m.twisting = Some(shaft);
    of.at = vec!["inertia"];
    // With the motor held it swings with that frequency; against the motor's side faster.
    let faster = f64::sqrt(1.0 + ratio);
    of.fitted("ratio", ratio, "1")
        .fitted("resonance", faster * frequency, "rad/s")
        .fitted("damping", faster * damping, "1")
        .physical("load_inertia", shaft.inertia, "kg m^2")
        .physical("stiffness", shaft.stiffness, "N m/rad")
        .physical("damping_torque", shaft.damping, "N m s/rad")
}

/// Something of 7.2 kg and 0.16 kg m², put on board after 9.7 s.
pub(super) fn payload(m: &mut Physics, mut of: Concealed) -> Concealed {
    let [mass, inertia] = effective(m);
    let payload = Payload {
        time: 9.7,
        mass: match m.robot {
            Driven::Twil => 0.24 * mass * of.size,
            Driven::Axis => 0.4 * mass * of.size,
        },
        inertia: 0.2 * inertia * of.size,
    };
    m.payload = Some(payload);
    let of_robot = m.robot == Driven::Twil;
    of.at = if of_robot {
        vec!["inertia.forward", "inertia.yaw"]
    } else {
        vec!["inertia"]
    };
    let of = of
        .fitted("time", payload.time, "s")
        .fitted("fraction", payload.mass / mass, "1");
    if of_robot {
        of.fitted("yaw_fraction", payload.inertia / inertia, "1")
            .physical("mass", payload.mass, "kg")
            .physical("inertia", payload.inertia, "kg m^2")
    } else {
        of.physical("inertia", payload.mass, "kg m^2")
    }
}
