//! The result of an improvement.

use serde::Serialize;

use crate::advice::to_tell_apart;
use crate::conclusion::{Advice, Conclusion, Diagnosis};
use crate::effect_at::EffectAt;
use crate::fitted::Fit;

/// One step of an improvement.
#[derive(Clone, Debug, Serialize)]
pub struct ImprovementStep {
    /// What was added, under the name that it has in the best model; `null` for the model as it was.
    pub added: Option<EffectAt>,
    /// The `[[effect]]` entries of what was added, where the library has no such effect.
    #[serde(skip)]
    pub entries: Option<String>,
    /// The round whose diagnosis named it: its place among [`Improvement::diagnoses`]; none where it came of the correction of
    /// another step.
    #[serde(skip)]
    pub round: Option<usize>,
    /// Free-run error on the fitting data.
    pub nrmse_fit: f64,
    /// Free-run error on the validation data.
    pub nrmse_test: f64,
    /// What the data could not tell from it when it was added, and what it was named then.
    #[serde(skip)]
    pub twins: Vec<EffectAt>,
    /// What the data cannot tell from it, with all that was added later in the model.
    #[serde(skip)]
    pub still_open: Vec<EffectAt>,
}

#[cfg(test)]
impl ImprovementStep {
    /// One that adds this effect at a shaft in the first round, or nothing.
    pub(crate) fn at_shaft(effect: Option<&str>) -> Self {
        Self {
            added: effect.map(|effect| EffectAt {
                effect: effect.to_owned(),
                at: vec!["shaft".to_owned()],
            }),
            entries: None,
            round: Some(0),
            nrmse_fit: 0.1,
            nrmse_test: 0.1,
            twins: Vec::new(),
            still_open: Vec::new(),
        }
    }
}

/// The result of [`improve`](crate::improve()).
#[derive(Debug, Serialize)]
pub struct Improvement {
    /// The model as it was, then each addition.
    pub steps: Vec<ImprovementStep>,
    /// What the last diagnosis concludes.
    pub verdict: Conclusion,
    /// The diagnoses, one per round.
    #[serde(skip)]
    pub diagnoses: Vec<Diagnosis>,
    /// The best model, fitted to all of the log; none where a diagnosis was refused.
    #[serde(skip)]
    pub best: Option<Fit>,
}

impl Improvement {
    /// What to record next: to tell what was added from what the data still cannot tell from it, and what the verdict
    /// asks for. What earlier rounds asked is settled, and so is what a last one asked of an effect that was not added.
    pub fn advice(&self) -> Vec<Advice> {
        let open = self.steps.iter().filter_map(|step| {
            let place = step.added.as_ref()?;
            Some(to_tell_apart(place, &step.still_open))
        });
        let mut all: Vec<Advice> = open.flatten().collect();
        if let Some(last) = self.diagnoses.last() {
            let unadded = match last.candidates.first() {
                Some(best) if last.verdict != self.verdict => {
                    to_tell_apart(&best.place, &best.indistinguishable_from)
                }
                _ => Vec::new(),
            };
            for one in &last.advice {
                if !all.contains(one) && !unadded.contains(one) {
                    all.push(one.clone());
                }
            }
        }
        all
    }
}
