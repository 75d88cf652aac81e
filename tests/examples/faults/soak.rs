//! Ticks without a motion.

use loopsight_tests::twil_path;
use loopsight_tests::{PERIOD, twil};

use crate::Row;

/// So many ticks of a robot that stands and is measured with noise, for each estimator.
pub(crate) fn unexcited(ticks: usize) -> Vec<Row> {
    let model = twil();
    let robot = std::fs::read_to_string(twil_path()).unwrap();
    let rows = ["rls", "kalman", "lms"].map(|estimator| {
        let text = format!(
            "model = \"model.toml\"\nperiod_s = {PERIOD}\nsupervisor = false\n\
             [driver.simulated]\nmodel = \"robot.toml\"\nlimit = 12.0\nseed = 5\n\
             noise = {{ linear_velocity = 1e-3, angular_velocity = 1e-3 }}\n\
             [controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\nlimit = 12.0\n\
             [estimator.{estimator}]\n[learning]\ncertainty_equivalence = true\n\
             [reference]\nlinear_velocity = {{ constant = 0.0 }}\nangular_velocity = {{ constant = 0.0 }}\n"
        );
        let mut composed = loopsight_tests::loops::composed(&text, &model, &robot).unwrap();
        let start = model.values();
        let covariance = estimator != "lms";
        let (mut farthest, mut ran, mut uncertain) = (0.0f64, 0, true);
        for k in 0..ticks {
            if composed.tick(k as f64 * PERIOD).is_err() {
                break;
            }
            ran += 1;
            let Some(learned) = &composed.host.observer else {
                break;
            };
            if k % 1000 == 0 || k + 1 == ticks {
                let values = learned.values().iter().zip(&start).zip(&model.parameters);
                let away = values
                    .map(|((value, start), p)| (value - start).abs() / (p.declaration.scale * p.size));
                farthest = away.fold(farthest, |most, a| if a <= most { most } else { a });
                for row in 0..learned.len() {
                    let estimator = learned.estimator(row);
                    let n = estimator.theta().len();
                    // Variances that are no numbers, or below 0, would be a lost covariance. `lms` has none.
                    uncertain &= !covariance || (0..n).all(|i| estimator.deviation(i) >= 0.0);
                }
            }
        }
        Row {
            what: format!("`{estimator}`: {:.0e} ticks at rest, with noise", ticks as f64),
            happened: format!(
                "{ran} ticks; at most {farthest:.3} scales from the start; {}",
                match (covariance, uncertain) {
                    (false, _) => "it has no covariance",
                    (true, true) => "deviations are numbers, none below 0",
                    (true, false) => "deviations were lost",
                }
            ),
            promised: "estimates within ten scales, a covariance that stays one",
            kept: ran == ticks && farthest <= 10.0 + 1e-9 && uncertain,
        }
    });
    rows.into()
}
