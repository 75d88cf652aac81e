//! Effects at the shafts. Sizes are given in volts of equivalent motor voltage: of the 9 V that
//! drive the machine, 0.9 V is 10 %.

use crate::bristles::Bristles;
use crate::contact::{Gap, Stops};
use crate::hysteresis::Hysteresis;
use crate::physics::{Cogging, Physics};
use crate::truth::Concealed;

/// Adds to each of two coefficients.
fn add(to: &mut [f64; 2], amounts: [f64; 2]) {
    to[0] += amounts[0];
    to[1] += amounts[1];
}

/// Dry friction of 0.9 V.
pub(super) fn coulomb(m: &mut Physics, of: Concealed) -> Concealed {
    let level = 0.9 * of.size;
    let torque = level * m.motor.torque_per_volt();
    for friction in &mut m.friction {
        add(&mut friction.coulomb, [torque; 2]);
    }
    of.fitted("level", level, "V")
        .physical("torque", torque, "N m")
}

/// Dry friction of 0.6 V when sliding and 1.5 V when breaking away.
pub(super) fn stribeck(m: &mut Physics, of: Concealed) -> Concealed {
    let (sliding, breakaway, speed) = (0.6 * of.size, 1.5 * of.size, 0.6);
    let g = m.motor.torque_per_volt();
    for friction in &mut m.friction {
        add(&mut friction.coulomb, [sliding * g; 2]);
        friction.breakaway += (breakaway - sliding) * g;
        friction.stribeck_speed = speed;
    }
    of.fitted("level", sliding, "V")
        .fitted("extra", breakaway - sliding, "V")
        .fitted("speed", speed, "rad/s")
        .physical("sliding_torque", sliding * g, "N m")
        .physical("breakaway_torque", breakaway * g, "N m")
}

/// Viscous friction at one wheel: at both it would be part of K_A and K_D.
pub(super) fn viscous(m: &mut Physics, mut of: Concealed) -> Concealed {
    of.at.truncate(1);
    let coefficient = 0.6 * of.size;
    let torque = coefficient * m.motor.torque_per_volt();
    add(&mut m.friction[0].viscous, [torque; 2]);
    of.fitted("coefficient", coefficient, "V s/rad").physical(
        "torque_per_speed",
        torque,
        "N m s/rad",
    )
}

/// Viscous friction of both wheels that grows by 0.024 V s/rad in a second: to 0.6 V s/rad in 25 s.
pub(super) fn drying(m: &mut Physics, of: Concealed) -> Concealed {
    let rate = 0.024 * of.size;
    let torque = rate * m.motor.torque_per_volt();
    for friction in &mut m.friction {
        friction.drying += torque;
    }
    of.fitted("rate", rate, "V/rad")
        .physical("torque_per_angle", torque, "N m/rad")
}

/// Forwards 0.4 V and 0.1 V s/rad, backwards 1.2 V and 0.4 V s/rad.
pub(super) fn directional(m: &mut Physics, of: Concealed) -> Concealed {
    let [forward, backward, viscous_forward, viscous_backward] =
        [0.4, 1.2, 0.1, 0.4].map(|x| x * of.size);
    let g = m.motor.torque_per_volt();
    for friction in &mut m.friction {
        add(&mut friction.coulomb, [forward * g, backward * g]);
        add(
            &mut friction.viscous,
            [viscous_forward * g, viscous_backward * g],
        );
    }
    of.fitted("level_forward", forward, "V")
        .fitted("level_backward", backward, "V")
        .fitted("viscous_forward", viscous_forward, "V s/rad")
        .fitted("viscous_backward", viscous_backward, "V s/rad")
        .physical("torque_forward", forward * g, "N m")
        .physical("torque_backward", backward * g, "N m")
}

/// Drag that takes a fifth of the 9 V at the speed they give.
pub(super) fn drag(m: &mut Physics, of: Concealed) -> Concealed {
    let coefficient = 0.18 * of.size;
    let torque = coefficient * m.motor.torque_per_volt();
    for friction in &mut m.friction {
        friction.quadratic += torque;
    }
    of.fitted("coefficient", coefficient, "V s^2/rad^2")
        .physical("torque_per_square", torque, "N m s^2/rad^2")
}

/// Cogging of 1.2 V, 12 times per revolution, of the first shaft alone.
pub(super) fn ripple(m: &mut Physics, mut of: Concealed) -> Concealed {
    of.at.truncate(1);
    let amplitude = 1.2 * of.size;
    let torque = amplitude * m.motor.torque_per_volt();
    let (count, phase) = (12.0, 0.7f64);
    m.cogging[0] = Cogging {
        amplitude: torque,
        count,
        phase,
    };
    of.fitted("sine", -amplitude * phase.cos(), "V")
        .fitted("cosine", -amplitude * phase.sin(), "V")
        .fitted("count", count, "1")
        .physical("torque", torque, "N m")
}

