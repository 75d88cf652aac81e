//! Effects between the motion and the number in the log.

use crate::driven::Driven;
use crate::experiment::PERIOD;
use crate::odometry::Eccentricity;
use crate::physics::Physics;
use crate::truth::Concealed;

fn at_sensors(m: &Physics, of: &mut Concealed) {
    of.at = match m.robot {
        Driven::Twil => vec!["sensor.linear_velocity", "sensor.angular_velocity"],
        Driven::Axis => vec!["sensor.speed"],
    };
}

/// 30 ms late.
pub(super) fn delay(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_sensors(m, &mut of);
    let delay = 0.03 * of.size;
    m.odometry.delay += delay;
    of.fitted("delay", delay, "s")
}

/// A filter of 40 ms on the counts.
pub(super) fn lag(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_sensors(m, &mut of);
    let lag = 0.04 * of.size;
    m.odometry.lag = lag;
    of.fitted("lag", lag, "s")
}

/// Speeds that are means of five differences of counts: a window of 40 ms before the last one.
pub(super) fn window(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_sensors(m, &mut of);
    let periods = (0.04 * of.size / PERIOD).round().max(1.0);
    m.odometry.window = periods as usize;
    of.fitted("window", periods * PERIOD, "s")
}

/// 0.1 rad/s on the yaw rate; on the axis 0.25 rad/s.
pub(super) fn offset(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_sensors(m, &mut of);
    let (signal, offset) = match m.robot {
        Driven::Twil => (1, 0.1 * of.size),
        Driven::Axis => (0, 0.25 * of.size),
    };
    of.at = vec![of.at[signal]];
    m.odometry.offset[signal] += offset;
    of.fitted("offset", offset, "rad/s")
}

/// 8 % too much on the first signal.
pub(super) fn scale(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_sensors(m, &mut of);
    of.at.truncate(1);
    let share = 0.08 * of.size;
    m.odometry.scale[0] *= 1.0 + share;
    of.fitted("error", share, "1")
}

/// A single track of marks: it counts them, and does not know which way they pass. It has no size.
pub(super) fn magnitude(m: &mut Physics, mut of: Concealed) -> Concealed {
    at_sensors(m, &mut of);
    m.odometry.one_track = true;
    of.fitted("turned", 1.0, "1")
}

/// Undriven measuring wheels, the right one 5 % larger, the left one 5 % smaller than odometry
/// believes. Of driven wheels of different size encoders would show next to nothing: a larger wheel
/// turns as fast at the same voltage.
pub(super) fn radius(m: &mut Physics, mut of: Concealed) -> Concealed {
    of.at = vec!["encoder.right", "encoder.left"];
    let share = 0.05 * of.size;
    let sizes = [1.0 + share, 1.0 - share];
    m.odometry.wheel_size = sizes;
    let radius = m.body.wheel_radius;
    of.fitted("mismatch", share, "1")
        .physical("radius_right", radius * sizes[0], "m")
        .physical("radius_left", radius * sizes[1], "m")
}

/// The first disc off centre by 4.6° of reading.
pub(super) fn ripple(m: &mut Physics, mut of: Concealed) -> Concealed {
    let (amplitude, phase) = (0.08 * of.size, 0.7f64);
    m.odometry.eccentricity[0] = Eccentricity { amplitude, phase };
    of.at = match m.robot {
        Driven::Twil => vec!["encoder.right"],
        Driven::Axis => vec!["sensor.angle"],
    };
    of.fitted("sine", amplitude * phase.cos(), "rad").fitted(
        "cosine",
        amplitude * phase.sin(),
        "rad",
    )
}
