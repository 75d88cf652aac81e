//! A small differential drive, exact and without noise, for tests of faults.

use loopsight_core::Signal;
use loopsight_model::log_map::LogMap;

use crate::fault::FaultKind;
use crate::map::Recording;
use crate::table::{ColumnName, Table, TableRun};
use crate::{Source, map};

/// Two runs of 4 s, with every row `[time, right V, left V, right m/s, left m/s]` bent by `bend`.
pub(crate) fn drive_log(bend: impl Fn(usize, [f64; 5]) -> [f64; 5]) -> Recording {
    let headers = [
        "time_s",
        "voltage_right_V",
        "voltage_left_V",
        "track_speed_right_m_per_s",
        "track_speed_left_m_per_s",
    ];
    let run = |index: usize, name: &str| {
        let (mut right, mut left) = (0.0, 0.0);
        let mut rows = Vec::new();
        for k in 0..400 {
            let t = 0.01 * f64::from(k);
            let (ur, ul) = (6.0 * (2.0 * t).sin(), 5.0 * (1.7 * t + 0.5).sin());
            rows.extend(bend(index, [t, ur, ul, right, left]));
            right += 0.01 * (0.5 * ur - right) / 0.1;
            left += 0.01 * (0.5 * ul - left) / 0.1;
        }
        TableRun {
            name: name.into(),
            rows,
            first_line: 0,
            lines: Vec::new(),
        }
    };
    let table = Table {
        source: "drive".into(),
        columns: headers.map(ColumnName::new).to_vec(),
        runs: vec![run(0, "a"), run(1, "b")],
        ..Table::default()
    };
    let inputs = [
        Signal::new("voltage_right", "u_r", "V", "."),
        Signal::new("voltage_left", "u_l", "V", "."),
    ];
    let outputs = [
        Signal::new("track_speed_right", "v_r", "m/s", "."),
        Signal::new("track_speed_left", "v_l", "m/s", "."),
    ];
    map(&Source::Table(table), &inputs, &outputs, &LogMap::default()).unwrap()
}

/// Kind and signal of every fault.
pub(crate) fn kinds(log: &Recording) -> Vec<(FaultKind, &str)> {
    log.faults
        .iter()
        .map(|f| (f.kind, f.signal.as_str()))
        .collect()
}
