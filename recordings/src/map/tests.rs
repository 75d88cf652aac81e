use std::collections::BTreeMap;

use loopsight_model::log_map::{Column, ColumnMap, Hold, Measured};
use proptest::prelude::*;

use super::*;
use crate::{Severity, read_csv_from};

const INPUTS: [Signal; 1] = [Signal::new("voltage", "u", "V", ".")];
const SIGNALS: [Signal; 2] = [
    Signal::new("speed", "w", "rad/s", "."),
    Signal::new("angle", "p", "rad", "."),
];

fn mapped(text: &str, log_map: &LogMap) -> Result<Recording, RecordingError> {
    let table = read_csv_from(text.as_bytes(), "log.csv").unwrap();
    map(&Source::Table(table), &INPUTS, &SIGNALS, log_map)
}

fn error(text: &str, log_map: &LogMap) -> String {
    mapped(text, log_map).unwrap_err().to_string()
}

/// Three seconds at 10 Hz, bent row by row; none leaves a row out.
fn log(bend: impl Fn(usize, [f64; 3]) -> Option<[f64; 3]>) -> String {
    let mut text = "time_s,voltage_V,speed_rad_per_s\n".to_owned();
    for k in 0..30 {
        let t = f64::from(k) / 10.0;
        if let Some([t, u, w]) = bend(k as usize, [t, (3.0 * t).sin(), (3.0 * t).sin()]) {
            text += &format!("{t},{u},{w}\n");
        }
    }
    text
}

fn kinds(recording: &Recording) -> Vec<FaultKind> {
    recording.faults.iter().map(|f| f.kind).collect()
}

fn column(name: &str, unit: Option<&str>, scale: f64) -> ColumnMap {
    ColumnMap::Full(Column {
        column: name.into(),
        unit: unit.map(str::to_owned),
        scale,
        scale_unit: None,
        offset: 0.0,
        hold: Hold::ZeroOrder,
    })
}

#[test]
fn columns_are_found_by_name_and_converted() {
    let text =
        "junk,time_ms,voltage_mV,speed_rpm,angle_deg\n9,500,1500,60,180\n9,2500,-1500,30,0\n";
    let recording = mapped(text, &LogMap::default()).unwrap();
    let run = &recording.runs[0];
    assert_eq!(run.time(), [0.0, 2.0]);
    assert_eq!(run.inputs(), [1.5, -1.5]);
    assert!((run.sample(0)[0] - std::f64::consts::TAU).abs() < 1e-12);
    assert!((run.sample(0)[1] - std::f64::consts::PI).abs() < 1e-12);
    assert_eq!(recording.measured[1].id, "angle");
    assert_eq!(recording.measured[1].unit, "rad");
}

#[test]
fn the_model_file_names_columns_units_and_scales() {
    let text = "stamp,run,u1,w\n0,1,2,3\n1,1,2.5,4\n0,2,2,3\n1,2,2.5,4\n";
    let log_map = LogMap {
        inputs_measured: false,
        time: Some(column("stamp", Some("s"), 1.0)),
        period_s: None,
        run: None, // a column named `run` is found
        inputs: BTreeMap::from([("voltage".into(), column("u1", Some("V"), -2.0))]),
        measured: BTreeMap::from([(
            "speed".into(),
            Measured {
                column: Some("w".into()),
                unit: Some("rpm".into()),
                ..Measured::default()
            },
        )]),
        ..LogMap::default()
    };
    let recording = mapped(text, &log_map).unwrap();
    assert_eq!(
        recording.runs.iter().map(|r| r.name()).collect::<Vec<_>>(),
        ["1", "2"]
    );
    assert_eq!(recording.runs[0].inputs(), [-4.0, -5.0]);
    assert_eq!(recording.measured.len(), 1);
}

