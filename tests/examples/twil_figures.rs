//! Draws the pictures of `examples/twil/README.md`, the counterparts of the paper's Figs 4 to 11:
//!
//! ```text
//! cargo run --release -p loopsight-tests --example twil_figures
//! ```
//!
//! Figs 4 to 7 hold `fitted.toml` against the logs; Figs 8 to 11 run the loop files, as
//! `loopsight run` does. Everything is seeded, so the pictures come out the same.

use std::error::Error;
use std::path::{Path, PathBuf};

use loopsight::{CompareOptions, Log, Session};
use loopsight_controllers as _;
use loopsight_drivers::{Limit, Simulated};
use loopsight_estimators as _;
use loopsight_model::config::{TomlSource, read_text};
use loopsight_model::loop_file::LoopFile;
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, DriverContext, DriverPart};
use loopsight_plants as _;
use loopsight_report::{Figure, FigurePanel, FigureTrace, Style, figure_svg};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// What the vertical axis shows, for the two controlled signals.
const LABELS: [(&str, &str); 2] = [("linear velocity", "m/s"), ("angular velocity", "rad/s")];

fn main() -> Outcome<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/twil");
    let figures = folder.join("figures");
    std::fs::create_dir_all(&figures)?;
    let save = |name: &str, panels: Vec<FigurePanel>| -> Outcome<()> {
        let path = figures.join(name);
        let figure = Figure {
            title: String::new(),
            panels,
        };
        let svg = figure_svg(&figure);
        std::fs::write(&path, &svg)?;
        println!("{name}: {:.0} kB", svg.len() as f64 / 1000.0);
        Ok(())
    };

    let model = folder.join("fitted.toml");
    for (log, names) in [
        ("prbs.csv", ["fig04.svg", "fig05.svg"]),
        ("steps.csv", ["fig06.svg", "fig07.svg"]),
    ] {
        let panels = against_log(&model, &folder.join(log))?;
        for (name, panel) in names.into_iter().zip(panels) {
            save(name, vec![panel])?;
        }
    }

    for (file, name, signal) in [
        ("linearization_forward.toml", "fig08.svg", 0),
        ("linearization_turn.toml", "fig09.svg", 1),
    ] {
        save(name, vec![linearization(&folder.join(file), signal)?])?;
    }

    let paper = drive(&folder.join("loop.toml"), None)?;
    let exact = drive(&folder.join("loop_exact.toml"), None)?;
    for (signal, name) in ["fig10.svg", "fig11.svg"].into_iter().enumerate() {
        save(name, vec![tracking(&paper, signal)])?;
    }
    save(
        "settling.svg",
        vec![
            settling(&paper, "paper's rule"),
            settling(&exact, "exact rule"),
        ],
    )
}

/// Figs 4 to 7: measured and free run, for each signal.
fn against_log(model: &Path, log: &Path) -> Outcome<Vec<FigurePanel>> {
    let session = Session::new(loopsight::Model::from_file(model)?, Log::read(log)?)?;
    let answer = session.compare(&CompareOptions::default().series(true))?;
    let series = answer.series.unwrap_or_default();
    Ok(series
        .iter()
        .enumerate()
        .map(|(signal, s)| {
            let traces = vec![
                line("measured", Style::Measured, &s.time_s, &s.measured),
                line("model", Style::Model, &s.time_s, &s.model),
            ];
            panel(signal, traces)
        })
        .collect())
}

/// Figs 8 and 9: what was asked for, what the model does with it, and what the robot did.
fn linearization(file: &Path, signal: usize) -> Outcome<FigurePanel> {
    let measured = drive(file, None)?;
    let model = Simulated {
        limit: Some(Limit::All(12.0)),
        quantize: false,
        ..Simulated::default()
    };
    let simulated = drive(file, Some(Box::new(model)))?;
    let top = simulated.measured[signal]
        .iter()
        .copied()
        .fold(0.0, f64::max);
    let asked = &measured.ideal[signal];
    let shown = asked.iter().take_while(|v| **v <= top).count();
    Ok(panel(
        signal,
        vec![
            line(
                "measured",
                Style::Measured,
                &measured.time,
                &measured.measured[signal],
            ),
            line(
                "asked for",
                Style::Reference,
                &measured.time[..shown],
                &asked[..shown],
            ),
            line(
                "simulated",
                Style::Model,
                &simulated.time,
                &simulated.measured[signal],
            ),
        ],
    ))
}

/// Figs 10 and 11: reference, measured, and what the design promises.
fn tracking(run: &Driven, signal: usize) -> FigurePanel {
    let reference = &run.reference[signal];
    panel(
        signal,
        vec![
            line(
                "measured",
                Style::Measured,
                &run.time,
                &run.measured[signal],
            ),
            FigureTrace {
                step: true,
                ..line("reference", Style::Reference, &run.time, reference)
            },
            line(
                "promised by H(s)",
                Style::Model,
                &run.time,
                &run.ideal[signal],
            ),
        ],
    )
}

