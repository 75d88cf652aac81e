//! What `compare` and `diagnose` cost as a log gets longer, or is sampled faster: an axis with hidden dry friction, beside
//! free runs of the plain model over the same log in the same minute. Processor time of all threads, so what else the
//! machine does matters little; on Linux only. Prints the tables of `docs/performance.md` and draws its curves.
//!
//! `cargo run --release -p loopsight-tests --example cost -- docs/figures/cost.svg`

#![allow(
    clippy::expect_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

use std::hint::black_box;
use std::path::Path;

use loopsight_diagnosis::{Measurements, Work, compare, diagnose};
use loopsight_model::model::Model;
use loopsight_model::run::{Rows, Run};
use loopsight_model::simulate::{Simulator, free_run};
use loopsight_plants as _;
use loopsight_recordings::output::save;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Lengths of the logs, s, and how often these are sampled, Hz.
const LENGTHS: [usize; 5] = [40, 100, 300, 1000, 3600];
const USUAL_RATE: usize = 1000;
/// How often logs of one length are sampled, Hz, and that length, s.
const RATES: [usize; 5] = [50, 100, 200, 500, 1000];
const USUAL_LENGTH: usize = 100;
/// Voltages in a second.
const LEVELS_PER_SECOND: usize = 2;
/// Width of the sensor's noise, rad/s: that of 0.05 rad/s standard deviation if it is uniform.
const NOISE: f64 = 0.173;

const PLAIN: &str = "name = \"axis\"\n[plant.dc_axis]\nK_A = -6.0\nK_C = 2.0\n[log.measured.speed]\nsensor = \"instantaneous\"\n";
const TRUTH: &str = "name = \"axis\"\n[plant.dc_axis]\nK_A = -6.4\nK_C = 2.1\n[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 0.8\n[log.measured.speed]\nsensor = \"instantaneous\"\n";

fn model(text: &str) -> Model {
    Model::from_toml("axis", text).expect("a model").0
}

/// Seven levels of ±9 V, drawn anew every half second, and the speed with noise.
fn log(seconds: usize, rate: usize) -> Run {
    let mut state = 5u64;
    let mut random = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let samples = seconds * rate + 1;
    let held = rate / LEVELS_PER_SECOND;
    let mut volts = 0.0;
    let inputs: Vec<f64> = (0..samples)
        .map(|k| {
            if k % held == 0 {
                volts = 3.0 * ((7.0 * random()).floor() - 3.0);
            }
            volts
        })
        .collect();
    let time: Vec<f64> = (0..samples).map(|k| k as f64 / rate as f64).collect();
    let truth = model(TRUTH);
    let unknown = Rows::new(1, vec![f64::NAN; samples]);
    let driven = Run::new("", time, Rows::new(1, inputs), unknown).expect("a run");
    let mut simulator = Simulator::new(&truth, &truth.values());
    let mut speed = Vec::with_capacity(samples);
    free_run(
        &mut simulator,
        &vec![0.0; truth.n_states()],
        &driven,
        |_, y| {
            speed.push(y[0] + NOISE * (random() - 0.5));
        },
    );
    driven.with_measured(speed).expect("as many as before")
}

/// Processor time of this process so far, s.
fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let (_, fields) = stat.rsplit_once(')').unwrap_or_default();
    let ticks = fields.split_whitespace().skip(11).take(2);
    ticks.filter_map(|f| f.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// The most memory that this process had so far, MB.
fn memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.unwrap_or(f64::NAN) / 1024.0
}

/// What some work returns, and the processor time it took, s.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let from = processor();
    let found = work();
    (found, processor() - from)
}

/// What one log costs, s of processor time.
struct Cost {
    free_run: f64,
    compare: f64,
    diagnose: f64,
    found: String,
}