#[test]
fn runs_may_have_names() {
    let text =
        "time_s,trial,voltage_V,speed_rad_per_s\n0,up,1,0\n2,up,2,1\n3,down,1,1\n5,down,2,0\n";
    let log_map = LogMap {
        run: Some("trial".into()),
        ..LogMap::default()
    };
    let recording = mapped(text, &log_map).unwrap();
    assert_eq!(recording.runs[1].name(), "down");
    assert_eq!(recording.runs[1].time(), [0.0, 2.0]);
}

#[test]
fn a_missing_unit_is_assumed_and_named() {
    let recording = mapped(
        &log(|_, row| Some(row)).replace("voltage_V", "voltage"),
        &LogMap::default(),
    );
    let recording = recording.unwrap();
    assert_eq!(kinds(&recording), [FaultKind::UnitAssumed]);
    assert_eq!(recording.faults[0].severity(), Severity::Note);
    assert!(recording.faults[0].detail.contains("taken as V"));
}

#[test]
fn an_angle_in_whole_numbers_is_said_to_look_like_counts() {
    let said = |angles: &str, scale: f64| {
        let rows: String = (angles.split(' ').enumerate())
            .map(|(k, angle)| format!("{k},1,{angle}\n"))
            .collect();
        let angle = Measured {
            column: Some("ticks".into()),
            scale: Some(scale),
            ..Measured::default()
        };
        let log_map = LogMap {
            measured: BTreeMap::from([("angle".into(), angle)]),
            ..LogMap::default()
        };
        let text = format!("time_s,voltage_V,ticks\n{rows}");
        let faults = mapped(&text, &log_map).unwrap().faults;
        let mut assumed = faults
            .into_iter()
            .filter(|f| f.kind == FaultKind::UnitAssumed);
        assumed.next().unwrap().detail
    };
    let hint = "whole numbers alone";
    assert!(said("0 15 -31", 1.0).contains(hint));
    // Counts that were made an angle, an angle, and one that stands.
    for (angles, scale) in [("0 15 -31", 0.01), ("0 1.5 -31", 1.0), ("3 3 3", 1.0)] {
        let said = said(angles, scale);
        assert!(
            said.contains("taken as rad") && !said.contains(hint),
            "{said}"
        );
    }
}

#[test]
fn errors_name_the_nearest_and_all_columns() {
    let ok = LogMap::default();
    let wrong_id = LogMap {
        measured: BTreeMap::from([("sped".into(), Measured::default())]),
        ..LogMap::default()
    };
    let wrong_unit = LogMap {
        inputs: BTreeMap::from([("voltage".into(), column("voltage_V", Some("furlong"), 1.0))]),
        ..LogMap::default()
    };
    let zero = LogMap {
        inputs: BTreeMap::from([("voltage".into(), column("voltage_V", None, 0.0))]),
        ..LogMap::default()
    };
    let no_run = LogMap {
        run: Some("trail".into()),
        ..LogMap::default()
    };
    for (text, log_map, says) in [
        (
            "time_s,voltge_V,speed_rad_per_s\n0,1,2\n",
            &ok,
            "log.csv: no column for the input `voltage` (expected `voltage_V`); did you mean `voltge_V`?; the columns are `time_s`, `voltge_V`, `speed_rad_per_s`",
        ),
        (
            "tme_s,voltage_V,speed_rad_per_s\n0,1,2\n",
            &ok,
            "log.csv: no column for the time `time` (a column such as `time_s`, or `period_s` in the model's [log]); did you mean `tme_s`?",
        ),
        (
            "time_s,voltage_V,speed_Hz\n0,1,2\n",
            &ok,
            "log.csv: column `speed_Hz` is in Hz (s^-1), but `speed` is in rad/s (s^-1 rad)",
        ),
        (
            "time_s,voltage_V,x\n0,1,2\n",
            &ok,
            "log.csv: no column is a signal of the model",
        ),
        (
            "time_s,voltage,speed_rad_per_s\n0,on,2\n",
            &ok,
            "log.csv: line 2, column 2 (`voltage`): `voltage` needs numbers, found the text `on`",
        ),
        (
            "time_s,voltage_V,speed_rad_per_s\n0,1,2\n1,,2\n",
            &ok,
            "log.csv: line 3, column 2 (`voltage_V`): the value is missing; an input must",
        ),
        (
            "time_s,voltage_V,speed_rad_per_s\n0,1,2\nnan,1,2\n",
            &ok,
            "log.csv: line 3, column 1 (`time_s`): the value is missing; the time must",
        ),
        (
            "time_s,voltage_V,speed_rad_per_s\n0,1,2\n\n1,2e12,2\n",
            &ok,
            "log.csv: line 4, column 2 (`voltage_V`): the value 2000000000000 is absurd",
        ),
        (
            "time_s,voltage_V,speed_rad_per_s\ninf,1,2\n",
            &ok,
            "log.csv: line 2, column 1",
        ),
        (
            "time_s,voltage_V,speed_rad_per_s\n0,1,2\n",
            &wrong_id,
            "[log.measured] names `sped`, which the plant does not have; did you mean `speed`?",
        ),
        (
            "time_s,voltage_V,speed_rad_per_s\n0,1,2\n",
            &wrong_unit,
            "log.csv: column `voltage_V`: `furlong` is not a unit: at `furlong`: character 1",
        ),
        (
            "time_s,voltage_V,speed_rad_per_s\n0,1,2\n",
            &zero,
            "column `voltage_V`: the scale 0 must",
        ),
        (
            "time_s,trial,voltage_V,speed_rad_per_s\n0,1,1,2\n",
            &no_run,
            "log.csv: no column for the run `trail` (a column named `trail`); did you mean `trial`?",
        ),
    ] {
        let error = error(text, log_map);
        assert!(error.starts_with(says), "{error}\n{says}");
    }
}

