//! A SysId log as a table in SI units, and what its numbers say of the vehicle.

use std::f64::consts::TAU;

use loopsight_core::unit::parse;

use super::{OLD_WIDTH, SysIdLog, SysIdRun};
use crate::fault::{Fault, FaultKind};
use crate::model_file::GUESSED_WHEEL_RADIUS;
use crate::table::{ColumnName, Table, TableRun};

impl SysIdLog {
    /// Metres per rotation, when the units are a length.
    pub fn metres_per_rotation(&self) -> Option<f64> {
        self.unit_in("m")
    }

    fn unit_in(&self, si: &str) -> Option<f64> {
        let (unit, si) = (parse(&self.units).ok()?, parse(si).ok()?);
        (unit.dimension == si.dimension).then_some(unit.factor * self.units_per_rotation)
    }

    /// True when the rows have battery and duty and no gyro rate.
    pub fn is_old_format(&self) -> bool {
        self.test.is_drivetrain() && self.runs.iter().any(|run| run.width == OLD_WIDTH)
    }

    /// True when the older format holds magnitudes of voltages only.
    pub fn has_unsigned_voltages(&self) -> bool {
        let old = || {
            self.runs
                .iter()
                .filter(|run| run.width == OLD_WIDTH)
                .flat_map(SysIdRun::rows)
        };
        old().any(|row| row[2] < 0.0) && !old().any(|row| row[3] < 0.0 || row[4] < 0.0)
    }

    /// The log as a table in SI units, with the units in the headers.
    pub fn table(&self) -> Table {
        let names: &[&str] = if !self.test.is_drivetrain() {
            &["time_s", "voltage_V", "angle_rad", "speed_rad_per_s"]
        } else if self.metres_per_rotation().is_some() {
            &[
                "time_s",
                "voltage_left_V",
                "voltage_right_V",
                "track_position_left_m",
                "track_position_right_m",
                "track_speed_left_m_per_s",
                "track_speed_right_m_per_s",
                "gyro_angle_rad",
                "gyro_rate_rad_per_s",
                "battery_voltage_V",
                "duty",
            ]
        } else {
            &[
                "time_s",
                "voltage_left_V",
                "voltage_right_V",
                "shaft_angle_left_rad",
                "shaft_angle_right_rad",
                "shaft_speed_left_rad_per_s",
                "shaft_speed_right_rad_per_s",
                "gyro_angle_rad",
                "gyro_rate_rad_per_s",
                "battery_voltage_V",
                "duty",
            ]
        };
        let turn = self.turn();
        let mixed = self.runs.iter().any(|run| run.width == OLD_WIDTH)
            && self.runs.iter().any(|run| run.width == 9);
        let columns: Vec<usize> = match (self.is_old_format(), mixed) {
            (true, true) => (0..names.len()).collect(),
            (true, false) => (0..names.len()).filter(|c| *c != 8).collect(),
            (false, _) => (0..names.len().min(9)).collect(),
        };
        let unsigned = self.has_unsigned_voltages();
        let table_run = |run: &SysIdRun| {
            let signs = if unsigned { run.side_signs() } else { None };
            let mut rows = Vec::with_capacity(run.rows.len());
            for row in run.rows() {
                let values = si_row(row, turn, signs);
                rows.extend(
                    columns
                        .iter()
                        .map(|c| values.get(*c).copied().unwrap_or(f64::NAN)),
                );
            }
            TableRun {
                name: run.name.clone(),
                rows,
                first_line: 0,
                lines: Vec::new(),
            }
        };
        Table {
            source: self.source.clone(),
            columns: columns.iter().map(|c| ColumnName::new(names[*c])).collect(),
            runs: self.runs.iter().map(table_run).collect(),
            ..Table::default()
        }
    }

    /// What a rotation is in the table: m for a drivetrain in units of length, rad for all else.
    pub(crate) fn turn(&self) -> f64 {
        // The shaft of a lift turns, too: its length per rotation does not matter here.
        match self.metres_per_rotation() {
            Some(metres) if self.test.is_drivetrain() => metres,
            Some(_) => TAU,
            None => self.unit_in("rad").unwrap_or(TAU),
        }
    }

    /// What one of the log's units is for the model of [`SysIdLog::model_toml`]: m for a drivetrain, with the
    /// wheel radius guessed there where the log counts no lengths; rad for all else.
    pub fn unit_of_model(&self) -> f64 {
        let of_table = self.turn() / self.units_per_rotation;
        match self.metres_per_rotation() {
            None if self.test.is_drivetrain() => of_table * GUESSED_WHEEL_RADIUS,
            _ => of_table,
        }
    }

