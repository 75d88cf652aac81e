//! Everything a machine is made of, effects included.

use crate::amplifier::AmplifierParts;
use crate::bristles::Bristles;
use crate::contact::{Gap, Stops, Twisting, Tyre};
use crate::driven::{Body, Driven, Motor};
use crate::friction::Friction;
use crate::hysteresis::Hysteresis;
use crate::motor::{Battery, Heat};
use crate::odometry::OdometryParts;

/// Acceleration of gravity, m/s².
pub(crate) const GRAVITY: f64 = 9.81;
/// Voltage of the battery without load, V.
pub(crate) const SUPPLY: f64 = 12.0;

/// Torque that comes and goes with the angle of a shaft: `-amplitude sin(count φ + phase)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cogging {
    /// N m.
    pub(crate) amplitude: f64,
    /// Periods per revolution.
    pub(crate) count: f64,
    /// rad.
    pub(crate) phase: f64,
}

/// What loads the shaft of the axis:
/// `-constant - gravity cos(φ) - linear φ - cubic φ³`, N m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Load {
    /// Weight on a rope, N m.
    pub(crate) constant: f64,
    /// Weight times lever of an arm that is horizontal at `φ = 0`, N m.
    pub(crate) gravity: f64,
    /// Spring, N m/rad.
    pub(crate) linear: f64,
    /// Hardening spring, N m/rad³.
    pub(crate) cubic: f64,
}

impl Load {
    /// The torque at an angle, N m.
    pub(crate) fn torque(&self, angle: f64) -> f64 {
        let arm = if self.gravity == 0.0 {
            0.0
        } else {
            self.gravity * angle.cos()
        };
        -self.constant - arm - (self.linear + self.cubic * angle * angle) * angle
    }
}

/// A plane that rises by `angle` rad towards the heading `direction` rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slope {
    pub(crate) angle: f64,
    pub(crate) direction: f64,
}

/// Something that is put on board while the robot drives, at rest before: momentum is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Payload {
    /// When, s.
    pub(crate) time: f64,
    /// Mass, kg; on the axis inertia, kg m².
    pub(crate) mass: f64,
    /// Inertia about the vertical axis, kg m².
    pub(crate) inertia: f64,
}

/// A machine, completely described.
#[derive(Clone, Debug)]
pub(crate) struct Physics {
    pub(crate) robot: Driven,
    pub(crate) motor: Motor,
    pub(crate) body: Body,
    pub(crate) amplifiers: [AmplifierParts; 2],
    pub(crate) battery: Battery,
    pub(crate) heat: Option<Heat>,
    /// At the shafts behind the gears.
    pub(crate) friction: [Friction; 2],
    /// Dry friction of tyres and castor against turning, N m.
    pub(crate) scrub: f64,
    pub(crate) cogging: [Cogging; 2],
    pub(crate) gap: Option<Gap>,
    /// Behind the shaft of the axis.
    pub(crate) twisting: Option<Twisting>,
    pub(crate) tyre: Option<Tyre>,
    pub(crate) load: Load,
    /// Between the shaft of the axis and the ground.
    pub(crate) joint: Hysteresis,
    /// On the shaft of the axis.
    pub(crate) seal: Bristles,
    /// Of the axis.
    pub(crate) stops: Option<Stops>,
    pub(crate) slope: Option<Slope>,
    /// Centre of mass ahead of the axle, m.
    pub(crate) mass_offset: f64,
    pub(crate) payload: Option<Payload>,
    /// Periods from the command to its line in a log.
    pub(crate) logged_late: usize,
    pub(crate) odometry: OdometryParts,
}

impl Physics {
    /// The machine without any hidden effect.
    pub(crate) fn clean(robot: Driven) -> Self {
        let (motor, body) = robot.parts();
        Self {
            robot,
            motor,
            body,
            amplifiers: [AmplifierParts::default(); 2],
            battery: Battery {
                open_circuit: SUPPLY,
                resistance: 0.0,
                discharge: 0.0,
            },
            heat: None,
            friction: [Friction::default(); 2],
            scrub: 0.0,
            cogging: [Cogging::default(); 2],
            gap: None,
            twisting: None,
            tyre: None,
            load: Load::default(),
            joint: Hysteresis::default(),
            seal: Bristles::default(),
            stops: None,
            slope: None,
            mass_offset: 0.0,
            payload: None,
            logged_late: 0,
            odometry: OdometryParts::new(robot, &body),
        }
    }

    /// Velocity of each shaft per velocity of the body: `φ' = J u`, with `u = (v, ω)` of the robot
    /// and the shaft's own speed on the axis.
    pub(crate) fn jacobian(&self) -> [[f64; 2]; 2] {
        let r = self.body.wheel_radius;
        let b = self.body.half_track;
        match self.robot {
            Driven::Twil => [[1.0 / r, b / r], [1.0 / r, -b / r]],
            Driven::Axis => [[1.0, 0.0], [0.0, 0.0]],
        }
    }
}
