//! Damaged input for every door, counted: panics, hangs, memory.
//!
//! `cargo run -p loopsight-tests --example attack -- 100` for a hundred million executions: half an hour on two cores, with checks of overflow;
//! 1 by default. Damage is seeded, so that every machine sees the same.
//!
//! The table is that of `docs/reliability.md`. An input that panics, takes more than ten seconds, or more memory than 64 times its size and a
//! megabyte, is kept in the temporary folder, and the program ends with status 1. Logs of other programs have a campaign of their own:
//! `cargo test --release -p loopsight-formats --features all --test mutations -- --ignored`.

#![allow(
    clippy::unwrap_used,
    reason = "what is damaged here was right, and a panic is how this program fails"
)]

mod targets;
mod twins;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::ScopedJoinHandle;
use std::time::{Duration, Instant};

use loopsight_tests::Random;
use loopsight_tests::damage::damaged;
use targets::Target;

/// Longest time that one input may take.
const LONGEST: Duration = Duration::from_secs(10);
/// Memory that one input may take at once: so many times its size, and so many bytes beside that.
const TIMES: u64 = 64;
const BESIDE: u64 = 1 << 20;

/// What became of the inputs of one worker.
#[derive(Clone, Copy, Default)]
struct Tally {
    done: u64,
    /// Of them, taken for right.
    taken: u64,
    panics: u64,
    slow: u64,
    large: u64,
    /// Most bytes at once, and what they are over the bound.
    most: u64,
    longest: Duration,
}

impl Tally {
    fn and(self, other: Self) -> Self {
        Self {
            done: self.done + other.done,
            taken: self.taken + other.taken,
            panics: self.panics + other.panics,
            slow: self.slow + other.slow,
            large: self.large + other.large,
            most: self.most.max(other.most),
            longest: self.longest.max(other.longest),
        }
    }

    fn broken(&self) -> u64 {
        self.panics + self.slow + self.large
    }
}

/// Keeps an input that broke something.
fn keep(name: &str, why: &str, seed: u64, round: u64, bytes: &[u8]) {
    let name = name.replace([' ', ','], "-");
    let path = std::env::temp_dir().join(format!("attack-{name}-{why}-{seed}-{round}"));
    let kept = std::fs::write(&path, bytes);
    eprintln!("{name}: {why}; {} {kept:?}", path.display());
}

/// One worker: `count` damaged inputs. `begun` has the milliseconds at which the present one was begun.
fn work(target: &Target, seed: u64, count: u64, clock: Instant, begun: &AtomicU64) -> Tally {
    let mut random = Random::new(seed);
    let inputs = (target.inputs)();
    let mut take = (target.take)();
    let mut tally = Tally::default();
    // What is damaged was right; half of the messages go the other way.
    let right = inputs.iter().filter(|whole| {
        let whole = (target.dress)((*whole).clone(), &mut Random::new(1));
        take(&whole)
    });
    assert!(2 * right.count() >= inputs.len(), "{}", target.name);
    let corpus = target.corpus.map(targets::corpus).unwrap_or_default();
    for round in 0..count.max(corpus.len() as u64) {
        let bytes = match corpus.get(round as usize) {
            // What is known to hurt comes first, as it is.
            Some(bytes) => bytes.clone(),
            None => {
                let hurt = !corpus.is_empty() && random.below(4) == 0;
                let from = if hurt { &corpus } else { &inputs };
                let whole = &from[random.below(from.len())];
                (target.dress)(damaged(whole, &mut random), &mut random)
            }
        };
        let limit = TIMES * bytes.len() as u64 + BESIDE;
        begun.store(clock.elapsed().as_millis() as u64 + 1, Ordering::Relaxed);
        let from = Instant::now();
        let mut taken = None;
        let used = allocation_counter::measure(|| {
            taken = catch_unwind(AssertUnwindSafe(|| take(&bytes))).ok();
        });
        let time = from.elapsed();
        tally.done += 1;
        tally.longest = tally.longest.max(time);
        tally.most = tally.most.max(used.bytes_max);
        if taken.is_none() {
            tally.panics += 1;
            keep(target.name, "panic", seed, round, &bytes);
            take = (target.take)();
        }
        if time > LONGEST {
            tally.slow += 1;
            keep(target.name, "slow", seed, round, &bytes);
        }
        if used.bytes_max > limit {
            tally.large += 1;
            keep(target.name, "large", seed, round, &bytes);
        }
        tally.taken += u64::from(taken == Some(true));
    }
    begun.store(0, Ordering::Relaxed);
    tally
}

/// All workers of a target; one that hangs for good ends the program.
fn campaign(target: &Target, number: u64, count: u64) -> Tally {
    let workers = std::thread::available_parallelism().map_or(1, usize::from) as u64;
    let clock = Instant::now();
    let begun: Vec<AtomicU64> = (0..workers).map(|_| AtomicU64::new(1)).collect();
    std::thread::scope(|scope| {
        let work = |worker: u64| {
            let begun = &begun[worker as usize];
            let seed = 1 + number * 1000 + worker;
            scope.spawn(move || work(target, seed, count.div_ceil(workers), clock, begun))
        };
        let handles: Vec<_> = (0..workers).map(work).collect();
        while !handles.iter().all(|h| h.is_finished()) {
            std::thread::sleep(Duration::from_millis(50));
            let now = clock.elapsed().as_millis() as u64;
            let hangs = |(at, handle): (&AtomicU64, &ScopedJoinHandle<'_, Tally>)| {
                let at = at.load(Ordering::Relaxed);
                !handle.is_finished() && at > 0 && now > at + 6 * LONGEST.as_millis() as u64
            };
            if begun.iter().zip(&handles).any(hangs) {
                eprintln!("{}: hangs", target.name);
                std::process::exit(1);
            }
        }
        let tallies = handles.into_iter().map(|h| {
            h.join().unwrap_or_else(|_| {
                // Not a damaged input: what is damaged was not taken for right before.
                eprintln!("{}: the undamaged inputs are refused", target.name);
                std::process::exit(1)
            })
        });
        tallies.fold(Tally::default(), Tally::and)
    })
}

fn main() -> ExitCode {
    let asked = std::env::args().nth(1);
    let Ok(millions) = asked.as_deref().unwrap_or("1").parse::<f64>() else {
        eprintln!("usage: attack [MILLIONS OF INPUTS]");
        return ExitCode::from(2);
    };
    // What panics says so by being counted.
    std::panic::set_hook(Box::new(|_| {}));
    let from = Instant::now();
    println!(
        "| target | executions | taken | panics | beyond 10 s | beyond 64 times the size | most memory | longest |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|");
    let row = |name: &str, t: &Tally| {
        println!(
            "| {name} | {} | {} | {} | {} | {} | {:.1} kB | {:.1} ms |",
            t.done,
            t.taken,
            t.panics,
            t.slow,
            t.large,
            t.most as f64 / 1e3,
            t.longest.as_secs_f64() * 1e3
        );
    };
    let mut all = Tally::default();
    for (number, target) in (0..).zip(targets::all()) {
        let count = (millions * 1e6 * target.share).ceil() as u64;
        let tally = campaign(&target, number, count);
        row(target.name, &tally);
        all = all.and(tally);
    }
    row("all", &all);
    println!("\n{:.0} s", from.elapsed().as_secs_f64());
    if all.broken() == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
