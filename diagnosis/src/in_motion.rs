//! What a machine takes to move, as a line over its speed: a law of friction in two numbers.

use loopsight_core::{Place, Real, Role};
use loopsight_model::Dual;
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, try_follow};

use crate::criteria::FailsCriteria;
use crate::derived::{estimate, with_gradients};
use crate::estimate::Estimate;
use crate::fitted::Fit;
use crate::motion::rest;
use crate::prediction::InitialStates;
use crate::progress::{Cancelled, Work};

/// The line over the speed that comes nearest to what some `effects` of a fitted model take while it moves:
///
/// ```text
/// -w sign(flow) ≈ level + slope |flow|
/// ```
///
/// by least squares over the samples of `runs` with `|flow|` above a twentieth of its root mean square, at the speeds of
/// the fitted model. The mean over the efforts that the effects act on.
#[derive(Clone, Debug, PartialEq)]
pub struct InMotion {
    /// In the unit of the efforts.
    pub level: Estimate,
    /// The quantity that was asked for, of those that follow from the plant's parameters, with the slope added to it.
    pub with_slope: Option<Estimate>,
}

/// What moves through an effort while it is not at rest, and what makes a line of it.
struct Flow {
    /// The effort.
    place: Place,
    flows: Vec<f64>,
    /// Weights of the samples in the level, and in the slope.
    level: Vec<f64>,
    slope: Vec<f64>,
}

/// [`InMotion`] of the `effects` with these indices. They must act on efforts, read nothing but their flow, and have no
/// states. `steady` is the id of the [derived](loopsight_core::Derived) quantity that says what a speed takes, and the
/// parameter by which a flow becomes that speed, where it is not the speed itself.
///
/// The intervals follow from that of the fit: `√(gᵀ C g)`, where `g` is the gradient by the estimated parameters at the
/// speeds of the fitted model. None where nothing moves.
///
/// # Errors
///
/// [`Cancelled`].
pub fn in_motion(
    fit: &Fit,
    effects: &[usize],
    steady: (&str, Option<&str>),
    runs: &[Run],
    work: &Work<'_>,
) -> Result<Option<InMotion>, Cancelled> {
    let model = &fit.model;
    let flows = flows(model, effects, runs, work)?;
    let first = effects
        .iter()
        .find_map(|i| model.effects.get(*i)?.at.first());
    let (Some(unit), false) = (first.map(|channel| channel.unit), flows.is_empty()) else {
        return Ok(None);
    };
    let derived = model.derived(&model.values());
    let asked = derived.iter().position(|(meta, _)| meta.id == steady.0);
    let radius = steady
        .1
        .map(|name| model.parameters.iter().position(|p| p.name == name));
    let line = |seeded: &[Dual]| -> Vec<Dual> {
        let [mut level, mut slope] = [Dual::of(0.0); 2];
        for at in &flows {
            for (k, flow) in at.flows.iter().enumerate() {
                let taken = taken(model, effects, at.place, seeded, *flow);
                level += taken * Dual::of(at.level[k] / flows.len() as f64);
                slope += taken * Dual::of(at.slope[k] / flows.len() as f64);
            }
        }
        let per = match radius {
            Some(Some(index)) => seeded[index],
            _ => Dual::of(1.0),
        };
        let of_plant = asked.map_or(Dual::of(0.0), |i| model.derived(seeded)[i].1);
        vec![level, of_plant + slope / per]
    };
    let units = [unit, asked.map_or("", |asked| derived[asked].0.unit)];
    let known = fit.known.as_ref();
    let mut found = (with_gradients(model, known, line).into_iter().zip(units))
        .map(|((value, gradient), unit)| estimate(unit, value, &gradient, known));
    let (Some(level), with_slope) = (found.next(), found.next()) else {
        return Ok(None);
    };
    let known_speed = asked.is_some() && radius != Some(None);
    Ok(Some(InMotion {
        level,
        with_slope: with_slope.filter(|_| known_speed),
    }))
}

/// What some effects take at an effort.
fn taken(model: &Model, effects: &[usize], place: Place, values: &[Dual], flow: f64) -> Dual {
    let acts = |i: &&usize| model.effects[**i].at.iter().any(|c| c.place == place);
    let added = effects.iter().filter(acts);
    let added = added.map(|i| model.effort_at(*i, values, Dual::of(flow)));
    added.fold(Dual::of(0.0), |sum, added| {
        sum - added * Dual::of(flow.signum())
    })
}

