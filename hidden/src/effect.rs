//! What can be hidden, by the ids that the diagnosis uses.

use std::fmt;
use std::str::FromStr;

use crate::error::HiddenError;
use crate::robot::Robot;

macro_rules! effects {
    ($($variant:ident $id:literal $home:ident $doc:literal,)*) => {
        /// An effect that a recording can hide.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Hidden {
            $(#[doc = $doc] $variant,)*
        }

        impl Hidden {
            /// All of them.
            pub const ALL: &'static [Hidden] = &[$(Hidden::$variant,)*];

            /// The effect's id, e.g. `coulomb_friction`.
            pub fn id(self) -> &'static str {
                match self { $(Hidden::$variant => $id,)* }
            }

            /// One line: what is hidden.
            pub fn doc(self) -> &'static str {
                match self { $(Hidden::$variant => $doc,)* }
            }

            /// The machine on which it is shown first, one of motors and wheels where these can have it; [`catalogue`] has the
            /// others.
            pub fn home(self) -> Robot {
                match self { $(Hidden::$variant => Robot::$home,)* }
            }
        }
    };
}

/// What is shown on which machine: every effect at [`Hidden::home`], then what the other machines
/// hide.
pub fn catalogue() -> Vec<(Robot, Hidden)> {
    let homes = Hidden::ALL.iter().map(|effect| (effect.home(), *effect));
    let rigs = Robot::ALL.into_iter().flat_map(|robot| {
        robot
            .rig_effects()
            .iter()
            .filter(move |effect| effect.home() != robot)
            .map(move |effect| (robot, *effect))
    });
    homes.chain(rigs).collect()
}

effects! {
    CoulombFriction "coulomb_friction" Twil "dry friction of both wheels",
    StribeckFriction "stribeck_friction" Twil "dry friction of both wheels, higher when breaking away",
    ViscousFriction "viscous_friction" Twil "viscous friction of the right wheel alone",
    DirectionalFriction "directional_friction" Twil "dry and viscous friction of both wheels, higher backwards",
    FrictionDrift "friction_drift" Twil "bearings of both wheels that lose their oil",
    QuadraticDrag "quadratic_drag" Twil "drag of both wheels, with the square of the speed",
    ScrubFriction "scrub_friction" Twil "dry friction against turning",
    TorqueRipple "torque_ripple" Twil "cogging of the right wheel, 12 times per revolution",
    Backlash "backlash" Axis "play between motor and load; the encoder sits at the load",
    ConstantForce "constant_force" Axis "a weight on a rope",
    GravitySlope "gravity_slope" Twil "a floor that is not level",
    GravityPendulum "gravity_pendulum" Axis "an arm, horizontal at angle 0",
    LinearStiffness "linear_stiffness" Axis "a spring that pulls back to angle 0",
    CubicStiffness "cubic_stiffness" Axis "a hardening spring without linear part",
    EndStop "end_stop" Axis "rubber stops at both ends of the way",
    Overflow "overflow" TankPair "an upper tank that runs over its edge",
    Hysteresis "hysteresis" Axis "a rubber joint to the ground, whose force depends on the way it came",
    LugreFriction "lugre_friction" Axis "a seal whose lips bend before they slide",
    CentrifugalOffset "centrifugal_offset" Twil "centre of mass ahead of the axle",
    WheelSlip "wheel_slip" Twil "tyres on a slippery floor; odometry from undriven measuring wheels",
    DeadZone "dead_zone" Twil "amplifiers that do nothing below a threshold",
    InputSaturation "input_saturation" Twil "amplifiers that stop below the commanded 9 V",
    InputPower "input_power" Twil "speed controllers whose voltage goes with a power of the command",
    InputDelay "input_delay" Twil "commands that take effect late",
    InputLead "input_lead" Twil "commands that the log writes down after they were sent",
    ActuatorLag "actuator_lag" Twil "a filter before both amplifiers",
    BridgeCoast "bridge_coast" Twil "motor drivers that let go of the motors at command zero",
    PulseCoast "pulse_coast" Twil "motor drivers that let go of the motors in the pauses of their pulses",
    InputOffset "input_offset" Twil "a bias on the right amplifier",
    GainAsymmetry "gain_asymmetry" Twil "right amplifier stronger, left one weaker",
    GainDrift "gain_drift" Twil "a battery that runs down under what else is on board",
    BatterySag "battery_sag" Twil "a battery with internal resistance",
    WindingHeating "winding_heating" Twil "windings that grow warm and resistive",
    PayloadChange "payload_change" Twil "a load put on board while driving",
    ElasticCoupling "elastic_coupling" Axis "a part of the inertia behind a long shaft; the encoder sits at the motor",
    SensorDelay "sensor_delay" Twil "odometry that is read late",
    SensorLag "sensor_lag" Twil "odometry from filtered counts",
    SensorWindow "sensor_window" Twil "speeds that are moving means of differences of counts",
    SensorOffset "sensor_offset" Twil "a bias on the measured yaw rate",
    SensorScale "sensor_scale" Twil "a wrong scale on the measured forward speed",
    WheelRadiusMismatch "wheel_radius_mismatch" Twil "measuring wheels, undriven, the right one larger and the left one smaller than odometry believes",
    SensorMagnitude "sensor_magnitude" Axis "a tachometer that counts marks on the shaft, whichever way they pass",
    EncoderRipple "encoder_ripple" Twil "an encoder disc, the right one, that does not turn about its centre",
}

impl fmt::Display for Hidden {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

impl Hidden {
    /// Half the size that the examples have, that size and twice of it; or of the largest that makes sense a
    /// quarter, half and all.
    pub fn sizes(self) -> [f64; 3] {
        let most = crate::hide::largest(self).min(2.0);
        [0.25, 0.5, 1.0].map(|share| share * most)
    }
}

impl FromStr for Hidden {
    type Err = HiddenError;

    fn from_str(id: &str) -> Result<Self, HiddenError> {
        Hidden::ALL
            .iter()
            .copied()
            .find(|h| h.id() == id)
            .ok_or_else(|| HiddenError::UnknownEffect { id: id.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_unique_and_read_back() {
        for effect in Hidden::ALL {
            assert_eq!(effect.id().parse::<Hidden>().unwrap(), *effect);
        }
        assert!("friction".parse::<Hidden>().is_err());
    }
}
