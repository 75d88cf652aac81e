//! The picture of an effect's symptom.

use loopsight_core::{PlaceKind, Shows};
use loopsight_diagnosis::{
    Comparison, Diagnosis, EffectAt, Explanation, ForceDependence, Measurements, ResidualForce,
    RunTrace, Work, compare, diagnose, residual_force,
};
use loopsight_hidden::{Experiment, Hidden, Recording, catalogue, record};
use loopsight_model::model::Model;
use loopsight_model::registry;
use loopsight_report::{FigurePanel, FigureTrace, MeanAt, MeanOver, Style, symptom_svg};

/// Of the experiment.
const SEED: u64 = 1;
/// Samples of a stretch that is drawn: four seconds at 100 Hz.
const STRETCH: usize = 400;
/// A quantity is drawn with the missing force where it accounts for more of that than this share of what another one accounts
/// for of the residual.
const TELLING: f64 = 0.5;
/// Means over a quantity.
const BINS: usize = 16;

/// A picture, and what it shows.
pub(crate) struct Picture {
    pub(crate) svg: String,
    pub(crate) caption: String,
}

/// The picture of an effect on the first machine that has it; none where nothing can be said of its recording.
pub(crate) fn picture(effect: Hidden) -> Option<Picture> {
    let effects = registry::effects();
    let meta = effects.iter().find(|meta| meta.id == effect.id())?;
    let (robot, _) = catalogue().into_iter().find(|(_, e)| *e == effect)?;
    // Hard to miss.
    let size = effect.sizes()[2];
    let log = record(robot, &[(effect, size)], Experiment::Mixed, SEED).ok()?;
    let test = record(robot, &[(effect, size)], Experiment::MultiLevel, SEED + 1).ok()?;
    let (model, _) = Model::from_toml("hidden", &log.model_toml).ok()?;
    let (runs, tests) = ([log.run.clone()], [test.run.clone()]);
    let measurements = Measurements::new(&runs).tested_on(Some(&tests));
    let found = diagnose(&model, &measurements, &Work::quiet()).ok()?;
    let plain = found.model.as_ref()?;
    let seen = Measurements::new(&runs);
    let before = compare(plain, &seen, &Work::quiet()).ok()?;
    // The effect itself, where another one explains this recording as well.
    let itself = found
        .candidates
        .iter()
        .find(|c| c.place.effect == effect.id());
    // Nothing is tried where the plain model leaves hardly more than noise.
    let best = itself.or(found.candidates.first());
    let with = best.map_or(plain, |best| &best.model);
    let after = compare(with, &seen, &Work::quiet()).ok()?;

    let signal = furthest_off(&before)?;
    let stretch = stretch(&before.runs[0], &after.runs[0], signal);
    // A plain model that takes the effect up is right before the fit.
    let beside = found.missing.as_ref().map_or(&model, |_| with);
    let right = with_right_values(plain, beside);
    let off = compare(&right, &seen, &Work::quiet()).ok()?;
    let force = residual_force(&right, &runs, &Work::quiet()).ok()?;
    let residual = of_residual(&off.runs[0], furthest_off(&off)?);
    // What stands between the machine and the log is no force.
    let over = force
        .as_ref()
        .and_then(|f| of_force(f, meta.shows == Shows::OneRun));
    let over = over
        .filter(|(_, told)| *told > TELLING * residual.1)
        .filter(|_| meta.places[0] != PlaceKind::Output);
    let (over, share) = over.unwrap_or(residual);
    let title = format!("{}: {}", robot.name(), log.truth.hidden.first()?.doc);
    let caption = caption(&log, &found, best, [&before, &after], &over, share);
    Some(Picture {
        svg: symptom_svg(&title, &stretch, &over),
        caption,
    })
}

fn caption(
    log: &Recording,
    found: &Diagnosis,
    best: Option<&Explanation>,
    [before, after]: [&Comparison; 2],
    over: &MeanOver,
    share: f64,
) -> String {
    let percent = |share: f64| format!("{:.*} %", usize::from(share < 0.1), 100.0 * share);
    let left = percent(before.nrmse);
    let floor = percent(log.floor());
    let fitted = if let Some(best) = best
        && found.missing.is_some()
    {
        let name = |place: &EffectAt| format!("`{}` at {}", place.effect, place.at.join(" and "));
        let first = &found.candidates[0].place;
        let as_well = if *first == best.place {
            String::new()
        } else {
            format!(" {} explains it as well.", name(first))
        };
        format!(
            "The plain model, fitted to this recording, leaves {left} of the signals' deviation. With {} it leaves {}; the \
             resolution of the sensors leaves {floor}.{as_well}",
            name(&best.place),
            percent(after.nrmse),
        )
    } else {
        format!(
            "The plain model, fitted to this recording, leaves {left} of the signals' deviation, and the resolution of the \
             sensors {floor}: its own parameters take the effect up, and only another measurement would show it."
        )
    };
    format!(
        "{fitted} Where the model's own parameters are right, the mean over {} accounts for {} of the variance of the {}.",
        over.quantity,
        percent(share),
        over.label,
    )
}

/// The model without the effect, at the values that its own parameters have beside it. They are fixed: what is missing is all
/// that the effect does.
fn with_right_values(plain: &Model, best: &Model) -> Model {
    let mut right = plain.clone();
    for parameter in &mut right.parameters {
        let beside = best.parameters.iter().find(|p| p.name == parameter.name);
        parameter.value = beside.and_then(|p| p.value).or(parameter.value);
        parameter.free = false;
    }
    right
}

