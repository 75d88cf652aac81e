//! Neither file nor disk: a model of TOML text and a log of arrays with units, as a program has them that
//! measures by itself.

use loopsight::{FitOptions, Log, Model, Result, Session};

fn main() -> Result<()> {
    // x'' = -40 x - 1.2 x' + 2 F, driven with steps; the position is logged in millimetres.
    let (mut x, mut v, step) = (0.0, 0.0, 1e-4);
    let (mut time, mut force, mut position) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..100_000 {
        let t = f64::from(k) * step;
        let f = if ((t / 1.3) as u32).is_multiple_of(2) {
            5.0
        } else {
            -5.0
        };
        if k % 100 == 0 {
            time.push(t);
            force.push(f);
            position.push(1e3 * x);
        }
        v += step * (-40.0 * x - 1.2 * v + 2.0 * f);
        x += step * v;
    }
    let log = Log::in_memory("bench")
        .column("time", "s", time)
        .column("force", "N", force)
        .column("position", "mm", position)
        .build()?;
    let model = Model::from_toml(
        "spring.toml",
        "[plant.oscillator]\n[log.measured.position]\n",
    )?;
    let fit = Session::new(model, log)?.fit(&FitOptions::default())?;
    println!("{}", fit.model().to_toml());
    Ok(())
}
