//! What a linearised fit says: values, standard errors, intervals, verdicts.

use std::collections::BTreeMap;

use loopsight_model::model::ModelParameter;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::compare::Comparison;
use crate::derived::{Known, derived};
use crate::estimate::{Estimate, OfRun, ParameterVerdict};
use crate::fitted::Fit;
use crate::flatness::Flatness;
use crate::problem::Problem;
use crate::settings::Method;
use loopsight_model::run::shortest_period;

/// A parameter by its index, with the unknowns that it is made of, and how much 1 of each is of it.
type Shares = (usize, Vec<(usize, f64)>);

impl Problem<'_> {
    /// The parameter values at a solution; those next to the end of their range are there.
    pub(crate) fn values_at(&self, solution: &DVector<f64>) -> Vec<f64> {
        let (mut values, _) = self.unpack(solution);
        for i in &self.free {
            // The solver stays strictly inside the range. A value next to the end means the end.
            let declaration = self.model.parameters[*i].declaration;
            for end in [declaration.bounds().0, declaration.bounds().1] {
                if (values[*i] - end).abs() < 1e-9 * self.model.parameters[*i].scale() {
                    values[*i] = end;
                }
            }
        }
        values
    }

    /// Half the width of an interval, in standard errors, where so many unknowns were estimated.
    pub(crate) fn quantile(&self, unknowns: usize) -> f64 {
        let wanted = self.work.criteria().parameters.quantile;
        StudentsT::new(0.0, 1.0, (self.samples - unknowns as f64).max(1.0))
            .map_or(1.96, |t| t.inverse_cdf(wanted))
    }

    /// The estimate of a parameter at `value`, which has the standard error `error` where the data determine it. Half of
    /// its interval is `quantile` of these.
    fn estimate(
        &self,
        parameter: &ModelParameter,
        value: f64,
        error: Option<f64>,
        quantile: f64,
    ) -> Estimate {
        let criteria = &self.work.criteria().parameters;
        let (low, high) = parameter.declaration.bounds();
        let half = quantile * error.unwrap_or(f64::INFINITY);
        let margin = criteria.at_bound * parameter.scale();
        Estimate {
            value,
            unit: parameter.unit.clone(),
            std_error: error,
            // The interval ends where the admissible range ends.
            interval95: error.map(|_| [(value - half).max(low), (value + half).min(high)]),
            verdict: if value - low < margin || high - value < margin {
                ParameterVerdict::AtBound
            } else if half > criteria.not_pinned * value.abs() {
                ParameterVerdict::NotPinned
            } else {
                ParameterVerdict::Good
            },
        }
    }

    /// What is estimated of the model's parameters, by the unknowns of the problem: the free ones, and the means over the
    /// runs of those that differ from run to run. Each with its unknowns, and how much 1 of these is of it.
    fn estimated(&self) -> Vec<Shares> {
        let free = self.free.iter().enumerate();
        let of_all = free.map(|(k, index)| (*index, vec![(k, self.scales[k])]));
        let share = 1.0 / self.runs.len() as f64;
        let of_runs = self.own().map(|(index, columns)| {
            let shares = columns.iter().map(|c| (*c, share * self.scales[*c]));
            (index, shares.collect())
        });
        of_all.chain(of_runs).collect()
    }

    /// The parameters that differ from run to run, each with its unknowns by run.
    fn own(&self) -> impl Iterator<Item = (usize, Vec<usize>)> + '_ {
        let own = self.model.per_run().enumerate();
        own.filter_map(|(k, index)| {
            let place = self.model.n_states() + k;
            let of_run = self.visible.iter().position(|state| *state == place)?;
            let column = |run| self.free.len() + run * self.visible.len() + of_run;
            Some((index, (0..self.runs.len()).map(column).collect()))
        })
    }

    /// The `variance` of a parameter. That of a time has a least value: windings and filters that the model leaves out take some,
    /// too, and nothing in a log tells theirs from that of a delay.
    fn variance_of(&self, parameter: &ModelParameter, variance: f64) -> f64 {
        if !parameter.is_time() {
            return variance;
        }
        let clock = self.work.criteria().parameters.clock;
        let least = (clock * shortest_period(self.runs)).powi(2);
        // What is not known stays so.
        if variance < least { least } else { variance }
    }

    /// What is known of the parameters at unknowns whose scaled `covariance` is this.
    fn known(&self, estimated: &[Shares], covariance: &DMatrix<f64>, flatness: &Flatness) -> Known {
        let of = |i: usize, j: usize| -> f64 {
            let (a, b) = (&estimated[i].1, &estimated[j].1);
            let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
            pairs
                .map(|((i, a), (j, b))| a * b * covariance[(*i, *j)])
                .sum()
        };
        let n = estimated.len();
        let mut own = DMatrix::from_fn(n, n, of);
        for (k, (index, _)) in estimated.iter().enumerate() {
            own[(k, k)] = self.variance_of(&self.model.parameters[*index], own[(k, k)]);
        }
        let open =
            |(_, shares): &Shares| shares.iter().any(|(c, _)| flatness.is_open(*c).is_some());
        Known {
            free: estimated.iter().map(|(index, _)| *index).collect(),
            covariance: own,
            undetermined: estimated.iter().map(open).collect(),
            quantile: self.quantile(covariance.ncols()),
            not_pinned: self.work.criteria().parameters.not_pinned,
        }
    }

    /// What the parameters that differ from run to run are in each.
    fn of_runs(
        &self,
        solution: &DVector<f64>,
        covariance: &DMatrix<f64>,
        flatness: &Flatness,
    ) -> BTreeMap<String, Vec<OfRun>> {
        let quantile = self.quantile(covariance.ncols());
        let of = |(index, columns): (usize, Vec<usize>)| {
            let parameter = &self.model.parameters[index];
            let each = columns.iter().zip(self.runs).map(|(c, run)| {
                let value = solution[*c] * self.scales[*c];
                let variance = covariance[(*c, *c)] * self.scales[*c].powi(2);
                let error = root(self.variance_of(parameter, variance));
                let open = flatness.is_open(*c);
                let error = error.filter(|_| open.is_none());
                let mut estimate = self.estimate(parameter, value, error, quantile);
                estimate.verdict = open.unwrap_or(estimate.verdict);
                OfRun {
                    run: run.name().to_owned(),
                    estimate,
                }
            });
            (parameter.name.clone(), each.collect())
        };
        self.own().map(of).collect()
    }

    /// The fit with this `solution`, whose scaled unknowns have this `covariance`.
    pub(crate) fn fit_of(
        &self,
        solution: &DVector<f64>,
        covariance: &DMatrix<f64>,
        flatness: Flatness,
    ) -> Fit {
        let estimated = self.estimated();
        let known = self.known(&estimated, covariance, &flatness);
        let mut fitted = self.model.clone();
        fitted.set_values(&self.values_at(solution));
        let mut parameters = BTreeMap::new();
        let place = |index: usize| known.free.iter().position(|i| *i == index);
        for (index, parameter) in fitted.parameters.iter().enumerate() {
            let Some(value) = parameter.value else {
                continue;
            };
            let mut estimate = Estimate {
                value,
                unit: parameter.unit.clone(),
                std_error: None,
                interval95: None,
                verdict: ParameterVerdict::Frozen,
            };
            let gradient = fitted.tie_gradient(index);
            if !gradient.is_empty() {
                estimate.verdict = ParameterVerdict::Tied;
                let steps: Vec<(usize, f64)> = gradient
                    .into_iter()
                    .filter_map(|(i, slope)| Some((place(i)?, slope)))
                    .collect();
                let variance: f64 = steps
                    .iter()
                    .flat_map(|a| steps.iter().map(move |b| (a, b)))
                    .map(|((i, a), (j, b))| a * b * known.covariance[(*i, *j)])
                    .sum();
                let determined = steps.iter().all(|(k, _)| !known.undetermined[*k]);
                if let (true, Some(error)) = (determined && !steps.is_empty(), root(variance)) {
                    let half = known.quantile * error;
                    estimate.std_error = Some(error);
                    estimate.interval95 = Some([value - half, value + half]);
                }
            }
            if let Some(k) = place(index) {
                let error = root(known.covariance[(k, k)]).filter(|_| !known.undetermined[k]);
                estimate = self.estimate(parameter, value, error, known.quantile);
                let open = estimated[k]
                    .1
                    .iter()
                    .find_map(|(c, _)| flatness.is_open(*c));
                estimate.verdict = open.unwrap_or(estimate.verdict);
            }
            parameters.insert(parameter.name.clone(), estimate);
        }
        let error = self.best().map_or(f64::NAN, |(error, _)| error);
        Fit {
            comparison: Comparison::of_error(error),
            parameters,
            per_run: self.of_runs(solution, covariance, &flatness),
            derived: derived(&fitted, Some(&known)),
            method: Method::OutputError,
            nrmse_before: None,
            nrmse_fit: error,
            iterations: self.evaluations.get(),
            convergence: None,
            flat: flatness.words,
            cancelled: false,
            known: Some(known),
            model: fitted,
            history: Vec::new(),
        }
    }
}

