//! Every kind of page, written to be looked at: by a person, and by the browser of `tests/pages.sh`.

use std::path::Path;

use loopsight_diagnosis::{Comparison, Conclusion};
use loopsight_recordings::{Fault, FaultKind, output, read_bytes};

use crate::findings::{diagnosis, improvement, pair};
use crate::fixtures::{comparison, context, friction_runs, loop_record};
use crate::{
    Context, LoopRecord, comparison_page, diagnosis_page, figure_svg, fit, improvement_page,
    inventory_page, run_page,
};

/// Writes the pages into the folder that `LOOPSIGHT_PAGES` names.
#[test]
fn pages_to_look_at() {
    let Some(folder) = std::env::var_os("LOOPSIGHT_PAGES") else {
        return;
    };
    let folder = std::path::PathBuf::from(folder);
    comparisons(&folder);
    findings(&folder);
    write(&folder, "fit.html", &fit::tests::page(2500, false));
    write(&folder, "rls.html", &fit::tests::page(2500, true));
    let record = loop_record(4500);
    write(&folder, "run.html", &run_page(&context(), &record));
    let none = LoopRecord::default();
    write(&folder, "run_nothing.html", &run_page(&context(), &none));
    inventory(&folder);
    let figure = crate::figure::tests::velocities(2500);
    write(&folder, "figure.svg", &figure_svg(&figure));
}

fn write(folder: &Path, name: &str, text: &str) {
    output::save(&folder.join(name), text.as_bytes()).unwrap();
}

/// A log whose channels change, pause, stand still, say something and have long names.
fn inventory(folder: &Path) {
    let row = |k: u32| {
        let (time, angle) = (0.01 * f64::from(k), 0.003 * f64::from(k));
        let pause = if k < 900 { 0.0 } else { 4.0 };
        let mode = if k < 500 { "drive" } else { "turn" };
        let loud = 5.0 * angle.sin() + f64::from(k % 13);
        format!("{},{},{loud},7,{mode}\n", time + pause, k / 100 % 3)
    };
    let rows: String = (0..2500).map(row).collect();
    let text = format!(
        "time_s,u_V,SmartDashboard/Drivetrain/Left Encoder Speed (m/s),supply_V,mode\n{rows}"
    );
    let inventory = read_bytes(text.as_bytes(), "log").unwrap().inventory();
    let summary = "CSV, 5 channels, 28.99 s. `dc_axis` fits its channels.";
    let model = Some("[plant.dc_axis]\n\n[log.inputs]\nvoltage = \"u_V\"\n");
    let page = inventory_page(&context(), summary, &inventory, model);
    write(folder, "inspect.html", &page);
}

/// Runs: one, five, long ones, one signal of one, none.
fn comparisons(folder: &Path) {
    let page = |comparison: &Comparison| comparison_page(&context(), comparison);
    let mut faulty = comparison(friction_runs(1, 2500));
    faulty.faults.push(Fault {
        kind: FaultKind::NotANumber,
        run: String::new(),
        signal: "angular_velocity".into(),
        detail: "12 samples are missing between 3.2 s and 3.4 s".into(),
    });
    faulty.runs[0].signals[1].measured[320..332].fill(f64::NAN);
    write(folder, "comparison.html", &page(&faulty));
    let runs = comparison(friction_runs(5, 2500));
    write(folder, "runs.html", &page(&runs));
    let long = comparison(friction_runs(5, 100_000));
    write(folder, "long.html", &page(&long));
    let mut one = comparison(friction_runs(1, 800));
    one.signals.truncate(1);
    one.runs[0].signals.truncate(1);
    one.runs[0].inputs.truncate(1);
    write(folder, "one_signal.html", &page(&one));
    let none = comparison(vec![]);
    write(folder, "no_run.html", &page(&none));
}

/// Every verdict of a diagnosis, and every end of an improvement.
fn findings(folder: &Path) {
    let (before, after) = pair(2500);
    let context = Context {
        title: "Twil: what the model lacks".into(),
        command: "loopsight diagnose model.toml prbs_9V_25s.csv --html why.html".into(),
        ..context()
    };
    for (verdict, name) in [
        (Conclusion::EffectMissing, "effect_missing"),
        (Conclusion::NothingMissing, "nothing_missing"),
        (Conclusion::UnknownEffect, "unknown_effect"),
        (Conclusion::DataInsufficient, "data_insufficient"),
        (Conclusion::LogFaulty, "log_faulty"),
        (Conclusion::Cancelled, "cancelled"),
    ] {
        let found = diagnosis(verdict);
        let shown = found.model.is_some().then_some(&before);
        let page = diagnosis_page(&context, &found, shown, shown.and(Some(&after)));
        write(folder, &format!("diagnosis_{name}.html"), &page);
        let page = improvement_page(&context, &improvement(verdict), Some(&before), Some(&after));
        write(folder, &format!("improvement_{name}.html"), &page);
    }
    let mut blind = diagnosis(Conclusion::NothingMissing);
    blind.verdict = Conclusion::DataInsufficient;
    let page = diagnosis_page(&context, &blind, Some(&before), None);
    write(folder, "diagnosis_blind.html", &page);
}