impl Cost {
    fn of(seconds: usize, rate: usize) -> Self {
        let plain = model(PLAIN);
        let x0 = vec![0.0; plain.n_states()];
        let run = log(seconds, rate);
        // As many as take a second or so.
        let runs = 7_200_000 / (seconds * rate);
        let (_, took) = timed(|| {
            let mut simulator = Simulator::new(&plain, &plain.values());
            for _ in 0..runs {
                free_run(&mut simulator, &x0, &run, |_, y| {
                    black_box(y);
                });
            }
        });
        let runs_of_log = [run];
        let measured = Measurements::new(&runs_of_log);
        // The kernel counts in hundredths of a second.
        let compared = 1 + 400_000 / (seconds * rate);
        let (_, compare) = timed(|| {
            for _ in 0..compared {
                let of_log = compare(&plain, &measured, &Work::quiet());
                black_box(of_log.expect("a log of this model"));
            }
        });
        let (found, diagnose) = timed(|| diagnose(&plain, &measured, &Work::quiet()));
        let found = found.expect("a log of this model");
        let best = found.candidates.first().and_then(|c| {
            let (id, estimate) = c.parameters.iter().next()?;
            let error = estimate.std_error.unwrap_or(f64::NAN);
            Some(format!("{id} {:.4} ± {error:.4}", estimate.value))
        });
        let effect = found.missing.map_or("nothing".to_owned(), |m| m.effect);
        Self {
            free_run: took / runs as f64,
            compare: compare / compared as f64,
            diagnose,
            found: format!("{effect} {}", best.unwrap_or_default()),
        }
    }

    /// Cells of a table.
    fn cells(&self) -> String {
        format!(
            "{:.4} s | {:.3} s, {:.0} free runs | {:.1} s, {:.0} free runs",
            self.free_run,
            self.compare,
            self.compare / self.free_run,
            self.diagnose,
            self.diagnose / self.free_run
        )
    }
}

type Picture<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The curves of one panel: what logs cost over their length, or over their rate.
fn draw(panel: &Picture<'_>, title: &str, unit: &str, costs: &[(usize, Cost)]) {
    let from = costs.first().expect("a log").0 as f64;
    let to = costs.last().expect("a log").0 as f64;
    let mut chart = ChartBuilder::on(panel)
        .caption(title, ("sans-serif", 15))
        .margin(12)
        .x_label_area_size(38)
        .y_label_area_size(58)
        .build_cartesian_2d(
            (0.8 * from..1.25 * to).log_scale(),
            (2e-4..100.0).log_scale(),
        )
        .expect("axes");
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_labels(3)
        .x_desc(unit)
        .y_desc("processor time, s")
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|y| format!("{y}"))
        .label_style(("sans-serif", 12))
        .draw()
        .expect("a mesh");
    type Of = fn(&Cost) -> f64;
    let curves: [(&str, RGBColor, Of); 3] = [
        ("diagnose", RGBColor(200, 60, 40), |c| c.diagnose),
        ("compare", RGBColor(40, 90, 170), |c| c.compare),
        ("a free run", RGBColor(90, 90, 90), |c| c.free_run),
    ];
    for (name, color, of) in curves {
        let points: Vec<(f64, f64)> = costs.iter().map(|(x, c)| (*x as f64, of(c))).collect();
        let line = LineSeries::new(points.iter().copied(), color.stroke_width(2)).point_size(3);
        chart.draw_series(line).expect("a curve");
        let above = Pos::new(HPos::Right, VPos::Bottom);
        let style = ("sans-serif", 13).into_font().color(&color).pos(above);
        let named =
            |at: &(f64, f64)| EmptyElement::at(*at) + Text::new(name, (0, -8), style.clone());
        chart.draw_series(points.last().map(named)).expect("a name");
    }
}

fn main() {
    let to = std::env::args().nth(1);
    let to = to.as_deref().unwrap_or("cost.svg");
    println!("| log at 1 kHz | a free run | compare | diagnose | memory | found |");
    println!("|---|---|---|---|---|---|");
    let by_length = LENGTHS.map(|seconds| {
        let cost = Cost::of(seconds, USUAL_RATE);
        let (cells, found) = (cost.cells(), &cost.found);
        println!("| {seconds} s | {cells} | {:.0} MB | {found} |", memory());
        (seconds, cost)
    });
    println!("\n| log of 100 s | a free run | compare | diagnose | found |");
    println!("|---|---|---|---|---|");
    let by_rate = RATES.map(|rate| {
        let cost = Cost::of(USUAL_LENGTH, rate);
        println!("| {rate} Hz | {} | {} |", cost.cells(), cost.found);
        (rate, cost)
    });
    let mut drawing = String::new();
    {
        let picture = SVGBackend::with_string(&mut drawing, (900, 380)).into_drawing_area();
        picture.fill(&WHITE).expect("a picture");
        let (left, right) = picture.split_horizontally(450);
        draw(&left, "logs at 1 kHz", "length, s", &by_length);
        draw(&right, "logs of 100 s", "rate, Hz", &by_rate);
        picture.present().expect("a picture");
    }
    save(Path::new(to), drawing.as_bytes()).expect("a file that can be written");
}
