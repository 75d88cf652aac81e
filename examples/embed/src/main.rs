//! Diagnoses a log held in memory twice: to the end with its progress and what it knows on the way, and stopped by another thread.

use std::thread;
use std::time::{Duration, Instant};

use embed::{diagnose, measured, was_stopped};
use loopsight::{CancelToken, Early, Finding, Progress, Result};

fn main() -> Result<()> {
    let answer = diagnose(measured(25.0)?, &CancelToken::new(), follow, hear)?;
    println!("{}", answer.summary);

    let stop = CancelToken::new();
    let button = stop.clone();
    let pressed = thread::spawn(move || {
        thread::sleep(Duration::from_millis(300));
        button.cancel();
        Instant::now()
    });
    let answer = diagnose(measured(60.0)?, &stop, |_| (), |_| ())?;
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

fn follow(progress: &Progress) {
    let stage = progress.stage.text();
    println!("{stage}: {} of {}", progress.done, progress.total);
}

/// What a page would draw long before the work ends.
fn hear(early: &Early) {
    match &early.finding {
        Finding::Compared { nrmse, .. } => println!("  the model leaves {:.2} %", 1e2 * nrmse),
        Finding::Promised { candidates } => {
            let ids = candidates
                .iter()
                .map(|promised| promised.place.effect.as_str());
            println!("  most promising: {}", ids.collect::<Vec<_>>().join(", "));
        }
        Finding::Finalist(found) => {
            println!("  with {} {:.2} %", found.place.effect, 1e2 * found.nrmse);
        }
        _ => {}
    }
}
