//! What to record next.

use loopsight_diagnosis::Advice;

/// An experiment and the reasons for it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AdvisedRecording {
    /// What to record.
    pub experiment: String,
    /// Why; one experiment may answer several questions.
    pub because: Vec<String>,
}

/// Advice by experiment, each with all its reasons; what is said twice stands once.
pub fn recordings<'a>(advice: impl IntoIterator<Item = &'a Advice>) -> Vec<AdvisedRecording> {
    let mut all: Vec<AdvisedRecording> = Vec::new();
    for one in advice {
        let because = one.why.clone();
        match all.iter_mut().find(|r| r.experiment == one.experiment) {
            Some(found) if found.because.contains(&because) => {}
            Some(found) => found.because.push(because),
            None => all.push(AdvisedRecording {
                experiment: one.experiment.clone(),
                because: vec![because],
            }),
        }
    }
    all
}

/// Lines for a terminal, each with a line's end before it.
pub(crate) fn lines<'a>(advice: impl IntoIterator<Item = &'a Advice>) -> String {
    recordings(advice)
        .iter()
        .map(|r| {
            let why: String = r
                .because
                .iter()
                .map(|why| format!("\n  because {why}"))
                .collect();
            format!("\nadvice: {}{why}", r.experiment)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_experiment_stands_once_with_all_its_reasons() {
        let advice = [
            ("a", "slow ramps"),
            ("b", "slow ramps"),
            ("a", "slow ramps"),
        ];
        let advice = advice.map(|(why, experiment)| Advice {
            why: why.into(),
            experiment: experiment.into(),
        });
        assert_eq!(
            lines(&advice),
            "\nadvice: slow ramps\n  because a\n  because b"
        );
        assert_eq!(lines(&[]), "");
    }
}
