//! What the robot declares: parameters, signals and channels.

use loopsight_core::{Channel, Derived, Parameter, Place, Reads, Role, Signal, Tie, Unshown};

pub(super) const LUMPED: [Parameter; 8] = [
    Parameter::new(
        "K_A",
        "K_A",
        "1/s",
        "forward damping: back-emf and viscous friction over mass",
    )
    .within(f64::NEG_INFINITY, 0.0)
    .scaled(1.0),
    Parameter::new(
        "K_B",
        "K_B",
        "m/rad^2",
        "forward acceleration by turning: centre of mass ahead of the axle",
    )
    .scaled(0.1),
    Parameter::new(
        "K_C",
        "K_C",
        "m/s^2/V",
        "forward acceleration per volt on each motor",
    )
    .scaled(0.1)
    .nonzero(),
    Parameter::new(
        "K_D",
        "K_D",
        "1/s",
        "yaw damping: back-emf and viscous friction over inertia",
    )
    .within(f64::NEG_INFINITY, 0.0)
    .scaled(1.0),
    Parameter::new(
        "K_E",
        "K_E",
        "1/m",
        "yaw acceleration by turning while driving: centre of mass off the axle",
    )
    .scaled(1.0),
    Parameter::new(
        "K_F",
        "K_F",
        "rad/s^2/V",
        "yaw acceleration per volt of difference",
    )
    .scaled(0.1)
    .nonzero(),
    Parameter::new(
        "half_track",
        "b",
        "m",
        "half the distance between the wheels",
    )
    .above(0.0)
    .known()
    .nonlinear()
    .scaled(0.1),
    Parameter::new("wheel_radius", "r", "m", "wheel radius")
        .above(0.0)
        .known()
        .nonlinear()
        .scaled(0.1),
];

pub(super) const PHYSICAL: [Parameter; 11] = [
    Parameter::new("mass", "m", "kg", "mass of the robot, wheels included")
        .above(0.0)
        .nonlinear(),
    Parameter::new(
        "yaw_inertia",
        "I",
        "kg m^2",
        "moment of inertia about the vertical axis through the centre of mass",
    )
    .above(0.0)
    .nonlinear()
    .scaled(0.1),
    Parameter::new("mass_offset", "d", "m", "centre of mass ahead of the axle")
        .or(0.0)
        .nonlinear()
        .scaled(0.01),
    Parameter::new("wheel_radius", "r", "m", "wheel radius")
        .above(0.0)
        .known()
        .nonlinear()
        .scaled(0.1),
    Parameter::new(
        "half_track",
        "b",
        "m",
        "half the distance between the wheels",
    )
    .above(0.0)
    .known()
    .nonlinear()
    .scaled(0.1),
    Parameter::new(
        "torque_constant",
        "K_T",
        "N m/A",
        "torque constant of a motor",
    )
    .above(0.0)
    .known()
    .nonlinear()
    .scaled(0.01),
    Parameter::new(
        "back_emf_constant",
        "K_a",
        "V s/rad",
        "back-emf constant of a motor",
    )
    .above(0.0)
    .known()
    .nonlinear()
    .scaled(0.01),
    Parameter::new("resistance", "R_a", "Ohm", "armature resistance of a motor")
        .above(0.0)
        .known()
        .nonlinear(),
    Parameter::new(
        "gear_ratio",
        "n",
        "1",
        "wheel speed over motor speed, below 1 for a reduction gear",
    )
    .above(0.0)
    .known()
    .nonlinear()
    .scaled(0.1),
    Parameter::new(
        "rotor_inertia",
        "J",
        "kg m^2",
        "moment of inertia of a rotor",
    )
    .within(0.0, f64::INFINITY)
    .or(0.0)
    .known()
    .nonlinear()
    .scaled(1e-5),
    Parameter::new(
        "viscous_friction",
        "f",
        "N m s/rad",
        "viscous friction at a rotor",
    )
    .within(0.0, f64::INFINITY)
    .or(0.0)
    .nonlinear()
    .scaled(1e-5),
];

pub(super) const STATES: [Signal; 6] = [
    Signal::new(
        "linear_velocity",
        "v",
        "m/s",
        "forward speed midway between the wheels",
    )
    .sized(0.05),
    Signal::new(
        "angular_velocity",
        "ω",
        "rad/s",
        "yaw rate, positive to the left",
    )
    .sized(0.4),
    Signal::new("heading", "θ", "rad", "heading, positive to the left").sized(0.4),
    Signal::new("travel", "s", "m", "distance travelled along the path").sized(0.05),
    Signal::new("position_x", "x", "m", "position, x"),
    Signal::new("position_y", "y", "m", "position, y"),
];

pub(super) const INPUTS: [Signal; 2] = [
    Signal::new("voltage_right", "V_r", "V", "voltage on the right motor"),
    Signal::new("voltage_left", "V_l", "V", "voltage on the left motor"),
];

