//! Between the command in the log and the voltage that is demanded of the motor.

use crate::delay::Delay;

/// What an amplifier does to a command, in this order: transport delay, filter, dead zone, throttle curve,
/// limit, gain and offset.
///
/// ```text
/// u1(t) = command(t - delay)     lag u2' = u1 - u2
/// u3 = u2 -/+ dead_zone beyond ±dead_zone, 0 within     u4 = full sign(u3) |u3/full|^exponent
/// V = gain clamp(u4, ±limit) + offset
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AmplifierParts {
    /// Transport delay, s; kept to a whole number of integration steps.
    pub(crate) delay: f64,
    /// Time constant of the filter, s; 0: none.
    pub(crate) lag: f64,
    /// Voltage below which nothing comes out, and which is missing above, V.
    pub(crate) dead_zone: f64,
    /// Of the throttle curve; 1: a straight line.
    pub(crate) exponent: f64,
    /// The command that the throttle curve passes on as it is, V.
    pub(crate) full: f64,
    /// Largest voltage, V.
    pub(crate) limit: f64,
    /// Gain.
    pub(crate) gain: f64,
    /// Offset, V.
    pub(crate) offset: f64,
    /// At command zero all switches of the bridge are open.
    pub(crate) coasts: bool,
    /// The switches are closed in pulses only, and open in the pauses between them.
    pub(crate) pulses: Option<Pulses>,
}

/// Pulses of the whole supply, for as long as their mean is the voltage demanded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pulses {
    /// The supply, V.
    pub(crate) supply: f64,
    /// Of one pulse and its pause, in integration steps.
    pub(crate) period: u32,
}

impl Default for AmplifierParts {
    fn default() -> Self {
        Self {
            delay: 0.0,
            lag: 0.0,
            dead_zone: 0.0,
            exponent: 1.0,
            full: 1.0,
            limit: f64::INFINITY,
            gain: 1.0,
            offset: 0.0,
            coasts: false,
            pulses: None,
        }
    }
}

/// What an amplifier does over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Demand {
    /// Mean voltage demanded while the switches are closed, V.
    pub(crate) voltage: f64,
    /// Share of the step in which they are closed. Open, the winding is connected to nothing but the diodes of the bridge.
    pub(crate) on: f64,
}

/// An amplifier at work.
#[derive(Clone, Debug)]
pub(crate) struct Amplifier {
    parts: AmplifierParts,
    line: Delay<f64>,
    filtered: f64,
    /// Of the filter over a step: what remains of the difference at the end, and on average.
    decay: f64,
    mean: f64,
    /// Steps since the last pulse began.
    passed: u32,
}

impl Amplifier {
    pub(crate) fn new(parts: AmplifierParts, step: f64) -> Self {
        let x = step / parts.lag;
        let (decay, mean) = if parts.lag > 0.0 {
            ((-x).exp(), -(-x).exp_m1() / x)
        } else {
            (0.0, 0.0)
        };
        Self {
            parts,
            line: Delay::new((parts.delay / step).round() as usize, 0.0),
            filtered: 0.0,
            decay,
            mean,
            passed: 0,
        }
    }

    /// What is demanded over a step in which `command` is applied.
    pub(crate) fn step(&mut self, command: f64) -> Demand {
        let parts = &self.parts;
        let late = self.line.push(command);
        let difference = self.filtered - late;
        let filtered = late + difference * self.mean;
        self.filtered = late + difference * self.decay;
        let live = (filtered.abs() - parts.dead_zone)
            .max(0.0)
            .copysign(filtered);
        let curved = if parts.exponent == 1.0 {
            live
        } else {
            (parts.full * (live.abs() / parts.full).powf(parts.exponent)).copysign(live)
        };
        let voltage = parts.gain * curved.clamp(-parts.limit, parts.limit) + parts.offset;
        if let Some(pulses) = parts.pulses {
            let lasts = (voltage.abs() / pulses.supply).min(1.0) * f64::from(pulses.period);
            let on = (lasts - f64::from(self.passed)).clamp(0.0, 1.0);
            self.passed = (self.passed + 1) % pulses.period;
            let voltage = pulses.supply.copysign(voltage);
            return Demand { voltage, on };
        }
        let open = parts.coasts && late == 0.0;
        let on = if open { 0.0 } else { 1.0 };
        Demand { voltage, on }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chain_does_what_it_says() {
        let mut late = Amplifier::new(
            AmplifierParts {
                delay: 0.003,
                ..AmplifierParts::default()
            },
            1e-3,
        );
        let out: Vec<f64> = (0..5).map(|_| late.step(2.0).voltage).collect();
        assert_eq!(out, [0.0, 0.0, 0.0, 2.0, 2.0]);
        let mut dead = Amplifier::new(
            AmplifierParts {
                dead_zone: 1.0,
                limit: 6.0,
                gain: 2.0,
                offset: 0.5,
                ..AmplifierParts::default()
            },
            1e-3,
        );
        assert_eq!(
            [0.5, -3.0, 9.0].map(|v| dead.step(v).voltage),
            [0.5, -3.5, 12.5],
            "within the zone, below it, beyond the limit"
        );
        let mut curved = Amplifier::new(
            AmplifierParts {
                exponent: 2.0,
                full: 12.0,
                ..AmplifierParts::default()
            },
            1e-3,
        );
        assert_eq!(
            [0.0, 6.0, -6.0, 12.0].map(|v| curved.step(v).voltage),
            [0.0, 3.0, -3.0, 12.0],
            "a quarter of the voltage at half the command"
        );
        let mut loose = Amplifier::new(
            AmplifierParts {
                coasts: true,
                ..AmplifierParts::default()
            },
            1e-3,
        );
        assert_eq!([0.0, 1.0, 0.0].map(|v| loose.step(v).on), [0.0, 1.0, 0.0]);
        let mut pulsed = Amplifier::new(
            AmplifierParts {
                pulses: Some(Pulses {
                    supply: 12.0,
                    period: 4,
                }),
                ..AmplifierParts::default()
            },
            1e-3,
        );
        let pulse: Vec<Demand> = (0..5).map(|_| pulsed.step(-4.5)).collect();
        assert!(pulse.iter().all(|demand| demand.voltage == -12.0));
        let on: Vec<f64> = pulse.iter().map(|demand| demand.on).collect();
        assert_eq!(on, [1.0, 0.5, 0.0, 0.0, 1.0], "three eighths of four steps");
        let mut slow = Amplifier::new(
            AmplifierParts {
                lag: 0.05,
                ..AmplifierParts::default()
            },
            1e-3,
        );
        for _ in 0..50 {
            slow.step(1.0);
        }
        assert!((slow.filtered - (1.0 - (-1.0f64).exp())).abs() < 1e-12);
    }
}