#[test]
fn a_clean_log_has_no_faults() {
    let recording = mapped(&log(|_, row| Some(row)), &LogMap::default()).unwrap();
    assert_eq!(kinds(&recording), []);
    assert_eq!(recording.runs.len(), 1);
    assert_eq!(recording.runs[0].name(), "");
}

#[test]
fn time_stamps_that_stand_or_go_back() {
    let text = log(|k, [t, u, w]| {
        Some([
            if k == 4 {
                0.3
            } else if k == 20 {
                1.85
            } else {
                t
            },
            u,
            w,
        ])
    });
    let recording = mapped(&text, &LogMap::default()).unwrap();
    assert_eq!(recording.runs[0].len(), 28);
    let of = |kind| recording.faults.iter().find(|f| f.kind == kind).unwrap();
    assert_eq!(of(FaultKind::DuplicateTime).severity(), Severity::Note);
    let detail = &of(FaultKind::DuplicateTime).detail;
    assert!(
        detail.contains("1 of 30 rows") && detail.contains("line 6, column 1"),
        "{detail}"
    );
    let detail = &of(FaultKind::NonMonotoneTime).detail;
    assert!(detail.contains("goes back in 1 of 30 rows"), "{detail}");
}

#[test]
fn gaps_and_restarts_split_runs() {
    let gap = log(|k, [t, u, w]| Some([if k < 15 { t } else { t + 2.0 }, u, w]));
    let recording = mapped(&gap, &LogMap::default()).unwrap();
    assert_eq!(kinds(&recording), [FaultKind::Gap]);
    assert!(
        recording.faults[0]
            .detail
            .starts_with("1 gaps, the longest 2.100 s")
    );
    assert_eq!(
        recording.runs.iter().map(|r| r.name()).collect::<Vec<_>>(),
        ["", "#2"]
    );
    assert_eq!(recording.runs[1].time()[0], 0.0);
    let restart = log(|k, [t, u, w]| Some([if k < 15 { t } else { t - 1.5 }, u, w]));
    let recording = mapped(&restart, &LogMap::default()).unwrap();
    assert_eq!(kinds(&recording), [FaultKind::NonMonotoneTime]);
    assert_eq!(recording.runs.len(), 2);
}