/// The flows at the efforts that effects act on, where something moves there.
fn flows(
    model: &Model,
    effects: &[usize],
    runs: &[Run],
    work: &Work<'_>,
) -> Result<Vec<Flow>, Cancelled> {
    let mut places: Vec<(Place, usize)> = Vec::new();
    for channel in effects
        .iter()
        .filter_map(|i| model.effects.get(*i))
        .flat_map(|e| &e.at)
    {
        let signal = channel.read(Role::Flow).map(|id| model.find_signal(id));
        if let Some(Ok(signal)) = signal
            && !places.iter().any(|(place, _)| *place == channel.place)
        {
            places.push((channel.place, signal));
        }
    }
    let values = model.values();
    let initial = InitialStates::estimate(model, &values, runs, work)?;
    let mut simulator = Simulator::new(model, &values);
    let mut flows = vec![Vec::new(); places.len()];
    for (run, x0) in runs.iter().zip(&initial.states) {
        try_follow(&mut simulator, x0.as_slice(), run, |_, _, now| {
            work.go_on()?;
            let of_plant = now.signals();
            for (flows, (_, signal)) in flows.iter_mut().zip(&places) {
                flows.push(of_plant[*signal]);
            }
            Ok(())
        })?;
    }
    let found = flows.into_iter().zip(places);
    Ok(found
        .filter_map(|(flows, (place, _))| Flow::of(place, flows))
        .collect())
}

impl Flow {
    /// None where the flow does not tell a line.
    fn of(place: Place, mut flows: Vec<f64>) -> Option<Self> {
        let least = rest(flows.iter().copied(), FailsCriteria::DEFAULT.rest);
        flows.retain(|flow| flow.abs() > least);
        let n = flows.len() as f64;
        let mean = flows.iter().map(|v| v.abs()).sum::<f64>() / n;
        let spread = flows.iter().map(|v| (v.abs() - mean).powi(2)).sum::<f64>();
        let slope: Vec<f64> = flows.iter().map(|v| (v.abs() - mean) / spread).collect();
        let level: Vec<f64> = slope.iter().map(|slope| 1.0 / n - mean * slope).collect();
        let tells = level.iter().all(|weight| weight.is_finite()) && !level.is_empty();
        tells.then_some(Self {
            place,
            flows,
            level,
            slope,
        })
    }
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;
    use crate::settings::Method;
    use crate::swing::swing;

    const AXIS: &str = "[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n[log.measured.speed]\n";
    const STRIBECK: &str = "[[effect]]\n[effect.stribeck_friction]\nat = [\"shaft\"]\nlevel = 0.2\nextra = 0.5\nspeed = 9.0\nwidth = 0.01\n";
    const DRAG: &str = "[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 0.5\nwidth = 0.01\n[[effect]]\n[effect.quadratic_drag]\nat = [\"shaft\"]\ncoefficient = 0.002\n";

    /// The speeds of a run above rest.
    fn moving(run: &Run) -> Vec<f64> {
        let speeds = run.measured().iter().copied();
        let least = rest(speeds.clone(), FailsCriteria::DEFAULT.rest);
        speeds.filter(|speed| speed.abs() > least).collect()
    }

    /// The line through a law over some speeds, by the normal equations.
    fn line(speeds: &[f64], law: impl Fn(f64) -> f64) -> [f64; 2] {
        let [mut n, mut x, mut xx, mut y, mut xy] = [0.0; 5];
        for v in speeds.iter().map(|v| v.abs()) {
            n += 1.0;
            x += v;
            xx += v * v;
            y += law(v);
            xy += v * law(v);
        }
        let slope = (n * xy - x * y) / (n * xx - x * x);
        [(y - slope * x) / n, slope]
    }

    #[test]
    fn a_law_of_friction_is_the_line_that_comes_nearest() {
        type Law = fn(f64) -> f64;
        let cases: [(&str, &[usize], Law); 2] = [
            (STRIBECK, &[0], |v| 0.2 + 0.5 * (-(v / 9.0).powi(2)).exp()),
            (DRAG, &[0, 1], |v| 0.5 + 0.002 * v * v),
        ];
        for (effects, indices, law) in cases {
            let (model, _) = Model::from_toml("axis.toml", &format!("{AXIS}{effects}")).unwrap();
            let run = swing(&model, 1000);
            let [level, slope] = line(&moving(&run), law);
            let fit = Fit::cancelled(model, Method::OutputError, 0.0, 0);
            let work = Work::quiet();
            let found = in_motion(&fit, indices, ("kV", None), &[run], &work)
                .unwrap()
                .unwrap();
            let with_slope = found.with_slope.unwrap();
            assert!((found.level.value - level).abs() < 1e-3, "{level}");
            assert_eq!(found.level.unit, "V");
            let steady = fit.derived["kV"].value + slope;
            assert!((with_slope.value - steady).abs() < 1e-3, "{steady}");
            assert_eq!(with_slope.unit, fit.derived["kV"].unit);
        }
    }

    #[test]
    fn what_stands_still_has_no_line() {
        let (model, _) = Model::from_toml("axis.toml", &format!("{AXIS}{STRIBECK}")).unwrap();
        let mut run = Run::empty(1, 1);
        for k in 0..100 {
            run.push(0.01 * f64::from(k), &[0.0], &[0.0]).unwrap();
        }
        let fit = Fit::cancelled(model, Method::OutputError, 0.0, 0);
        let found = in_motion(&fit, &[0], ("kV", None), &[run], &Work::quiet());
        assert_eq!(found.unwrap(), None);
    }
}
