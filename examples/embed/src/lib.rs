//! A diagnosis inside another program, as an app or a page in a browser has it: no file, no terminal.

use loopsight::answers::{DiagnoseAnswer, Verdict};
use loopsight::{CancelToken, DiagnoseOptions, Early, Log, Model, Progress, Result, Session};

/// What is believed of the machine: a mass on a spring.
const MODEL: &str = "name = \"bench\"\n[plant.oscillator]\nstiffness_per_mass = 30.0\n\
    damping_per_mass = 1.0\ninverse_mass = 1.0\n[log.measured.position]\n";

/// What the machine does, measured every 10 ms for `seconds`: a mass on a spring with a damper and dry
/// friction of 0.4 N, integrated in steps of 0.1 ms, its position read to 0.02 mm.
///
/// # Errors
///
/// None: the columns fit together.
pub fn measured(seconds: f64) -> Result<Log> {
    const STEP: f64 = 1e-4;
    let (mut x, mut v) = (0.0f64, 0.0f64);
    let (mut time, mut force, mut position) = (Vec::new(), Vec::new(), Vec::new());
    // A linear congruential generator: seven levels, drawn anew every 0.5 s.
    let mut random = 1_u64;
    let mut applied = 0.0;
    let steps = (seconds / STEP) as usize;
    for k in 0..steps {
        if k % 5000 == 0 {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            applied = ((random >> 33) % 7) as f64 - 3.0;
        }
        if k % 100 == 0 {
            time.push(k as f64 * STEP);
            force.push(applied);
            position.push((x / 2e-5).round() * 2e-2);
        }
        let friction = 0.4 * (v / 1e-3).tanh();
        v += STEP * (applied - friction - 1.5 * v - 40.0 * x);
        x += STEP * v;
    }
    Log::in_memory("bench")
        .column("time", "s", time)
        .column("force", "N", force)
        .column("position", "mm", position)
        .build()
}

/// Which effect does the model lack? Tells `report` how far it is, and `hear` what it knows already; `stop` ends it.
///
/// # Errors
///
/// The model cannot be fitted to the log.
pub fn diagnose(
    log: Log,
    stop: &CancelToken,
    report: impl Fn(&Progress) + Send + Sync + 'static,
    hear: impl Fn(&Early) + Send + Sync + 'static,
) -> Result<DiagnoseAnswer> {
    let model = Model::from_toml("bench.toml", MODEL)?;
    let options = DiagnoseOptions::default()
        .progress(report)
        .early(hear)
        .cancel(stop);
    Session::new(model, log)?.diagnose(&options)
}

/// Whether the work was stopped before it had a conclusion.
pub fn was_stopped(answer: &DiagnoseAnswer) -> bool {
    answer.verdict == Verdict::Cancelled
}
