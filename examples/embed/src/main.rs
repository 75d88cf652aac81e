//! Diagnoses a log held in memory twice: to the end with its progress, and stopped by another thread.

use std::thread;
use std::time::{Duration, Instant};

use embed::{diagnose, measured, was_stopped};
use loopsight::{CancelToken, Result};

fn main() -> Result<()> {
    let answer = diagnose(measured(25.0)?, &CancelToken::new(), |progress| {
        println!(
            "{}: {} of {}",
            progress.stage.text(),
            progress.done,
            progress.total
        );
    })?;
    println!("{}", answer.summary);

    let stop = CancelToken::new();
    let button = stop.clone();
    let pressed = thread::spawn(move || {
        thread::sleep(Duration::from_millis(300));
        button.cancel();
        Instant::now()
    });
    let answer = diagnose(measured(60.0)?, &stop, |_| ())?;
    let ended = Instant::now();
    if let Ok(pressed) = pressed.join() {
        let late = ended.saturating_duration_since(pressed);
        println!(
            "stopped: {}, after {:.0} ms",
            was_stopped(&answer),
            1e3 * late.as_secs_f64()
        );
    }
    Ok(())
}
