//! What a candidate promises: the cost after one full Gauss–Newton step from its start.
//!
//! ```text
//! after = rᵀr - gᵀ (JᵀJ)⁺ g        J = [J₀ W]        g = Jᵀ r
//! ```
//!
//! with `r` the residuals at the start, `W` their derivatives by the parameters that the candidate brings, and `J₀` those
//! by the parameters of the plain model. Of these `W` is one of a few columns for every start. `J₀` is that of the plain
//! model at its solution, which all candidates share: a candidate has hardly moved the machine away from there, and
//! the promise only ranks it. So a promise costs one simulation with one or two derivatives, and not with eight.
//!
//! Steps are long here, and a start may be too strong, so a promise is wrong by some per cent. That ranks candidates, but
//! does not say that one explains nothing. There the residuals `r₀` of the plain model are held against everything that the
//! candidate could do to them, at any strength, simulated with the same long steps:
//!
//! ```text
//! left = min ‖r₀ + J [δ w α]ᵀ‖² / min ‖r₀ + J₀ δ‖²        J = [J₀ W r - r₀]
//! ```

use std::rc::Rc;
use std::sync::OnceLock;

use loopsight_model::model::pseudo_inverse;
use nalgebra::{DMatrix, DVector};

use crate::candidates::Candidate;
use crate::gram::gram;
use crate::linearised::Linearised;
use crate::passage::Passage;
use crate::positions::Positions;
use crate::prediction::Solution;
use crate::problem::Problem;
use crate::trial::{LOOK_STEPS, Nominal, coarse, positions};

/// Longest integration steps of a promise, in steps of the plant. Where the effect reads a position they are those of a
/// look, because a long step could skip a cog.
const PROMISE_STEPS: f64 = 4.0;

/// What a candidate promises from one start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Promise {
    /// The cost after one Gauss–Newton step; infinite where it promises nothing.
    pub(crate) cost: f64,
    /// The share that it must leave of what the plain model leaves; none where that is not known.
    pub(crate) left: Option<f64>,
}

/// The promises of candidates.
pub(crate) struct Promises<'a> {
    nominal: &'a Nominal<'a>,
    /// Whether to ask what candidates must leave.
    finely: bool,
    /// The plain model linearised: at simulated positions and at measured ones, with signs as they are and widely
    /// smoothed. Each is made when the first candidate needs it.
    plain: [OnceLock<Option<Linear>>; 4],
}

/// The plain model linearised at its solution.
struct Linear {
    positions: Option<Positions>,
    /// Weights of the first samples, where initial states are estimated.
    first: Vec<Vec<f64>>,
    /// `r₀`
    residual: DVector<f64>,
    /// `J₀`
    jacobian: DMatrix<f64>,
    /// `J₀ᵀJ₀`
    gram: DMatrix<f64>,
    /// `min ‖r₀ + J₀ δ‖²`
    alone: Option<f64>,
    /// How forces pass through the model; none where each promise is simulated.
    passage: Option<Passage>,
}

impl<'a> Promises<'a> {
    /// Those beside the plain model; `finely` also says what each must leave.
    pub(crate) fn new(nominal: &'a Nominal<'a>, finely: bool) -> Self {
        Self {
            nominal,
            finely,
            plain: Default::default(),
        }
    }

    /// What a candidate promises from one start. None where its simulation fails.
    pub(crate) fn of(&self, candidate: &Candidate, start: &[f64]) -> Option<Promise> {
        let nominal = self.nominal;
        nominal.work.go_on().ok()?;
        let plain = nominal.cost;
        let states = &nominal.solution.states;
        let mut model = coarse(candidate, steps(candidate));
        // While its linear parameters are neutral, the others have no influence and need no derivatives.
        let shape = candidate.shape();
        let at = positions(candidate, start);
        let linear = self.linear(candidate, start, at.as_ref());
        let shared = linear.is_some().then(|| 0..candidate.own().start);
        let known = shape
            .iter()
            .flatten()
            .copied()
            .chain(shared.into_iter().flatten());
        for index in known {
            let parameter = &mut model.parameters[index];
            if parameter.free {
                parameter.free = false;
                parameter.value = Some(start[index]);
            }
        }
        let known = match linear {
            Some(_) => Some(&**states),
            None => nominal.held,
        };
        let mut problem = nominal.problem(&model, known)?;
        problem.positions = at;
        let ((before, after), left) = match linear {
            Some(linear) => {
                let there = linear.at(&mut problem, start)?;
                let left = self.finely.then(|| linear.left(&there)).flatten();
                (linear.promise(&there)?, left)
            }
            None => (problem.promise(start, states).ok()??, None),
        };
        let criteria = nominal.criteria();
        let cost = match shape {
            // At the measured positions the plain model, too, leaves less than in its free run. Where it leaves
            // hardly anything, or hardly more than the noise of two readings, the regression tells nothing.
            Some(_) => {
                let noise = criteria.differences * nominal.floor.powi(2);
                let told = (criteria.told * plain).max(noise);
                if after < criteria.promising * before || before < told {
                    plain * after / before
                } else {
                    f64::INFINITY
                }
            }
            None => after,
        };
        Some(Promise { cost, left })
    }

