//! A model file for a SysId log: what the file says of itself, and nothing a fit should find.

use std::f64::consts::TAU;
use std::fmt::Write;

use crate::fault::{Fault, FaultKind};
use crate::sysid::{SysIdLog, TestKind};

/// Half track, m, where the data do not tell it.
const GUESSED_HALF_TRACK: f64 = 0.3;
/// Wheel radius, m, where the units are no length: the three inches of most such robots.
pub(crate) const GUESSED_WHEEL_RADIUS: f64 = 0.0762;
/// Half tracks, m, outside of which something is wrong with the units.
const PLAUSIBLE_HALF_TRACK: std::ops::RangeInclusive<f64> = 0.1..=1.0;

/// Wheel radii, m, outside of which something is wrong with the units: from a toy to a tractor.
const PLAUSIBLE_RADIUS: std::ops::RangeInclusive<f64> = 0.01..=1.0;

/// Travel of an arm, rad, below which its weight counts as the same: on either side of the middle its sine changes by an eighth of
/// its amplitude at most, where friction takes as much.
const SAME_WEIGHT: f64 = 0.25;

/// SysId logs a motor's voltage as its controller puts it out: the duty times the battery's voltage of the time.
const MEASURED_INPUTS: &str = "# They are voltages at the motor: a supply that sags and a driver's limits are in them.\n\
     [log]\n\
     inputs_measured = true\n\n";

impl SysIdLog {
    /// What of the geometry in the log cannot be: the half track from wheels against gyro, the wheel radius
    /// from the units per rotation. The first does not matter as long as only speeds of the wheels are
    /// measured; the second is the unit of every speed.
    pub(crate) fn implausible(&self) -> Vec<Fault> {
        let mut found = Vec::new();
        let fault = |signal: &str, detail: String| Fault {
            kind: FaultKind::Implausible,
            run: String::new(),
            signal: signal.into(),
            detail,
        };
        if !self.test.is_drivetrain() {
            return found;
        }
        let radius = self.metres_per_rotation().map(|metres| metres / TAU);
        if let Some(radius) = radius.filter(|radius| !PLAUSIBLE_RADIUS.contains(radius)) {
            found.push(fault(
                "wheel_radius",
                format!(
                    "{radius:.3e} m, from {} {} per rotation: speeds and positions are in another unit than the log \
                     says. Voltages, times and what is late are right all the same",
                    self.units_per_rotation, self.units
                ),
            ));
        }
        if let Some((half_track, _)) = self.half_track()
            && !self.half_track_is_plausible()
        {
            found.push(fault(
                "half_track",
                format!(
                    "{:.3e} m, from the wheels against the gyro: unitsPerRotation or the gyro's unit is wrong. \
                     {GUESSED_HALF_TRACK} m was taken for it",
                    half_track.abs()
                ),
            ));
        }
        found
    }

    fn half_track_is_plausible(&self) -> bool {
        let half_track = self.half_track();
        half_track.is_none_or(|(b, _)| PLAUSIBLE_HALF_TRACK.contains(&b.abs()))
    }

    /// A commented model file for this log.
    pub fn model_toml(&self) -> String {
        // A comment must stay on its line, whatever the file is called.
        let source: String = self.source.chars().filter(|c| !c.is_control()).collect();
        let mut text = format!(
            "# Made from {source}: SysId test \"{}\", {} runs, {} {} per rotation.\n",
            self.test.name(),
            self.runs.len(),
            self.units_per_rotation,
            self.units
        );
        text.push_str("# Parameters that are not given here are what a fit finds.\n\n");
        if self.test.is_drivetrain() {
            self.drivetrain(&mut text);
        } else {
            self.axis(&mut text);
        }
        text
    }

    fn drivetrain(&self, text: &mut String) {
        text.push_str(
            "[plant.ddmr]\n\
             # The linear model: runs straight ahead or on the spot never show v omega or omega^2.\n\
             K_B = 0.0 # m/rad^2\n\
             K_E = 0.0 # 1/m\n",
        );
        let metres = self.metres_per_rotation();
        let radius = rounded(metres.map_or(GUESSED_WHEEL_RADIUS, |metres| metres / TAU));
        match metres {
            Some(metres) => line(
                text,
                &format!("# {metres:.6} m per rotation, divided by 2 pi"),
            ),
            None => line(
                text,
                "# A guess (3 in): the log counts rotations and not lengths.",
            ),
        }
        line(text, &format!("wheel_radius = {radius:?} # m"));
        match self.half_track() {
            Some((half_track, turned)) if self.half_track_is_plausible() => {
                let half_track = half_track.abs();
                line(
                    text,
                    &format!("# From the wheels against the gyro, {turned:.1} rad turned."),
                );
                line(text, &format!("half_track = {half_track:.4} # m"));
            }
            Some((half_track, _)) => {
                line(
                    text,
                    &format!(
                        "# A guess: {:.3e} m from the wheels against the gyro is implausible. Look at",
                        half_track.abs()
                    ),
                );
                line(text, "# unitsPerRotation and the gyro's unit.");
                line(text, &format!("half_track = {GUESSED_HALF_TRACK:?} # m"));
            }
            None => {
                line(
                    text,
                    "# A guess: the log turns too little to tell. In straight runs it does not matter.",
                );
                line(text, &format!("half_track = {GUESSED_HALF_TRACK:?} # m"));
            }
        }
        text.push_str("\n[fit]\nfixed = [\"K_B\", \"K_E\"]\n");
        text.push_str("\n# The inputs are the columns voltage_right_V and voltage_left_V.\n");
        text.push_str(MEASURED_INPUTS);
        text.push_str(
            "# Speeds come from the motor controller; many filter them and report them late:\n\
             # the effects sensor_delay and sensor_lag say so.\n",
        );
        for side in ["right", "left"] {
            line(text, &format!("[log.measured.track_speed_{side}]"));
            if metres.is_none() {
                line(text, &format!("column = \"shaft_speed_{side}_rad_per_s\""));
                line(text, "unit = \"m/s\"");
                line(
                    text,
                    &format!("scale = {radius:?} # the wheel radius guessed above"),
                );
            }
        }
    }