/// The signal with the greatest error.
fn furthest_off(comparison: &Comparison) -> Option<usize> {
    (0..comparison.signals.len()).max_by(|a, b| {
        comparison.signals[*a]
            .nrmse
            .total_cmp(&comparison.signals[*b].nrmse)
    })
}

/// The stretch in which the plain model is furthest off, and which moves.
fn stretch(before: &RunTrace, after: &RunTrace, signal: usize) -> FigurePanel {
    let of = &before.signals[signal];
    let squares: Vec<f64> = of
        .measured
        .iter()
        .zip(&of.free_run)
        .map(|(y, m)| if y.is_finite() { (y - m).powi(2) } else { 0.0 })
        .collect();
    let length = STRETCH.min(squares.len());
    let from = (0..=squares.len() - length)
        .step_by(length / 8)
        .max_by(|a, b| {
            let sum = |from: usize| squares[from..from + length].iter().sum::<f64>();
            sum(*a).total_cmp(&sum(*b))
        })
        .unwrap_or(0);
    let part = from..from + length;
    let trace = |name: &str, style, values: &[f64]| FigureTrace {
        name: name.to_owned(),
        style,
        time: before.time[part.clone()].to_vec(),
        values: values[part.clone()].to_vec(),
        step: false,
    };
    FigurePanel {
        label: of.id.clone(),
        unit: of.unit.clone(),
        traces: vec![
            trace("measured", Style::Measured, &of.measured),
            trace("plain model", Style::Model, &of.free_run),
            trace(
                "with the effect",
                Style::Other,
                &after.signals[signal].free_run,
            ),
        ],
    }
}

/// The force over the quantity that tells most of it, and the share it tells; none where there is no curve. Time is one where
/// the effect `drifts`: what depends on the position looks as if it depended on time, too.
fn of_force(force: &ResidualForce, drifts: bool) -> Option<(MeanOver, f64)> {
    let mut quantities = force.depends_on.iter();
    let most: &ForceDependence = quantities.find(|d| drifts || d.quantity != "time")?;
    (!most.curves.is_empty()).then(|| {
        let curves = most.curves.iter().map(|curve| {
            let points = curve.bins.iter().map(|bin| MeanAt {
                at: bin.center,
                mean: bin.mean,
                std_error: bin.std_error,
            });
            let name = if curve.direction == "all" {
                ""
            } else {
                curve.direction
            };
            (name.to_owned(), points.collect())
        });
        let over = MeanOver {
            quantity: most.quantity.clone(),
            quantity_unit: most.unit.clone(),
            label: "missing force".into(),
            unit: force.unit.clone(),
            curves: curves.collect(),
        };
        (over, most.share_of_variance)
    })
}

/// The residual of a signal over that quantity of the machine, or its rate of change, which tells most of it.
fn of_residual(run: &RunTrace, signal: usize) -> (MeanOver, f64) {
    let of = &run.signals[signal];
    let residual: Vec<f64> = of
        .measured
        .iter()
        .zip(&of.free_run)
        .map(|(y, m)| y - m)
        .collect();
    let mut quantities = Vec::new();
    for s in &run.signals {
        quantities.push((s.id.clone(), s.unit.clone(), s.free_run.clone()));
        let rate = rate(&run.time, &s.free_run);
        let unit = match s.unit.strip_suffix("/s") {
            Some(of) => format!("{of}/s^2"),
            None => format!("{}/s", s.unit),
        };
        quantities.push((format!("rate of {}", s.id), unit, rate));
    }
    quantities.extend(run.inputs.iter().cloned());
    let (quantity, quantity_unit, (points, share)) = quantities
        .into_iter()
        .map(|(name, unit, x)| (name, unit, means(&x, &residual)))
        .max_by(|a, b| a.2.1.total_cmp(&b.2.1))
        .unwrap_or_default();
    let over = MeanOver {
        quantity,
        quantity_unit,
        label: format!("residual of {}", of.id),
        unit: of.unit.clone(),
        curves: vec![(String::new(), points)],
    };
    (over, share)
}

/// Central differences; NaN at the ends.
fn rate(time: &[f64], values: &[f64]) -> Vec<f64> {
    let mut rate = vec![f64::NAN; values.len()];
    for k in 1..values.len().saturating_sub(1) {
        rate[k] = (values[k + 1] - values[k - 1]) / (time[k + 1] - time[k - 1]);
    }
    rate
}

/// Means of `y` over as many samples of `x` each, and the share of the squares of `y` that they account for.
fn means(x: &[f64], y: &[f64]) -> (Vec<MeanAt>, f64) {
    let mut points: Vec<(f64, f64)> = x.iter().copied().zip(y.iter().copied()).collect();
    points.retain(|(x, y)| x.is_finite() && y.is_finite());
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = points.iter().map(|(_, y)| y * y).sum();
    let mut told = 0.0;
    let bins = points
        .chunks(points.len().div_ceil(BINS).max(1))
        .map(|chunk| {
            let n = chunk.len() as f64;
            let at = chunk.iter().map(|(x, _)| x).sum::<f64>() / n;
            let mean = chunk.iter().map(|(_, y)| y).sum::<f64>() / n;
            let variance = chunk.iter().map(|(_, y)| (y - mean).powi(2)).sum::<f64>() / n;
            told += n * mean * mean;
            MeanAt {
                at,
                mean,
                std_error: (variance / n).sqrt(),
            }
        });
    let bins = bins.collect();
    (bins, if total > 0.0 { told / total } else { 0.0 })
}