/// The root of a variance; none where that is not known. One below zero is rounding.
fn root(variance: f64) -> Option<f64> {
    let error = variance.max(0.0).sqrt();
    (variance.is_finite() && error.is_finite()).then_some(error)
}

#[cfg(test)]
mod tests {
    use loopsight_model::model::Model;
    use loopsight_model::run::{Rows, Run};
    use loopsight_plants as _;

    use super::*;
    use crate::diagnose::diagnose;
    use crate::fit::fit;
    use crate::measurements::Measurements;
    use crate::progress::Work;
    use crate::settings::FitSettings;
    use crate::swing::swing;

    fn axis(gain: f64, rest: &str) -> Model {
        let text =
            format!("[plant.dc_axis]\nK_A = -2.0\nK_C = {gain}\n[log.measured.speed]\n{rest}");
        Model::from_toml("axis.toml", &text).unwrap().0
    }

    /// A run of an axis with this gain, and with noise of some deviation: sums of twelve uniform numbers.
    fn run(model: &Model, name: &str, noise: f64, seed: &mut u64) -> Run {
        let clean = swing(model, 400);
        let mut uniform = || {
            *seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (*seed >> 11) as f64 / (1u64 << 53) as f64
        };
        let noisy = clean
            .measured()
            .iter()
            .map(|y| y + noise * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0));
        let measured = Rows::new(1, noisy.collect());
        let inputs = Rows::new(1, clean.inputs().to_vec());
        Run::new(name, clean.time().to_vec(), inputs, measured).unwrap()
    }

    const GAINS: [(f64, &str); 3] = [(6.5, "tired"), (8.0, "half"), (9.0, "fresh")];

    fn on(runs: &[Run]) -> Measurements<'_> {
        Measurements {
            runs,
            test: None,
            faults: &[],
        }
    }

    /// A battery that is another one in each run: each gain is found, and the time constant with all of them.
    #[test]
    fn what_differs_from_run_to_run_is_found_in_each() {
        let (mut inside, mut of) = (0, 0);
        for trial in 0..30u64 {
            let mut seed = 1 + trial;
            let runs: Vec<Run> = (GAINS.iter())
                .map(|(gain, name)| run(&axis(*gain, ""), name, 0.3, &mut seed))
                .collect();
            let model = axis(5.0, "[fit]\nper_run = [\"K_C\"]\n");
            let found = fit(&model, &on(&runs), &FitSettings::default(), &Work::quiet()).unwrap();
            assert!((found.parameters["K_A"].value + 2.0).abs() < 0.1);
            assert_eq!(found.parameters["K_A"].verdict, ParameterVerdict::Good);
            let mean = &found.parameters["K_C"];
            assert!((mean.value - 23.5 / 3.0).abs() < 0.2, "{mean:?}");
            for (each, (gain, name)) in found.per_run["K_C"].iter().zip(GAINS) {
                assert_eq!(each.run, name);
                let [low, high] = each.estimate.interval95.unwrap();
                assert!(high - low < 1.0, "{each:?}");
                of += 1;
                inside += usize::from((low..=high).contains(&gain));
            }
        }
        // 95 % of 90; of 1000 such counts one is below 79.
        assert!((79..=90).contains(&inside), "{inside} of {of}");
    }

    /// However little noise there is, a delay is known no better than the instant at which something acted; in each run, too.
    #[test]
    fn a_delay_is_no_better_known_than_the_instant() {
        let late = "[[effect]]\n[effect.input_delay]\nat = [\"input\"]\ndelay = 0.03\n";
        let truth = axis(8.0, late);
        let mut seed = 5;
        let runs = ["a", "b"].map(|name| run(&truth, name, 1e-5, &mut seed));
        let least = 0.05 * runs[0].median_period();
        let fitted = |rest: &str| {
            let model = axis(8.0, &format!("{late}{rest}"));
            fit(&model, &on(&runs), &FitSettings::default(), &Work::quiet()).unwrap()
        };
        let all = fitted("").parameters["input_delay.delay"].std_error;
        assert!(all.unwrap() >= 0.999 * least, "{all:?} {least}");
        let found = fitted("[fit]\nper_run = [\"input_delay.delay\"]\n");
        for each in &found.per_run["input_delay.delay"] {
            assert!(
                each.estimate.std_error.unwrap() >= 0.999 * least,
                "{each:?}"
            );
        }
        assert!(found.parameters["K_C"].std_error.unwrap() < 1e-3);
    }

    /// What differs from run to run stands in for nothing: friction is named, with the gains of the runs in the model.
    #[test]
    fn an_effect_is_told_from_what_differs() {
        let friction = "[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 0.8\n";
        let mut seed = 7;
        let mut runs: Vec<Run> = (GAINS.iter())
            .map(|(gain, name)| run(&axis(*gain, friction), name, 0.02, &mut seed))
            .collect();
        let model = axis(8.0, "[fit]\nper_run = [\"K_C\"]\n");
        let of = |runs: &[Run]| diagnose(&model, &on(runs), &Work::quiet()).unwrap();
        let found = of(&runs);
        assert_eq!(found.missing.as_ref().unwrap().effect, "coulomb_friction");
        assert!(
            found.candidates[0].nrmse < 1.1 * found.floor.nrmse,
            "{found:?}"
        );
        // With nothing but gains that differ, nothing is missing.
        runs = (GAINS.iter())
            .map(|(gain, name)| run(&axis(*gain, ""), name, 0.02, &mut seed))
            .collect();
        assert!(of(&runs).missing.is_none());
        assert!(
            diagnose(&axis(8.0, ""), &on(&runs), &Work::quiet())
                .unwrap()
                .nominal
                .nrmse
                > 0.05
        );
    }
}