    /// The plain model linearised as the candidate at this start needs it. None where it starts from elsewhere, or is no
    /// more than that model with something added.
    fn linear(
        &self,
        candidate: &Candidate,
        start: &[f64],
        at: Option<&Positions>,
    ) -> Option<&Linear> {
        let given = &self.nominal.model.parameters;
        let base = candidate.own().start;
        let same = candidate.replaces.is_none()
            && base == given.len()
            && start[..base] == self.nominal.model.values()
            && (given.iter().zip(&candidate.model.parameters)).all(|(a, b)| a.free == b.free);
        if !same {
            return None;
        }
        let softened = candidate.shape().is_some();
        let kind = 2 * usize::from(at.is_some()) + usize::from(softened);
        let made = self.plain[kind].get_or_init(|| self.made(candidate, at));
        made.as_ref()
            .filter(|linear| linear.positions.as_ref() == at)
    }

    /// Linearises the plain model; none where it diverges with steps of that length.
    fn made(&self, candidate: &Candidate, at: Option<&Positions>) -> Option<Linear> {
        let nominal = self.nominal;
        let last = candidate.model.effects.len().checked_sub(1)?;
        let model = coarse(candidate, steps(candidate)).without_effect(last)?;
        let Solution { values, states } = nominal.solution;
        let mut problem = nominal.problem(&model, nominal.held)?;
        problem.positions = at.cloned();
        let there = problem.pack(values, states);
        let passage = match candidate.shape() {
            // With signs as wide as those of the model.
            Some(_) => {
                let begun = problem.solution(&there);
                Passage::of(&model, &begun, at, problem.runs, &problem.work).ok()?
            }
            None => None,
        };
        let there = problem.linearise_once(&there).ok()?;
        let mut linear = Linear::new(at.cloned(), problem.first, there)?;
        linear.passage = passage;
        Some(linear)
    }
}

impl Linear {
    /// None where a derivative is not finite.
    fn new(positions: Option<Positions>, first: Vec<Vec<f64>>, there: Linearised) -> Option<Self> {
        let gram = gram(&there.jacobian);
        let mut linear = Self {
            positions,
            first,
            residual: there.residual,
            jacobian: there.jacobian,
            gram,
            alone: None,
            passage: None,
        };
        let none = DMatrix::zeros(linear.residual.len(), 0);
        linear.alone = linear.after(&linear.residual, &none);
        linear.gram.iter().all(|v| v.is_finite()).then_some(linear)
    }

    /// The residuals of a candidate at its start and their derivatives by its own parameters, which are the unknowns of
    /// `problem`.
    fn at(&self, problem: &mut Problem<'_>, start: &[f64]) -> Option<Rc<Linearised>> {
        problem.first.clone_from(&self.first);
        // What is known is no unknown.
        let at = problem.pack(start, &[]);
        let slopes = match &self.passage {
            Some(passage) => {
                let (values, _) = problem.unpack(&at);
                let (model, runs, work) = (problem.model, problem.runs, &problem.work);
                passage
                    .slopes(model, &values, &problem.free, runs, work)
                    .ok()?
            }
            None => None,
        };
        match slopes {
            Some(slopes) => Some(Rc::new(Linearised {
                at,
                residual: self.residual.clone(),
                jacobian: problem.jacobian_of(&slopes),
            })),
            None => problem.linearise(&at).ok(),
        }
    }

    /// Cost at the start of a candidate, and the one that a full Gauss–Newton step of all parameters would reach if the model
    /// were linear in them.
    fn promise(&self, there: &Linearised) -> Option<(f64, f64)> {
        let after = self.after(&there.residual, &there.jacobian)?;
        Some((there.residual.norm_squared(), after))
    }