pub(super) const OUTPUTS: [Signal; 12] = [
    Signal::new(
        "shaft_speed_right",
        "φ'_r",
        "rad/s",
        "speed of the right wheel's shaft",
    ),
    Signal::new(
        "shaft_speed_left",
        "φ'_l",
        "rad/s",
        "speed of the left wheel's shaft",
    ),
    Signal::new(
        "track_speed_right",
        "v_r",
        "m/s",
        "speed of the right wheel over ground",
    )
    .sized(0.05),
    Signal::new(
        "track_speed_left",
        "v_l",
        "m/s",
        "speed of the left wheel over ground",
    )
    .sized(0.05),
    Signal::new(
        "shaft_angle_right",
        "φ_r",
        "rad",
        "angle of the right wheel's shaft since the start",
    ),
    Signal::new(
        "shaft_angle_left",
        "φ_l",
        "rad",
        "angle of the left wheel's shaft since the start",
    ),
    Signal::new(
        "supply_load",
        "Σ V U",
        "V^2",
        "load on the common supply: commands times armature voltages",
    ),
    Signal::new(
        "stall_load",
        "Σ V²",
        "V^2",
        "load on the common supply if the motors stood still",
    ),
    Signal::new(
        "armature_right",
        "U_r",
        "V",
        "voltage over the right motor's winding, V_r less what K_A and K_D take at this speed",
    ),
    Signal::new(
        "armature_left",
        "U_l",
        "V",
        "voltage over the left motor's winding, V_l less what K_A and K_D take at this speed",
    ),
    Signal::new(
        "centrifugal_forward",
        "ω²",
        "rad^2/s^2",
        "forward acceleration by turning, per metre of the centre of mass ahead of the axle",
    ),
    Signal::new(
        "centrifugal_yaw",
        "-vω",
        "m rad/s^2",
        "yaw acceleration by turning while driving, per unit of its coefficient",
    ),
];

pub(super) const INTEGRALS: [(&str, &str); 4] = [
    ("linear_velocity", "travel"),
    ("angular_velocity", "heading"),
    ("shaft_speed_right", "shaft_angle_right"),
    ("shaft_speed_left", "shaft_angle_left"),
];

pub(super) const WHEEL_RIGHT: [Reads; 8] = [
    Reads(Role::Flow, "shaft_speed_right"),
    Reads(Role::Position, "shaft_angle_right"),
    Reads(Role::Drive, "voltage_right"),
    Reads(Role::Heading, "heading"),
    Reads(Role::Load, "supply_load"),
    Reads(Role::Stall, "stall_load"),
    Reads(Role::Armature, "armature_right"),
    Reads(Role::Shaft, "shaft_angle_right"),
];
pub(super) const WHEEL_LEFT: [Reads; 8] = [
    Reads(Role::Flow, "shaft_speed_left"),
    Reads(Role::Position, "shaft_angle_left"),
    Reads(Role::Drive, "voltage_left"),
    Reads(Role::Heading, "heading"),
    Reads(Role::Load, "supply_load"),
    Reads(Role::Stall, "stall_load"),
    Reads(Role::Armature, "armature_left"),
    Reads(Role::Shaft, "shaft_angle_left"),
];
pub(super) const BODY_FORWARD: [Reads; 5] = [
    Reads(Role::Flow, "linear_velocity"),
    Reads(Role::Position, "travel"),
    Reads(Role::Heading, "heading"),
    Reads(Role::Forward, "linear_velocity"),
    Reads(Role::Centrifugal, "centrifugal_forward"),
];
pub(super) const BODY_YAW: [Reads; 5] = [
    Reads(Role::Flow, "angular_velocity"),
    Reads(Role::Position, "heading"),
    Reads(Role::Heading, "heading"),
    Reads(Role::Yaw, "angular_velocity"),
    Reads(Role::Centrifugal, "centrifugal_yaw"),
];

