//! What reading a large table of numbers costs: 100 MB of CSV, as `Log::read` does it, beside the raw records of the
//! crate `csv` with the crate `fast-float2` for their numbers, which keep nothing but a sum, and beside that with the
//! columns kept. In turns, medians of five.
//!
//! `cargo bench -p loopsight-tests --bench reading`

#![allow(
    clippy::expect_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use loopsight_recordings::{Source, read};

/// Bytes of the table where it measures, and where it only shows that it works.
const BYTES: usize = 100_000_000;
const FEW: usize = 1_000_000;
/// Turns whose middle is the measure.
const TURNS: usize = 5;

/// A table of four columns at 1 kHz, with so many digits behind the points; all that a number has where there are none.
fn table(bytes: usize, digits: Option<usize>) -> String {
    let mut text = String::with_capacity(bytes + 100);
    text.push_str("time_s,voltage_V,speed_rad/s,angle_rad\n");
    let (mut state, mut k) = (5u64, 0u32);
    let mut random = move || {
        state = (state.wrapping_mul(6_364_136_223_846_793_005)).wrapping_add(1);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    while text.len() < bytes {
        let (time, volts) = (f64::from(k) / 1000.0, f64::from(k / 500 % 7) - 3.0);
        let (speed, angle) = (20.0 * (random() - 0.5), 300.0 * random());
        let _ = match digits {
            Some(n) => writeln!(text, "{time:.3},{volts},{speed:.n$},{angle:.n$}"),
            None => writeln!(text, "{time},{volts},{speed},{angle}"),
        };
        k += 1;
    }
    text
}

/// Rows and sum of all fields, as the raw reader gives them; `keep` gets each number.
fn raw(path: &Path, mut keep: impl FnMut(f64)) -> usize {
    let mut reader = csv::Reader::from_path(path).expect("a file");
    let mut record = csv::ByteRecord::new();
    let mut rows = 0;
    while reader.read_byte_record(&mut record).expect("a record") {
        for field in &record {
            keep(fast_float2::parse(field).expect("a number"));
        }
        rows += 1;
    }
    rows
}

fn ours(path: &Path) -> usize {
    let Source::Table(table) = read(path).expect("a table") else {
        return 0;
    };
    let values: usize = table.runs.iter().map(|run| run.rows.len()).sum();
    values / table.columns.len()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() {
    // Cargo says `--bench` where it measures; without it this shows that it works.
    let measures = std::env::args().any(|a| a == "--bench");
    let (bytes, turns) = if measures { (BYTES, TURNS) } else { (FEW, 1) };
    let folder = tempfile::tempdir().expect("a folder");
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one = one.expect("a thread");
    for (name, digits) in [("six digits", Some(6)), ("all digits", None)] {
        let path = folder.path().join("table.csv");
        std::fs::write(&path, table(bytes, digits)).expect("room for a file");
        let mut times = [const { Vec::new() }; 4];
        let mut rows = [0; 4];
        for _ in 0..turns {
            let ways: [&dyn Fn() -> usize; 4] = [
                &|| {
                    let mut sum = 0.0;
                    let rows = raw(&path, |value| sum += value);
                    black_box(sum);
                    rows
                },
                &|| {
                    let mut values = Vec::new();
                    let rows = raw(&path, |value| values.push(value));
                    black_box(&values);
                    rows
                },
                &|| one.install(|| ours(&path)),
                &|| ours(&path),
            ];
            for (way, (times, rows)) in ways.iter().zip(times.iter_mut().zip(&mut rows)) {
                let from = Instant::now();
                *rows = way();
                times.push(from.elapsed().as_secs_f64());
            }
        }
        assert!(rows.iter().all(|n| *n == rows[0]), "{rows:?}");
        let [sum, kept, on_one, on_all] = times.map(|t| {
            if measures {
                bytes as f64 / 1e6 / median(t)
            } else {
                f64::NAN
            }
        });
        println!(
            "{} MB of CSV, {name}: {on_all:.0} MB/s on {} threads, {on_one:.0} on one; the crate csv with fast-float2 {sum:.0} MB/s \
             without keeping anything, {kept:.0} with its numbers kept; ratio on one thread {:.2}",
            bytes / 1_000_000,
            rayon::current_num_threads(),
            on_one / kept
        );
    }
}
