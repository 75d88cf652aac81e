//! Channels in one line each: what nearly every plant has at its inputs, bodies and sensors.

use loopsight_core::{Channel, Place, Reads};

/// A channel; what matters there is about one of its unit.
pub(crate) const fn at(
    place: Place,
    [id, unit, equation, doc]: [&'static str; 4],
    reads: &'static [Reads],
) -> Channel {
    Channel {
        id,
        place,
        unit,
        equation,
        reads,
        side: 0,
        size: 1.0,
        doc,
    }
}

/// A channel where what matters is about `size` of its unit.
pub(crate) const fn sized(size: f64, channel: Channel) -> Channel {
    Channel { size, ..channel }
}