pub(super) const CHANNELS: [Channel; 14] = [
    Channel {
        id: "wheel.right",
        place: Place::Effort(0),
        unit: "V",
        equation: "V_r -> V_r + w",
        reads: &WHEEL_RIGHT,
        side: 1,
        size: 1.0,
        doc: "shaft of the right wheel; efforts in volts of equivalent motor voltage",
    },
    Channel {
        id: "wheel.left",
        place: Place::Effort(1),
        unit: "V",
        equation: "V_l -> V_l + w",
        reads: &WHEEL_LEFT,
        side: -1,
        size: 1.0,
        doc: "shaft of the left wheel; efforts in volts of equivalent motor voltage",
    },
    Channel {
        id: "body.forward",
        place: Place::Effort(2),
        unit: "m/s^2",
        equation: "v' -> v' + w",
        reads: &BODY_FORWARD,
        side: 1,
        size: 0.25,
        doc: "the body along its heading; efforts as acceleration",
    },
    Channel {
        id: "body.yaw",
        place: Place::Effort(3),
        unit: "rad/s^2",
        equation: "ω' -> ω' + w",
        reads: &BODY_YAW,
        side: -1,
        size: 1.0,
        doc: "the body about the vertical; efforts as angular acceleration",
    },
    Channel {
        id: "inertia.forward",
        place: Place::Rate(0),
        unit: "m/s^2",
        equation: "v' -> v' + w(v')",
        reads: &BODY_FORWARD,
        side: 1,
        size: 0.25,
        doc: "the forward acceleration itself: where mass acts",
    },
    Channel {
        id: "inertia.yaw",
        place: Place::Rate(1),
        unit: "rad/s^2",
        equation: "ω' -> ω' + w(ω')",
        reads: &BODY_YAW,
        side: -1,
        size: 1.0,
        doc: "the yaw acceleration itself: where inertia acts",
    },
    Channel {
        id: "input.right",
        place: Place::Input(0),
        unit: "V",
        equation: "V_r -> V_r + w(V_r)",
        reads: &WHEEL_RIGHT,
        side: 1,
        size: 1.0,
        doc: "between the commanded and the effective voltage of the right motor",
    },
    Channel {
        id: "input.left",
        place: Place::Input(1),
        unit: "V",
        equation: "V_l -> V_l + w(V_l)",
        reads: &WHEEL_LEFT,
        side: -1,
        size: 1.0,
        doc: "between the commanded and the effective voltage of the left motor",
    },
    Channel {
        id: "sensor.linear_velocity",
        place: Place::Output(0),
        unit: "m/s",
        equation: "v_measured = v + w",
        reads: &BODY_FORWARD,
        side: 0,
        size: 0.05,
        doc: "measurement of the forward speed",
    },
    Channel {
        id: "sensor.angular_velocity",
        place: Place::Output(1),
        unit: "rad/s",
        equation: "ω_measured = ω + w",
        reads: &BODY_YAW,
        side: 0,
        size: 0.4,
        doc: "measurement of the yaw rate",
    },
    Channel {
        id: "sensor.track_speed_right",
        place: Place::Output(10),
        unit: "m/s",
        equation: "v_r_measured = v_r + w",
        reads: &WHEEL_RIGHT,
        side: 1,
        size: 0.05,
        doc: "measurement of the right wheel's speed over ground",
    },
    Channel {
        id: "sensor.track_speed_left",
        place: Place::Output(11),
        unit: "m/s",
        equation: "v_l_measured = v_l + w",
        reads: &WHEEL_LEFT,
        side: -1,
        size: 0.05,
        doc: "measurement of the left wheel's speed over ground",
    },
    Channel {
        id: "encoder.right",
        place: Place::Output(12),
        unit: "rad",
        equation: "φ_r_counted = φ_r + w",
        reads: &WHEEL_RIGHT,
        side: 1,
        size: 1.0,
        doc: "the right wheel's encoder, behind every signal that is made from its counts",
    },
    Channel {
        id: "encoder.left",
        place: Place::Output(13),
        unit: "rad",
        equation: "φ_l_counted = φ_l + w",
        reads: &WHEEL_LEFT,
        side: -1,
        size: 1.0,
        doc: "the left wheel's encoder, behind every signal that is made from its counts",
    },
];

/// A vehicle whose sides are alike and do not feel each other obeys `v_i' = K_A v_i + 2 K_C V_i` on each of them: then
/// `K_D = K_A` and `K_F = K_C/b`. So it is where `I + m d² = m b²`, and WPILib's SysId assumes it.
pub(super) const UNSHOWN: [Unshown; 2] = [
    Unshown {
        what: "turning",
        shown_by: &[("voltage_right", 1.0), ("voltage_left", -1.0)],
        ties: &[
            Tie {
                parameter: "K_D",
                factors: &[("K_A", 1)],
            },
            Tie {
                parameter: "K_F",
                factors: &[("K_C", 1), ("half_track", -1)],
            },
        ],
        channels: &["body.yaw"],
        still: &[Role::Heading, Role::Yaw],
        because: "each side moved alone",
    },
    Unshown {
        what: "driving straight",
        shown_by: &[("voltage_right", 1.0), ("voltage_left", 1.0)],
        ties: &[
            Tie {
                parameter: "K_A",
                factors: &[("K_D", 1)],
            },
            Tie {
                parameter: "K_C",
                factors: &[("K_F", 1), ("half_track", 1)],
            },
        ],
        channels: &["body.forward"],
        still: &[Role::Forward],
        because: "each side moved alone",
    },
];

/// The terms of a feedforward for driving straight, per volt on each motor.
pub(super) const FEEDFORWARD: [Derived; 2] = [
    Derived::new(
        "kV",
        "V s/m",
        "-K_A/(2 K_C)",
        "voltage on each motor per forward speed",
    ),
    Derived::new(
        "kA",
        "V s^2/m",
        "1/(2 K_C)",
        "voltage on each motor per forward acceleration",
    ),
];