    fn axis(&self, text: &mut String) {
        let turns = self.test == TestKind::Arm && self.travel() * self.turn() > SAME_WEIGHT;
        text.push_str("[plant.dc_axis]\n\n");
        match self.test {
            TestKind::Arm if turns => text.push_str(
                "# The weight of the arm: a sine of its angle.\n\
                 [[effect]]\n[effect.gravity_pendulum]\nat = [\"shaft\"]\n\n",
            ),
            TestKind::Arm => text.push_str(
                "# The weight of the arm, which hardly turns here: gravity_pendulum is that of one that does.\n\
                 [[effect]]\n[effect.constant_force]\nat = [\"shaft\"]\n\n",
            ),
            TestKind::Elevator => text.push_str(
                "# The weight of the lift.\n\
                 [[effect]]\n[effect.constant_force]\nat = [\"shaft\"]\n\n",
            ),
            _ => {}
        }
        text.push_str(
            "# The voltage at the motor: a supply that sags and a driver's limits are in it.\n\
             [log]\ninputs_measured = true\n\n[log.inputs.voltage]\ncolumn = \"voltage_V\"\n\n",
        );
        if self.test == TestKind::Elevator {
            line(
                text,
                "# The speed is that of the shaft; its unit of length does not matter.",
            );
        }
        line(text, "[log.measured.speed]");
        if turns {
            line(text, "# The weight depends on the angle.");
            line(text, "[log.measured.angle]");
        }
    }
}

/// To a tenth of a micrometre, for people.
fn rounded(metres: f64) -> f64 {
    (metres * 1e7).round() / 1e7
}

fn line(text: &mut String, content: &str) {
    // Writing into a String cannot fail.
    let _ = writeln!(text, "{content}");
}

#[cfg(test)]
mod tests {
    use crate::read_sysid;

    fn model(test: &str, units: &str, row: &str) -> String {
        let text = format!(
            r#"{{"test":"{test}","units":"{units}","unitsPerRotation":0.5,"slow-forward":[{row}]}}"#
        );
        read_sysid(&text, "a\nlog.json").unwrap().model_toml()
    }

    #[test]
    fn a_drivetrain_in_metres() {
        let text = model("Drivetrain", "Meters", "[0,0,0,0,0,0,0,0,0]");
        assert!(text.starts_with("# Made from alog.json: SysId test \"Drivetrain\", 1 runs"));
        assert!(text.contains("\n[plant.ddmr]\n"));
        assert!(text.contains("wheel_radius = 0.0795775 "));
        assert!(text.contains("# A guess: the log turns too little"));
        assert!(text.contains("half_track = 0.3 "));
        assert!(
            text.ends_with("[log.measured.track_speed_right]\n[log.measured.track_speed_left]\n")
        );
    }

    #[test]
    fn a_drivetrain_in_rotations_says_that_it_guesses() {
        let text = model("Drivetrain (Angular)", "Rotations", "[0,0,0,0,0,0,0,0,0]");
        assert!(text.contains("# A guess (3 in)"));
        assert!(
            text.contains(
                "column = \"shaft_speed_left_rad_per_s\"\nunit = \"m/s\"\nscale = 0.0762"
            )
        );
    }

    #[test]
    fn an_axis() {
        let text = model("Simple", "Meters", "[0,0,0,0]");
        assert!(text.contains("[plant.dc_axis]\n") && text.ends_with("[log.measured.speed]\n"));
        assert!(!text.contains("effect"), "{text}");
        let text = model("Elevator", "Meters", "[0,0,0,0]");
        assert!(text.contains("[effect.constant_force]\nat = [\"shaft\"]\n"));
        let text = model("Arm", "Rotations", "[0,0,0,0],[0.1,0,0.01,0]");
        assert!(text.contains("[effect.constant_force]\n"), "{text}");
        let text = model("Arm", "Rotations", "[0,0,0,0],[0.1,0,0.1,0]");
        assert!(
            text.contains("[effect.gravity_pendulum]\n")
                && text.ends_with("[log.measured.angle]\n")
        );
    }
}
