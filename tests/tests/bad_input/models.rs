//! Model files.

use super::{Desk, LOOP, model_text};

#[test]
fn spoilt_models() {
    let desk = Desk::new();
    let model = model_text();
    let effect = |text: &str| format!("{model}\n[[effect]]\n{text}");
    for (spoilt, words) in [
        (
            model.replace("[plant.ddmr]", "[plant.ddrm]"),
            &["ddrm", "spoilt.toml:5:8", "did you mean `ddmr`?"][..],
        ),
        (
            model.replace("K_A = -15", "K_a = -15"),
            &["K_a", "spoilt.toml:6:1", "did you mean `K_A`?"],
        ),
        (
            model.replace("K_A = -15.146", "K_A = \"fast\""),
            &["spoilt.toml:6:7", "expected"],
        ),
        (
            model.replace("K_A = -15.146", "K_A = 5.0"),
            &["K_A", "spoilt.toml:6:7", "up to 0"],
        ),
        (
            model.replace("K_A = -15.146", "K_A = nan"),
            &["K_A", "spoilt.toml:6:7"],
        ),
        (
            model.replace("K_A = -15.146", "K_A = "),
            &["spoilt.toml:6:"],
        ),
        (
            "[plant.ddmr.physical]\nmass = -3.0\n".to_owned(),
            &["mass", "spoilt.toml:2:8", "above 0 kg"],
        ),
        (
            "[plant.ddmr]\nK_A = -1.0\n[plant.ddmr.physical]\nmass = 3.0\n".to_owned(),
            &["two ways", "spoilt.toml:"],
        ),
        (
            // A count of an angle is no speed.
            "[plant.dc_axis]\n[log.measured.angle]\nsensor.encoder_counts = { counts_per_revolution = 2048 }\n"
                .to_owned(),
            &["`angle`", "`speed`", "spoilt.toml:2:", "`unit = \"rev\"` and `scale = 0.00048828125`"],
        ),
        (
            "[plant.dc_axis]\nK_A = -1.0\nK_C = 1.0\n[plant.ddmr]\n".to_owned(),
            &["dc_axis", "ddmr", "spoilt.toml:4:"],
        ),
        (
            effect("[effect.coulomb_friction]\nat = [\"wheel.right\"]\n[effect.input_delay]\n"),
            &["input_delay", "spoilt.toml:"],
        ),
        ("name = \"nothing\"\n".to_owned(), &["plant", "missing"]),
        (String::new(), &["plant", "missing"]),
        (
            effect("[effect.coulomb_fricton]\nat = [\"wheel.right\"]\n"),
            &["coulomb_fricton", "did you mean `coulomb_friction`?"],
        ),
        (
            effect("[effect.coulomb_friction]\nat = [\"wheel.rigth\"]\n"),
            &["wheel.rigth", "spoilt.toml:", "did you mean `wheel.right`?"],
        ),
        (
            effect("[effect.coulomb_friction]\nat = [\"input.right\"]\n"),
            &["input.right", "effort", "wheel.right"],
        ),
        (
            effect("[effect.coulomb_friction]\nlevel = 1.0\n"),
            &["at", "wheel.right"],
        ),
        (
            effect("[effect.coulomb_friction]\nat = \"wheel.right\"\n"),
            &["spoilt.toml:"],
        ),
        (
            effect("[effect.expression]\non = [\"wheel.right\"]\nforce = \"0.1 * flwo\"\n"),
            &["flwo", "spoilt.toml:", ":16", "did you mean `flow`?"],
        ),
        (
            effect("[effect.expression]\nat = [\"wheel.right\"]\nforce = \"tanh(flow\"\n"),
            &["never closed", "spoilt.toml:", ":14"],
        ),
        (
            "[plant.expression.states]\nx = { unit = \"m\", rate = \"v - x\" }\n\
             [plant.expression.inputs]\nu = { unit = \"m/s\" }\n"
                .to_owned(),
            &["unknown name `v`", "spoilt.toml:2:27", "x, u"],
        ),
        (
            effect("[effect.coulomb_friction]\nat = [\"wheel.right\"]\nlevel = -1.0\n"),
            &["level", "spoilt.toml:"],
        ),
        (
            format!("{model}\n[log.measured.linear_velocit]\n"),
            &["linear_velocit", "did you mean `linear_velocity`?"],
        ),
        (
            format!("{model}\n[log.inputs]\nvoltage_rigth = \"u\"\n"),
            &["voltage_rigth", "did you mean `voltage_right`?"],
        ),
        (
            model.replacen("revolution = 8192", "revolution = 0", 1),
            &["counts_per_revolution", "above 0"],
        ),
        (
            format!("{model}\n[simulation]\nmax_step_s = 0.0\n"),
            &["max_step_s", "above 0", "spoilt.toml:"],
        ),
        (
            format!("{model}\n[fit]\nfree = [\"K_G\"]\n"),
            &["K_G", "spoilt.toml:"],
        ),
        (
            format!("{model}\n[fti]\nfree = [\"K_A\"]\n"),
            &["fti", "did you mean `fit`?"],
        ),
        (format!("{model}\n{model}"), &["spoilt.toml:"]),
    ] {
        desk.write("spoilt.toml", spoilt);
        desk.refused_saying(&["check", "spoilt.toml"], words);
        desk.refused(&["compare", "spoilt.toml", "log.csv"]);
        desk.refused(&["fit", "spoilt.toml", "log.csv", "-o", "new.toml"]);
        desk.refused(&[
            "simulate",
            "spoilt.toml",
            "experiment.toml",
            "-o",
            "new.csv",
        ]);
        let with = LOOP.replace("model.toml", "spoilt.toml");
        desk.write("spoilt_loop.toml", with);
        desk.refused(&["run", "spoilt_loop.toml"]);
        assert!(!desk.path("new.toml").exists() && !desk.path("new.csv").exists());
    }
}