/// The first step, 0 to 0.1 m/s: promised and measured, with the band of 2 %.
fn settling(run: &Driven, rule: &str) -> FigurePanel {
    let (from, to) = (100, 190);
    let time: Vec<f64> = (from..to).map(|k| run.time[k] - run.time[from]).collect();
    let end = time[time.len() - 1];
    let goal = run.reference[0][from];
    let band = FigureTrace {
        name: "±2 %".to_owned(),
        style: Style::Reference,
        // A gap between the two lines.
        time: vec![0.0, end, f64::NAN, 0.0, end],
        values: vec![1.02 * goal, 1.02 * goal, f64::NAN, 0.98 * goal, 0.98 * goal],
        step: false,
    };
    let panel = panel(
        0,
        vec![
            line(
                "measured",
                Style::Measured,
                &time,
                &run.measured[0][from..to],
            ),
            band,
            line(
                "promised by H(s)",
                Style::Model,
                &time,
                &run.ideal[0][from..to],
            ),
        ],
    );
    FigurePanel {
        label: format!("{rule}: {}", panel.label),
        ..panel
    }
}

/// A loop that was run.
struct Driven {
    time: Vec<f64>,
    reference: Vec<Vec<f64>>,
    measured: Vec<Vec<f64>>,
    ideal: Vec<Vec<f64>>,
}

/// Runs a loop file to its end; `robot` takes the place of its driver.
fn drive(path: &Path, robot: Option<Box<dyn DriverPart>>) -> Outcome<Driven> {
    let text = read_text(path)?;
    let source = TomlSource::parse(&path.display().to_string(), &text)?;
    let mut file = LoopFile::parse(&source)?;
    if let Some(robot) = robot {
        file.driver = robot;
    }
    let beside = |name: &str| -> PathBuf { path.with_file_name(name) };
    let (model, _) = Model::load(&beside(&file.model))?;
    let context = DriverContext {
        model: &model,
        period: file.period_s,
        load_model: &|name| {
            Model::load(&beside(name))
                .map(|(model, _)| model)
                .map_err(|e| BuildError::at("model", e.to_string()))
        },
        load_runs: &|_, _| Err(BuildError::at("recording", "nothing is replayed here")),
        read_column: &|_, _| {
            Err(BuildError::at(
                "path",
                "no reference comes from a file here",
            ))
        },
    };
    let mut composed = file.compose(&source, &model, &context)?;
    let n = composed.controlled.len();
    let ticks = (file.duration_s.ok_or("the loop has no end")? / file.period_s).round() as usize;
    let mut driven = Driven {
        time: Vec::new(),
        reference: vec![Vec::new(); n],
        measured: vec![Vec::new(); n],
        ideal: Vec::new(),
    };
    for k in 0..ticks {
        let time = k as f64 * file.period_s;
        let reference: Vec<f64> = composed.references.iter().map(|r| r.sample(time)).collect();
        let step = composed
            .host
            .tick(&reference)
            .map_err(|e| format!("{e:?}"))?;
        driven.time.push(time);
        for (series, value) in driven.reference.iter_mut().zip(&reference) {
            series.push(*value);
        }
        for (series, value) in driven.measured.iter_mut().zip(step.measured) {
            series.push(*value);
        }
    }
    driven.ideal = file
        .controller
        .ideal(&driven.reference, file.period_s)
        .ok_or("the controller promises nothing")?;
    Ok(driven)
}

fn panel(signal: usize, traces: Vec<FigureTrace>) -> FigurePanel {
    FigurePanel {
        label: LABELS[signal].0.to_owned(),
        unit: LABELS[signal].1.to_owned(),
        traces,
    }
}

fn line(name: &str, style: Style, time: &[f64], values: &[f64]) -> FigureTrace {
    let kept = visible(values);
    FigureTrace {
        name: name.to_owned(),
        style,
        time: kept.iter().map(|k| time[*k]).collect(),
        values: kept.iter().map(|k| values[*k]).collect(),
        step: false,
    }
}

/// The samples without which a line would look different: those that leave the straight line
/// between their neighbours by more than a five-hundredth of the range.
fn visible(values: &[f64]) -> Vec<usize> {
    let n = values.len();
    if n < 3 {
        return (0..n).collect();
    }
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(*v), h.max(*v))
        });
    let tolerance = (high - low) / 500.0;
    // Ramer, Douglas and Peucker: split at the sample farthest from the chord.
    let mut keep = vec![false; n];
    keep[0] = true;
    keep[n - 1] = true;
    let mut open = vec![(0, n - 1)];
    while let Some((a, b)) = open.pop() {
        let chord =
            |k: usize| values[a] + (values[b] - values[a]) * (k - a) as f64 / (b - a) as f64;
        let off = |k: usize| (values[k] - chord(k)).abs();
        let farthest = (a + 1..b).max_by(|i, j| off(*i).total_cmp(&off(*j)));
        if let Some(k) = farthest.filter(|k| off(*k) > tolerance) {
            keep[k] = true;
            open.extend([(a, k), (k, b)]);
        }
    }
    (0..n).filter(|k| keep[*k]).collect()
}