#[test]
fn missing_and_absurd_samples_become_nan() {
    let text = log(|k, [t, u, w]| {
        Some([
            t,
            u,
            if k == 3 {
                f64::NAN
            } else if k == 5 {
                1e12
            } else {
                w
            },
        ])
    });
    let recording = mapped(&text.replace("NaN", ""), &LogMap::default()).unwrap();
    assert!(recording.runs[0].sample(3)[0].is_nan() && recording.runs[0].sample(5)[0].is_nan());
    assert_eq!(
        kinds(&recording),
        [FaultKind::NotANumber, FaultKind::AbsurdValue]
    );
    assert!(
        recording.faults[0]
            .detail
            .contains("1 of 30 samples are missing, the first at line 5")
    );
    assert!(recording.faults[1].detail.contains("line 7, column 3"));
}

#[test]
fn short_runs_are_left_out_while_others_are_left() {
    let text = log(|k, [t, u, w]| Some([if k < 25 { t } else { t + 2.0 }, u, w]));
    let recording = mapped(&text, &LogMap::default()).unwrap();
    assert_eq!(recording.runs.len(), 1);
    let short = recording
        .faults
        .iter()
        .find(|f| f.kind == FaultKind::ShortRun)
        .unwrap();
    assert_eq!(
        (short.run.as_str(), short.severity()),
        ("#2", Severity::Warning)
    );
    assert!(short.detail.contains("`#2` 0.40 s; left out"), "{short}");

    let all = log(|k, row| (k < 8).then_some(row));
    let recording = mapped(&all, &LogMap::default()).unwrap();
    assert_eq!(recording.runs.len(), 1);
    assert_eq!(recording.faults[0].kind, FaultKind::ShortRun);
    assert_eq!(recording.faults[0].severity(), Severity::Fatal);
}

#[test]
fn short_runs_stay_when_nothing_else_moves() {
    let text = log(|k, [t, u, w]| Some(if k < 22 { [t, u, 0.5] } else { [t + 2.0, u, w] }));
    let recording = mapped(&text, &LogMap::default()).unwrap();
    assert_eq!(recording.runs.len(), 2);
    let short = recording
        .faults
        .iter()
        .find(|f| f.kind == FaultKind::ShortRun)
        .unwrap();
    assert!(
        short.detail.contains("kept, since nothing moves"),
        "{short}"
    );
}

#[test]
fn jitter_is_a_note_with_figures() {
    let text = log(|k, [t, u, w]| Some([t + if k % 2 == 0 { 0.02 } else { 0.0 }, u, w]));
    let recording = mapped(&text, &LogMap::default()).unwrap();
    assert_eq!(kinds(&recording), [FaultKind::IrregularTime]);
    assert_eq!(recording.faults[0].severity(), Severity::Note);
}

#[test]
fn large_stamps_keep_their_digits() {
    let text = "time_us,voltage_V,speed_rad_per_s\n1700000000000000,1,2\n1700000000000001,1,3\n";
    let recording = mapped(text, &LogMap::default()).unwrap();
    assert!((recording.runs[0].time()[1] - 1e-6).abs() < 1e-18);
}

proptest! {
    #[test]
    fn no_numbers_make_it_panic(
        rows in prop::collection::vec(prop::array::uniform3(any::<f64>()), 1..40),
        coarse in prop::collection::vec(prop::array::uniform3(-3i8..3), 1..80),
    ) {
        let coarse = coarse.iter().map(|row| row.map(f64::from)).collect::<Vec<_>>();
        for rows in [rows, coarse] {
            let flat = rows.into_iter().flatten().collect();
            let table = crate::Table {
                source: "l".into(),
                columns: ["time_s", "voltage_V", "speed_rad_per_s"]
                    .map(crate::ColumnName::new)
                    .to_vec(),
                runs: vec![TableRun { rows: flat, ..TableRun::default() }],
                ..crate::Table::default()
            };
            if let Ok(recording) = map(&Source::Table(table), &INPUTS, &SIGNALS, &LogMap::default()) {
                for run in &recording.runs {
                    prop_assert!(run.time().windows(2).all(|w| w[0] < w[1]));
                    prop_assert_eq!(run.time()[0], 0.0);
                    prop_assert_eq!(run.inputs().len(), run.len());
                }
            }
        }
    }
}

