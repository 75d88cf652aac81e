//! Run a control loop and look at it while it runs; the model of the session is that of its controller.

use loopsight::{LogTo, Loop, Result, RunOptions, Session};

const LOOP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/twil/loop.toml");

fn main() -> Result<()> {
    let control = Loop::from_file(LOOP)?;
    let session = Session::of_model(control.model()?);
    let options = RunOptions::default().log(LogTo::Nowhere).on_tick(|view| {
        if view.time_s() % 1.0 < 1e-9 {
            for signal in view.controlled() {
                println!(
                    "{:.0} s: {} {:.3} {}",
                    view.time_s(),
                    signal.id,
                    signal.measured,
                    signal.unit
                );
            }
        }
    });
    let answer = session.run(&control, &options)?;
    println!("{}", answer.summary);
    Ok(())
}
