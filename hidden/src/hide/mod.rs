//! What each effect of each size changes in a machine.

mod body;
mod effort;
mod input;
mod output;

use crate::driven::Driven;
use crate::error::HiddenError;
use crate::physics::Physics;
use crate::truth::Concealed;
use crate::{Hidden, Hidden as H};

const WHEELS: &[&str] = &["wheel.right", "wheel.left"];
const SHAFT: &[&str] = &["shaft"];

/// Builds `effect` into the machine and says what is true then.
pub(crate) fn hide(
    machine: &mut Physics,
    effect: Hidden,
    size: f64,
) -> Result<Concealed, HiddenError> {
    check(effect, size)?;
    let not_here = HiddenError::NotHere {
        effect,
        robot: machine.robot.name(),
    };
    if !fits(effect, machine.robot) {
        return Err(not_here);
    }
    let shafts = match machine.robot {
        Driven::Twil => WHEELS,
        Driven::Axis => SHAFT,
    };
    let concealed = Concealed::new(effect, size, shafts);
    Ok(match effect {
        H::CoulombFriction => effort::coulomb(machine, concealed),
        H::StribeckFriction => effort::stribeck(machine, concealed),
        H::ViscousFriction => effort::viscous(machine, concealed),
        H::DirectionalFriction => effort::directional(machine, concealed),
        H::FrictionDrift => effort::drying(machine, concealed),
        H::QuadraticDrag => effort::drag(machine, concealed),
        H::TorqueRipple => effort::ripple(machine, concealed),
        H::Backlash => effort::backlash(machine, concealed),
        H::ConstantForce => effort::constant(machine, concealed),
        H::GravityPendulum => effort::pendulum(machine, concealed),
        H::LinearStiffness => effort::spring(machine, concealed),
        H::CubicStiffness => effort::hardening(machine, concealed),
        H::Hysteresis => effort::hysteresis(machine, concealed),
        H::LugreFriction => effort::bristles(machine, concealed),
        H::EndStop => effort::stops(machine, concealed),
        H::Overflow => return Err(not_here),
        H::ScrubFriction => body::scrub(machine, concealed),
        H::GravitySlope => body::slope(machine, concealed),
        H::CentrifugalOffset => body::offset(machine, concealed),
        H::WheelSlip => body::slip(machine, concealed),
        H::PayloadChange => body::payload(machine, concealed),
        H::ElasticCoupling => body::coupling(machine, concealed),
        H::DeadZone => input::dead_zone(machine, concealed),
        H::InputSaturation => input::saturation(machine, concealed),
        H::InputPower => input::power(machine, concealed),
        H::InputDelay => input::delay(machine, concealed),
        H::InputLead => input::logged_late(machine, concealed),
        H::ActuatorLag => input::lag(machine, concealed),
        H::BridgeCoast => input::coast(machine, concealed),
        H::PulseCoast => input::pulses(machine, concealed),
        H::InputOffset => input::offset(machine, concealed),
        H::GainAsymmetry => input::asymmetry(machine, concealed),
        H::GainDrift => input::discharge(machine, concealed),
        H::BatterySag => input::sag(machine, concealed),
        H::WindingHeating => input::heating(machine, concealed),
        H::SensorDelay => output::delay(machine, concealed),
        H::SensorLag => output::lag(machine, concealed),
        H::SensorWindow => output::window(machine, concealed),
        H::SensorOffset => output::offset(machine, concealed),
        H::SensorScale => output::scale(machine, concealed),
        H::WheelRadiusMismatch => output::radius(machine, concealed),
        H::SensorMagnitude => output::magnitude(machine, concealed),
        H::EncoderRipple => output::ripple(machine, concealed),
    })
}

/// Whether a size makes sense.
pub(crate) fn check(effect: Hidden, size: f64) -> Result<(), HiddenError> {
    let largest = largest(effect);
    if size > 0.0 && size <= largest {
        return Ok(());
    }
    Err(HiddenError::Size {
        effect,
        size,
        largest,
    })
}

/// Above this size the formula of the effect makes no sense.
pub(crate) fn largest(effect: Hidden) -> f64 {
    match effect {
        // The centre of mass would be further out than the inertia allows.
        H::CentrifugalOffset => 2.1,
        // The limit would be 0.
        H::InputSaturation => 4.0,
        // The tank would have no wall, and the arm no way.
        H::Overflow | H::EndStop => 4.0,
        // The battery would be empty at the end.
        H::GainDrift => 6.0,
        // The bearings would have less than no friction.
        H::BridgeCoast | H::PulseCoast => 1.0,
        _ => 10.0,
    }
}

fn fits(effect: Hidden, robot: Driven) -> bool {
    match effect {
        H::ConstantForce
        | H::GravityPendulum
        | H::LinearStiffness
        | H::CubicStiffness
        | H::Hysteresis
        | H::LugreFriction
        | H::EndStop
        | H::ElasticCoupling
        | H::SensorMagnitude => robot == Driven::Axis,
        H::ScrubFriction
        | H::GravitySlope
        | H::CentrifugalOffset
        | H::WheelSlip
        | H::GainAsymmetry
        | H::WheelRadiusMismatch => robot == Driven::Twil,
        _ => true,
    }
}
