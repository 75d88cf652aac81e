//! The result of a diagnosis: verdict, explanations, advice.

use std::collections::BTreeMap;

use loopsight_model::model::Model;
use loopsight_recordings::Fault;
use serde::Serialize;

use crate::early::Fitted;
use crate::effect_at::EffectAt;
use crate::estimate::Estimate;
use crate::observer::Correction;
use crate::residual_force::ResidualForce;
use crate::untried::Untried;
use crate::where_it_fails::Statement;

/// An error, as in the JSON answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Free-run error relative to the standard deviation.
    pub nrmse: f64,
}

/// What a diagnosis concludes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Conclusion {
    /// An effect of the library explains what the model does not.
    EffectMissing,
    /// The model explains the measurements down to their noise.
    NothingMissing,
    /// Something is missing, and no effect of the library explains it.
    UnknownEffect,
    /// The recording does not say enough: it is too short, has no motion, or lacks what the test recording shows.
    DataInsufficient,
    /// The recording has a fault that makes any fit meaningless.
    LogFaulty,
    /// From every start the model leaves as much as a constant would, and no effect of the library changes that.
    /// Nothing can be concluded.
    NotFitted,
    /// The work was cancelled. What was found until then is reported, without a conclusion.
    Cancelled,
}

/// One way to explain what the model does not.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// The effect and where.
    #[serde(flatten)]
    pub place: EffectAt,
    /// The effect that explains the error together with it, where neither does alone; errors and parameters are those
    /// with both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub together_with: Option<EffectAt>,
    /// Free-run error with it, on the validation data.
    pub nrmse: f64,
    /// The effect's parameters, by their ids.
    pub parameters: BTreeMap<String, Estimate>,
    /// How many standard errors it is from having no influence: the root of the likelihood ratio over all
    /// independent samples. NaN (`null`) where the work was cancelled after a short fit of it.
    pub significance: f64,
    /// Candidates that these data cannot tell from it.
    pub indistinguishable_from: Vec<EffectAt>,
    /// What to know about it.
    pub note: String,
    /// Why it cannot be what it says, as the note says too; none where it can.
    #[serde(skip)]
    pub implausible: Option<String>,
    /// The model with it, fitted.
    #[serde(skip)]
    pub model: Model,
    /// Its `[[effect]]` entries, where the library has no such effect.
    #[serde(skip)]
    pub entries: Option<String>,
    /// Free-run error on what it was fitted to; NaN as `significance`.
    #[serde(skip)]
    pub nrmse_fit: f64,
}

#[cfg(test)]
impl Explanation {
    /// A significant one by this effect at the shaft of an axis, with the error that it leaves.
    pub(crate) fn at_shaft(effect: &str, nrmse: f64) -> Self {
        let text = "[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n[log.measured.speed]\n";
        let (model, _) = Model::from_toml("axis.toml", text).unwrap();
        Self {
            place: EffectAt {
                effect: effect.to_owned(),
                at: vec!["shaft".to_owned()],
            },
            together_with: None,
            nrmse,
            parameters: BTreeMap::new(),
            significance: 9.0,
            indistinguishable_from: Vec::new(),
            note: String::new(),
            implausible: None,
            model: model.with_effect(effect, &["shaft"]).unwrap(),
            entries: None,
            nrmse_fit: nrmse,
        }
    }
}

impl From<&Explanation> for Fitted {
    fn from(found: &Explanation) -> Self {
        Self {
            place: found.place.clone(),
            nrmse: found.nrmse,
        }
    }
}

/// An experiment and what it is good for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Advice {
    /// Why.
    pub why: String,
    /// What to record.
    pub experiment: String,
}

/// The result of [`diagnose`](crate::diagnose()).
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The model as it is, all its parameters refitted.
    pub nominal: Level,
    /// What noise and resolution alone would leave.
    pub floor: Level,
    /// The conclusion.
    pub verdict: Conclusion,
    /// The missing effect.
    pub missing: Option<EffectAt>,
    /// Explanations, best first. None where the model leaves hardly more than noise, and no effect promises to explain any of it.
    pub candidates: Vec<Explanation>,
    /// Effects that were not tried, because the recording cannot show them.
    pub not_tried: Vec<Untried>,
    /// Where the model fails, in words.
    pub where_it_fails: Vec<Statement>,
    /// The missing force, where no effect of the library explains it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_force: Option<ResidualForce>,
    /// Faults of the log.
    pub faults: Vec<Fault>,
    /// Experiments that would tell more.
    pub advice: Vec<Advice>,
    /// How an observer corrected the free runs by the measurements. Absent where they are simulated from the
    /// inputs alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observer: Option<Correction>,
    /// The nominal model, fitted.
    #[serde(skip)]
    pub model: Option<Model>,
    /// Its error on what it was fitted to.
    #[serde(skip)]
    pub nominal_fit: f64,
    /// What does better than the missing effect, and was set aside because that is simpler.
    #[serde(skip)]
    pub set_aside: Option<Explanation>,
}

impl Diagnosis {
    /// What it says of the effect at a place.
    pub(crate) fn explanation(&self, place: &EffectAt) -> Option<&Explanation> {
        self.candidates.iter().find(|c| c.place == *place)
    }

    /// Names `best` as missing, before all others.
    pub(crate) fn name(&mut self, best: Explanation) {
        self.missing = Some(best.place.clone());
        self.candidates.retain(|other| other.place != best.place);
        self.candidates.insert(0, best);
    }
}