/// Play of 2.9°, with teeth of 2 kN m/rad. As voltage times the time it takes that is the angle times
/// the back-emf constant at the shaft; the fitted effect has softer teeth that part without bouncing off.
pub(super) fn backlash(m: &mut Physics, mut of: Concealed) -> Concealed {
    let gap = Gap {
        gap: 0.05 * of.size,
        stiffness: 2000.0,
        damping: 2.0,
    };
    m.gap = Some(gap);
    of.approximate = true;
    let back_emf = m.robot.back_emf(m.body.wheel_radius);
    let damping = m.motor.torque_per_volt() * back_emf;
    of.fitted("play", gap.gap * back_emf, "V s")
        .fitted("rotor", m.motor.reflected_inertia / damping, "s")
        .physical("gap", gap.gap, "rad")
        .physical("stiffness", gap.stiffness, "N m/rad")
        .physical("damping", gap.damping, "N m s/rad")
        .physical("motor_inertia", m.motor.reflected_inertia, "kg m^2")
}

/// A weight that takes 1 V to hold; it pulls backwards.
pub(super) fn constant(m: &mut Physics, of: Concealed) -> Concealed {
    let level = of.size;
    let torque = level * m.motor.torque_per_volt();
    m.load.constant += torque;
    of.fitted("force", -level, "V")
        .physical("torque", torque, "N m")
}

/// An arm that takes 1.5 V to hold out.
pub(super) fn pendulum(m: &mut Physics, of: Concealed) -> Concealed {
    let level = 1.5 * of.size;
    let torque = level * m.motor.torque_per_volt();
    m.load.gravity += torque;
    of.fitted("cosine", -level, "V")
        .fitted("sine", 0.0, "V")
        .physical("torque", torque, "N m")
}

/// A spring of 0.6 V per radian.
pub(super) fn spring(m: &mut Physics, of: Concealed) -> Concealed {
    let stiffness = 0.6 * of.size;
    let torque = stiffness * m.motor.torque_per_volt();
    m.load.linear += torque;
    of.fitted("stiffness", stiffness, "V/rad")
        .fitted("rest", 0.0, "rad")
        .physical("torque_per_angle", torque, "N m/rad")
}

/// A spring of 0.06 V per cubic radian.
pub(super) fn hardening(m: &mut Physics, of: Concealed) -> Concealed {
    let stiffness = 0.06 * of.size;
    let torque = stiffness * m.motor.torque_per_volt();
    m.load.cubic += torque;
    of.fitted("stiffness", stiffness, "V/rad^3")
        .fitted("rest", 0.0, "rad")
        .physical("torque_per_cube", torque, "N m/rad^3")
}

/// A joint of 1.2 V per radian that slides at 2.4 V.
pub(super) fn hysteresis(m: &mut Physics, of: Concealed) -> Concealed {
    let (stiffness, onward, back) = (1.2 * of.size, 0.5, 0.2);
    let torque = stiffness * m.motor.torque_per_volt();
    m.joint = Hysteresis {
        stiffness: torque,
        onward,
        back,
        force: 0.0,
    };
    of.fitted("stiffness", stiffness, "V/rad")
        .fitted("onward", onward, "1/rad")
        .fitted("back", back, "1/rad")
        .physical("torque_per_angle", torque, "N m/rad")
}

/// A seal whose lips bend by 0.1 rad before they slide: at 0.8 V, and at 1.2 V when they break away.
pub(super) fn bristles(m: &mut Physics, of: Concealed) -> Concealed {
    let (level, excess, speed, way) = (0.8 * of.size, 0.5, 1.0, 0.1);
    let sliding = level * m.motor.torque_per_volt();
    m.seal = Bristles {
        stiffness: sliding / way,
        sliding,
        breakaway: excess * sliding,
        stribeck_speed: speed,
        torque: 0.0,
    };
    of.fitted("level", level, "V")
        .fitted("excess", excess, "1")
        .fitted("speed", speed, "rad/s")
        .fitted("way", way, "rad")
        .physical("sliding_torque", sliding, "N m")
        .physical("torque_per_angle", sliding / way, "N m/rad")
}

/// Stops 1.5 rad below and 2 rad above the start that give 0.15 rad to the 9 V of the motor.
pub(super) fn stops(m: &mut Physics, of: Concealed) -> Concealed {
    let at = [-1.5, 2.0].map(|angle| angle / of.size);
    let volts_per_angle = 60.0;
    let stops = Stops {
        at,
        stiffness: volts_per_angle * m.motor.torque_per_volt(),
        absorbed: 0.2,
    };
    m.stops = Some(stops);
    of.fitted("lower", at[0], "rad")
        .fitted("upper", at[1], "rad")
        .fitted("stiffness", volts_per_angle, "V/rad")
        .fitted("loss", stops.loss(), "s/rad")
        .physical("torque_per_angle", stops.stiffness, "N m/rad")
        .physical("absorbed", stops.absorbed, "s/rad")
}