    /// The share that a candidate must leave of what the plain model's own step leaves.
    fn left(&self, there: &Linearised) -> Option<f64> {
        let own = there.jacobian.ncols();
        let mut all = there.jacobian.clone().resize_horizontally(own + 1, 0.0);
        all.set_column(own, &(&there.residual - &self.residual));
        Some(self.after(&self.residual, &all)? / self.alone?)
    }

    /// What is left of the square of `residual` by the best sum of the plain model's derivatives and its `own`.
    fn after(&self, residual: &DVector<f64>, own: &DMatrix<f64>) -> Option<f64> {
        let (n, m) = (self.gram.ncols(), own.ncols());
        let mut gram = self.gram.clone().resize(n + m, n + m, 0.0);
        let across = self.jacobian.tr_mul(own);
        gram.view_mut((0, n), (n, m)).copy_from(&across);
        gram.view_mut((n, 0), (m, n)).copy_from(&across.transpose());
        gram.view_mut((n, n), (m, m)).copy_from(&own.tr_mul(own));
        let mut right = self.jacobian.tr_mul(residual).resize_vertically(n + m, 0.0);
        right.rows_mut(n, m).copy_from(&own.tr_mul(residual));
        let after = residual.norm_squared() - right.dot(&(pseudo_inverse(&gram)? * &right));
        after.is_finite().then_some(after.max(0.0))
    }
}

/// Longest integration steps of a candidate's promise, in steps of the plant.
fn steps(candidate: &Candidate) -> f64 {
    if Positions::matter_to(candidate.meta) {
        LOOK_STEPS
    } else {
        PROMISE_STEPS
    }
}

#[cfg(test)]
mod tests {
    use loopsight_model::model::Model;
    use loopsight_plants as _;
    use nalgebra::DVector;

    use super::*;
    use crate::progress::Work;
    use crate::swing::swing;

    const AXIS: &str = "[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n[log.measured.speed]\n";
    const FRICTION: &str = "[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nwidth = 0.5\n";

    fn axis(text: &str) -> Model {
        Model::from_toml("axis.toml", &format!("{AXIS}{text}"))
            .unwrap()
            .0
    }

    /// Where a candidate starts without influence, the plain model's derivatives are its own: the promise has the digits
    /// of the one that differentiates by all parameters.
    #[test]
    fn a_shared_linearisation_promises_what_one_of_its_own_does() {
        let runs = [swing(&axis(&format!("{FRICTION}level = 0.8\n")), 400)];
        let (plain, with) = (axis(""), axis(&format!("{FRICTION}level = 0.0\n")));
        let states = vec![DVector::zeros(plain.n_states())];
        let problem =
            |model| Problem::with(model, &runs, None, Some(states.clone()), Work::quiet()).unwrap();
        let of_plain = problem(&plain);
        let at = of_plain.pack(&plain.values(), &states);
        let there = of_plain.linearise_once(&at).unwrap();
        let linear = Linear::new(None, Vec::new(), there).unwrap();
        let mut own = with.clone();
        for parameter in &mut own.parameters[..plain.parameters.len()] {
            parameter.free = false;
        }
        let start = with.values();
        let there = linear.at(&mut problem(&own), &start).unwrap();
        let shared = linear.promise(&there).unwrap();
        let whole = problem(&with).promise(&start, &states).unwrap().unwrap();
        assert!(
            (shared.0 / whole.0 - 1.0).abs() < 1e-9,
            "{shared:?} {whole:?}"
        );
        assert!(
            (shared.1 / whole.1 - 1.0).abs() < 1e-6,
            "{shared:?} {whole:?}"
        );
        assert!(shared.1 < 0.1 * shared.0, "{shared:?}");
        // A start without influence adds nothing to what the derivatives can do.
        let left = linear.left(&there).unwrap();
        let of_plain = linear.alone.unwrap();
        assert!(
            (left * of_plain / shared.1 - 1.0).abs() < 1e-6,
            "{left} {shared:?} {of_plain}"
        );

        // Four times as strong as the friction is, it could still explain a third of what is left.
        let strong = [&plain.values()[..], &[3.2, 0.5]].concat();
        let strong = linear.at(&mut problem(&own), &strong).unwrap();
        let left = linear.left(&strong).unwrap();
        assert!(left < 0.67, "{left}");
    }
}
