//! The direction of motion, from a measured signal.

/// How a signal tells the direction of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    /// The sign of a speed.
    Speed,
    /// The sign of a position's rate of change.
    Position,
    /// The sign of some other quantity.
    Sign,
}

impl Motion {
    /// By the signal's unit.
    pub(crate) fn of(unit: &str) -> Self {
        match unit {
            "m" | "rad" | "deg" => Motion::Position,
            _ if unit.ends_with("/s") => Motion::Speed,
            _ => Motion::Sign,
        }
    }

    /// The two directions in words.
    pub(crate) fn directions(self, unit: &str) -> [&'static str; 2] {
        match (self, unit) {
            (Motion::Speed, "m/s") => ["forwards", "backwards"],
            (Motion::Speed, _) => ["in the positive direction", "in the negative direction"],
            (Motion::Position, _) => ["while it increases", "while it decreases"],
            (Motion::Sign, _) => ["while it is positive", "while it is negative"],
        }
    }

    /// What a change between them is called.
    pub(crate) fn change(self) -> &'static str {
        match self {
            Motion::Sign => "change of sign",
            Motion::Speed | Motion::Position => "change of direction",
        }
    }
}

/// The speed below which the samples count as rest: a `share` of its root mean square.
pub(crate) fn rest(speeds: impl Iterator<Item = f64>, share: f64) -> f64 {
    let (mut n, mut squares) = (0.0f64, 0.0);
    for value in speeds.filter(|v| v.is_finite()) {
        n += 1.0;
        squares += value * value;
    }
    share * (squares / n.max(1.0)).sqrt()
}

/// The quantity whose sign is the direction, sample by sample.
pub(crate) fn speed(time: &[f64], values: &[f64], motion: Motion) -> Vec<f64> {
    if motion != Motion::Position {
        return values.to_vec();
    }
    // Over two samples to either side, because quantised positions often do not change from one to the next.
    let last = time.len().saturating_sub(1);
    (0..time.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(2), (k + 2).min(last));
            (values[to] - values[from]) / (time[to] - time[from])
        })
        .collect()
}

/// The samples at which the direction changes. Noise around rest changes no direction: a direction counts once
/// `speed` leaves ±`rest`, and from the sample at which it left zero.
pub(crate) fn changes(speed: &[f64], rest: f64) -> Vec<usize> {
    let mut changes = Vec::new();
    let mut direction = 0.0;
    for (k, value) in speed.iter().enumerate() {
        if value.abs() > rest && value.signum() != direction {
            if direction != 0.0 {
                let back = speed[..k]
                    .iter()
                    .rev()
                    .take_while(|v| **v * value > 0.0)
                    .count();
                changes.push(k - back);
            }
            direction = value.signum();
        }
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_around_rest_changes_no_direction() {
        assert_eq!(
            changes(&[1.0, 0.01, -0.01, 0.01, 1.0], 0.05),
            Vec::<usize>::new()
        );
        assert_eq!(
            changes(&[1.0, 0.01, -0.01, -0.02, -1.0, f64::NAN, 0.5], 0.05),
            [2, 6]
        );
        assert_eq!(changes(&[0.0, 0.0], 0.0), Vec::<usize>::new());
        assert_eq!(changes(&[], f64::NAN), Vec::<usize>::new());
    }

    #[test]
    fn a_position_turns_where_its_rate_changes_sign() {
        let time: Vec<f64> = (0..40).map(|k| 0.05 * f64::from(k)).collect();
        let up_and_down: Vec<f64> = (0..40).map(|k| 1.0 - (f64::from(k) - 20.0).abs()).collect();
        let rates = speed(&time, &up_and_down, Motion::of("rad"));
        assert_eq!(changes(&rates, rest(rates.iter().copied(), 0.05)).len(), 1);
        assert!(rates[3] > 0.0 && rates[36] < 0.0);
    }

    #[test]
    fn words_follow_the_unit() {
        assert_eq!(
            Motion::of("m/s").directions("m/s"),
            ["forwards", "backwards"]
        );
        assert_eq!(Motion::of("A").change(), "change of sign");
        assert_eq!(
            rest([3.0, -4.0, f64::NAN].into_iter(), 0.05),
            0.05 * 12.5f64.sqrt()
        );
    }
}
