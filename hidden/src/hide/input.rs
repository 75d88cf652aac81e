//! Effects between command and motor torque: amplifiers, battery, windings.

use crate::amplifier::{AmplifierParts, Pulses};
use crate::driven::Driven;
use crate::driven::Motor;
use crate::experiment::PERIOD;
use crate::machine::STEP;
use crate::motor::{COPPER, Heat};
use crate::physics::Physics;
use crate::truth::Concealed;

fn at_inputs(m: &mut Physics, of: &mut Concealed) {
    of.at = match m.robot {
        Driven::Twil => vec!["input.right", "input.left"],
        Driven::Axis => vec!["input"],
    };
}

fn each(m: &mut Physics, of: &mut Concealed, change: impl Fn(&mut AmplifierParts)) {
    at_inputs(m, of);
    m.amplifiers.iter_mut().for_each(change);
}

/// 0.9 V are lost.
pub(super) fn dead_zone(m: &mut Physics, mut of: Concealed) -> Concealed {
    let threshold = 0.9 * of.size;
    each(m, &mut of, |a| a.dead_zone += threshold);
    of.fitted("threshold", threshold, "V")
}

/// No more than 7 V; 2 V less per unit of size.
pub(super) fn saturation(m: &mut Physics, mut of: Concealed) -> Concealed {
    let limit = 9.0 - 2.0 * of.size;
    each(m, &mut of, |a| a.limit = limit);
    of.fitted("limit", limit, "V")
}

/// Speed controllers with a throttle curve: of the battery's 12 V they give the commanded share to the power 1.5.
pub(super) fn power(m: &mut Physics, mut of: Concealed) -> Concealed {
    let exponent = 1.0 + 0.5 * of.size;
    let full = m.battery.open_circuit;
    each(m, &mut of, |a| {
        a.exponent = exponent;
        a.full = full;
    });
    of.fitted("exponent", exponent, "1")
        .physical("full_command", full, "V")
}

/// 30 ms late.
pub(super) fn delay(m: &mut Physics, mut of: Concealed) -> Concealed {
    let delay = 0.03 * of.size;
    each(m, &mut of, |a| a.delay += delay);
    of.fitted("delay", delay, "s")
}

/// The log is written two cycles after the command of its line was sent.
pub(super) fn logged_late(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_inputs(m, &mut of);
    let cycles = (2.0 * of.size).round().max(1.0);
    m.logged_late += cycles as usize;
    of.fitted("lead", cycles * PERIOD, "s")
        .physical("cycles", cycles, "1")
}

/// A filter of 40 ms.
pub(super) fn lag(m: &mut Physics, mut of: Concealed) -> Concealed {
    let lag = 0.04 * of.size;
    each(m, &mut of, |a| a.lag = lag);
    of.fitted("lag", lag, "s")
}

/// All switches of a bridge open at command zero. Below a size of 1 the motor has weaker magnets, fewer turns and
/// more friction in its bearings: driven it is the same machine, but less of its damping is electrical.
pub(super) fn coast(m: &mut Physics, mut of: Concealed) -> Concealed {
    each(m, &mut of, |a| a.coasts = true);
    let share = weaken(&mut m.motor, of.size);
    let friction = m.motor.rotor_friction;
    of.fitted("share", share, "1")
        .physical("rotor_friction", friction, "N m s/rad")
}

/// Length of a pulse and its pause, in steps of integration.
const PULSES: u32 = 20;

/// Pulses of 500 Hz on the enable pins: in the pauses all switches are open. Below a size of 1 the motor is weaker, as
/// for [`coast`]. The current runs on for a while after each pulse.
pub(super) fn pulses(m: &mut Physics, mut of: Concealed) -> Concealed {
    let supply = m.battery.open_circuit;
    each(m, &mut of, |a| {
        a.pulses = Some(Pulses {
            supply,
            period: PULSES,
        })
    });
    let share = weaken(&mut m.motor, of.size);
    let friction = m.motor.rotor_friction;
    let winding = m.motor.inductance / m.motor.resistance;
    let period = f64::from(PULSES) * STEP;
    // At a reference that is the supply; another one is another damping, and other values.
    of.approximate = true;
    of.fitted("share", share, "1")
        .fitted("run_on", winding / period, "1")
        .physical("reference", supply, "V")
        .physical("rotor_friction", friction, "N m s/rad")
}

/// Gives a motor weaker magnets, fewer turns and more friction in its bearings: driven it is the same machine, but only
/// `size` times as much of its damping is electrical. That share.
fn weaken(motor: &mut Motor, size: f64) -> f64 {
    let braking = motor.torque_constant * motor.back_emf_constant / motor.resistance;
    let damping = braking + motor.rotor_friction;
    motor.torque_constant *= size;
    motor.back_emf_constant *= size;
    motor.resistance *= size;
    motor.inductance *= size;
    motor.rotor_friction = damping - size * braking;
    size * braking / damping
}

/// 0.6 V too much on one motor.
pub(super) fn offset(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_inputs(m, &mut of);
    of.at.truncate(1);
    let offset = 0.6 * of.size;
    m.amplifiers[0].offset += offset;
    of.fitted("offset", offset, "V")
}

/// The right motor gets 8 % more, the left one 8 % less.
pub(super) fn asymmetry(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_inputs(m, &mut of);
    let share = 0.08 * of.size;
    m.amplifiers[0].gain *= 1.0 + share;
    m.amplifiers[1].gain *= 1.0 - share;
    of.fitted("difference", share, "1")
}

/// The battery's voltage falls by 0.6 % of its first value in a second, whatever the motors do.
pub(super) fn discharge(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_inputs(m, &mut of);
    let share = 0.006 * of.size;
    m.battery.discharge += share * m.battery.open_circuit;
    of.fitted("rate", -share, "1/s")
        .physical("discharge", m.battery.discharge, "V/s")
}

/// An internal resistance of 2 Ohm behind 12 V.
pub(super) fn sag(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_inputs(m, &mut of);
    let resistance = 2.0 * of.size;
    m.battery.resistance += resistance;
    let supply = m.battery.open_circuit;
    let share = resistance / (m.motor.resistance * supply.powi(2));
    of.fitted("resistance", share, "1/V^2")
        .physical("internal_resistance", resistance, "Ohm")
        .physical("winding_resistance", m.motor.resistance, "Ohm")
        .physical("open_circuit_voltage", supply, "V")
}

/// Windings that hold 0.45 J/K: within 25 s of PRBS their resistance grows by a sixth.
pub(super) fn heating(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_inputs(m, &mut of);
    let heat = Heat {
        capacity: 0.45 / of.size,
        resistance: 60.0 * of.size,
    };
    m.heat = Some(heat);
    let heating = COPPER / (heat.capacity * m.motor.resistance);
    of.fitted("heating", heating, "1/V^2/s")
        .fitted("cooling", 1.0 / (heat.capacity * heat.resistance), "1/s")
        .physical("heat_capacity", heat.capacity, "J/K")
        .physical("thermal_resistance", heat.resistance, "K/W")
        .physical("temperature_coefficient", COPPER, "1/K")
}