/// A transducer's volts stand for metres; a column that counts has a size per count.
#[test]
fn a_gain_with_a_unit_makes_another_quantity_of_a_column() {
    let text = "time_s,voltage_V,probe_mV,ticks\n0,1,500,2\n1,2,-250,4\n2,1,0,6\n";
    let signals = [
        Signal::new("position", "q", "m", "."),
        Signal::new("angle", "a", "rad", "."),
    ];
    let inputs = [Signal::new("force", "F", "N", ".")];
    let gain = |name: &str, scale: f64, unit: &str| Measured {
        column: Some(name.into()),
        scale: Some(scale),
        scale_unit: Some(unit.into()),
        ..Measured::default()
    };
    let mut force = column("voltage", None, 3.0);
    if let ColumnMap::Full(column) = &mut force {
        column.scale_unit = Some("N/V".into());
    }
    let log_map = LogMap {
        inputs: BTreeMap::from([("force".into(), force)]),
        measured: BTreeMap::from([
            ("position".into(), gain("probe", 20.0, "mm/V")),
            ("angle".into(), gain("ticks", 0.1, "rad")),
        ]),
        ..LogMap::default()
    };
    let source = Source::Table(read_csv_from(text.as_bytes(), "log.csv").unwrap());
    let run = map(&source, &inputs, &signals, &log_map).unwrap().runs;
    assert_eq!(run[0].inputs(), [3.0, 6.0, 3.0]);
    for (found, expected) in run[0].measured().iter().zip([0.01, 0.2, -0.005, 0.4]) {
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
    }

    let wrong = LogMap {
        measured: BTreeMap::from([("position".into(), gain("probe", 1.0, "N/V"))]),
        ..log_map
    };
    let error = map(&source, &inputs, &signals, &wrong).unwrap_err();
    assert!(error.to_string().contains("mV times N/V"), "{error}");
}

#[test]
fn an_optional_input_without_a_column_is_zero() {
    let text = "time_s,voltage_V,speed_rad_per_s\n0,1,0\n1,2,1\n2,1,2\n";
    let inputs = [
        Signal::new("voltage", "u", "V", "."),
        Signal::new("added", "d", "V", ".").optional(),
    ];
    let signals = [Signal::new("speed", "w", "rad/s", ".")];
    let read = |text: &str| {
        let source = Source::Table(read_csv_from(text.as_bytes(), "log.csv").unwrap());
        map(&source, &inputs, &signals, &LogMap::default()).unwrap()
    };
    assert_eq!(read(text).runs[0].inputs(), [1.0, 0.0, 2.0, 0.0, 1.0, 0.0]);
    let with = text
        .replace("time_s", "added_V,time_s")
        .replace('\n', "\n7,");
    let with = with.trim_end_matches("7,");
    assert_eq!(read(with).runs[0].inputs()[1], 7.0);
}

#[test]
fn a_header_that_is_a_unit_of_its_signal_gives_it() {
    let speed = Measured {
        column: Some("RPM".into()),
        ..Measured::default()
    };
    let log_map = LogMap {
        measured: BTreeMap::from([("speed".into(), speed)]),
        ..LogMap::default()
    };
    let text = "minutes,V,RPM\n0,1,60\n1,2,30\n";
    let voltage = BTreeMap::from([("voltage".into(), ColumnMap::Name("V".into()))]);
    let recording = mapped(
        text,
        &LogMap {
            inputs: voltage,
            ..log_map
        },
    )
    .unwrap();
    let run = &recording.runs[0];
    assert!((run.sample(0)[0] - std::f64::consts::TAU).abs() < 1e-12);
    assert_eq!(run.time(), [0.0, 60.0]);
    assert!(!kinds(&recording).contains(&FaultKind::UnitAssumed));
}