    /// What has to be known about the numbers of [`SysIdLog::table`].
    pub fn notes(&self) -> Vec<Fault> {
        let mut notes = Vec::new();
        if self.has_unsigned_voltages() {
            let opposite = self
                .runs
                .iter()
                .filter(|run| {
                    run.side_signs()
                        .is_some_and(|[left, right]| left * right < 0.0)
                })
                .map(|run| run.name.clone())
                .collect::<Vec<_>>();
            let turned = if opposite.is_empty() {
                "both sides drive the same way".to_owned()
            } else {
                format!(
                    "the sides drive against each other in {}",
                    opposite.join(", ")
                )
            };
            notes.push(Fault {
                kind: FaultKind::UnsignedVoltage,
                run: String::new(),
                signal: "voltage".into(),
                detail: format!(
                    "the voltages are logged as magnitudes; their signs were taken from the duty \
                     and the way each side moved ({turned}), and 0 V where the duty is 0"
                ),
            });
        }
        if let Some((half_track, turned)) = self.half_track().filter(|(b, _)| *b < 0.0) {
            notes.push(Fault {
                kind: FaultKind::ReversedSign,
                run: String::new(),
                signal: "gyro_angle_rad".into(),
                detail: format!(
                    "the gyro angle grows clockwise: over {turned:.1} rad of turning it runs \
                     against the wheels (half track {half_track:.3} m)"
                ),
            });
        }
        notes.extend(self.implausible());
        notes.extend(self.broken_runs());
        notes.extend(self.rest());
        notes
    }

    /// Half the distance of the wheels, m, from wheels against gyro, negative for a gyro that
    /// counts clockwise, and the angle turned, rad; none without enough turning.
    pub fn half_track(&self) -> Option<(f64, f64)> {
        /// Turning, rad, below which slip and unequal wheels matter more than the track.
        const ENOUGH: f64 = 1.0;
        let metres = self
            .metres_per_rotation()
            .filter(|_| self.test.is_drivetrain())?;
        let (mut across, mut square, mut turned) = (0.0, 0.0, 0.0);
        for run in &self.runs {
            let rows: Vec<&[f64]> = run.rows().collect();
            let (left, gyro) = if run.width == OLD_WIDTH {
                (5, 9)
            } else {
                (3, 7)
            };
            // Tenths of a run: steps long enough for the gyro to have moved.
            for part in rows.chunks((rows.len() / 10).max(2)) {
                let (Some(first), Some(last)) = (part.first(), part.last()) else {
                    continue;
                };
                let angle = last[gyro] - first[gyro];
                let difference = (last[left + 1] - first[left + 1]) - (last[left] - first[left]);
                if angle.is_finite() && difference.is_finite() {
                    across += angle * difference * metres / 2.0;
                    square += angle * angle;
                    turned += angle.abs();
                }
            }
        }
        (turned >= ENOUGH && across != 0.0).then(|| (across / square, turned))
    }
}

/// Row in the order and the units of the table; `signs` for voltages that are magnitudes.
fn si_row(row: &[f64], turn: f64, signs: Option<[f64; 2]>) -> Vec<f64> {
    match *row {
        [t, v, position, speed] => vec![t, v, turn * position, turn * speed],
        [t, battery, duty, vl, vr, pl, pr, sl, sr, gyro] => {
            let signed = |v: f64, side: usize| match signs {
                // At rest the logged value is left over from the run before.
                Some(_) if duty == 0.0 => 0.0,
                Some(signs) => v * duty.signum() * signs[side],
                None => v,
            };
            let [pl, pr, sl, sr] = [pl, pr, sl, sr].map(|value| turn * value);
            vec![
                t,
                signed(vl, 0),
                signed(vr, 1),
                pl,
                pr,
                sl,
                sr,
                gyro,
                f64::NAN,
                battery,
                duty,
            ]
        }
        _ => row
            .iter()
            .enumerate()
            .map(|(c, value)| {
                if (3..7).contains(&c) {
                    turn * value
                } else {
                    *value
                }
            })
            .collect(),
    }
}

impl SysIdRun {
    /// Its rows.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.rows.chunks_exact(self.width.max(1))
    }

    /// Whether each side moved with the duty (1) or against it (-1), in the older format; a side
    /// that did not move counts as with it.
    fn side_signs(&self) -> Option<[f64; 2]> {
        if self.width != OLD_WIDTH {
            return None;
        }
        let sum = |column: usize| -> f64 {
            self.rows()
                .map(|row| row[2] * row[column])
                .filter(|p| p.is_finite())
                .sum()
        };
        Some([sum(7), sum(8)].map(|sum| if sum < 0.0 { -1.0 } else { 1.0 }))
    }
}
