//! How a loop follows steps of its reference.

use serde::Serialize;

/// The response to one step of a reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepResponse {
    /// When the reference stepped, s.
    pub at_s: f64,
    /// Reference before.
    pub from: f64,
    /// Reference after.
    pub to: f64,
    /// From the step until the response stays within 2 % of it; `null` when it did not before the
    /// next step, or when the noise alone is wider than that.
    pub settling_time_s: Option<f64>,
    /// How far the response went beyond the new value, in per cent of the step.
    pub overshoot_percent: f64,
}

/// Samples on each side over which a response is averaged before it is judged: encoder counts are
/// noisier than 2 % of a small step.
const HALF_WINDOW: usize = 3;

/// All steps of `reference` that are at least half a second apart, with their responses.
///
/// A step is a change between two samples by more than a tenth of the largest such change. After it the reference
/// must stay constant to within 2 % of the step. Overshoot and settling are those of the mean over seven samples.
pub fn step_responses(time: &[f64], reference: &[f64], measured: &[f64]) -> Vec<StepResponse> {
    let n = time.len().min(reference.len()).min(measured.len());
    let change = |k: usize| reference[k] - reference[k - 1];
    let largest = (1..n).fold(0.0f64, |a, k| a.max(change(k).abs()));
    if largest <= 0.0 {
        return Vec::new();
    }
    let starts: Vec<usize> = (1..n)
        .filter(|k| change(*k).abs() > 0.1 * largest)
        .collect();
    let mut responses = Vec::new();
    for (i, &start) in starts.iter().enumerate() {
        let end = starts.get(i + 1).copied().unwrap_or(n);
        if time[end - 1] - time[start] < 0.5 {
            continue;
        }
        let (from, to) = (reference[start - 1], reference[start]);
        let size = to - from;
        if (start..end).any(|k| (reference[k] - to).abs() > 0.02 * size.abs()) {
            continue;
        }
        let smooth = |k: usize| {
            let first = k.saturating_sub(HALF_WINDOW).max(start);
            let last = (k + HALF_WINDOW + 1).min(end);
            measured[first..last].iter().sum::<f64>() / (last - first) as f64
        };
        let mut settled = None;
        let mut overshoot = 0.0f64;
        for k in start..end {
            let error = (smooth(k) - to) / size;
            overshoot = overshoot.max(error);
            if error.abs() > 0.02 {
                settled = None;
            } else if settled.is_none() {
                settled = Some(time[k] - time[start]);
            }
        }
        responses.push(StepResponse {
            at_s: time[start],
            from,
            to,
            settling_time_s: settled,
            overshoot_percent: 100.0 * overshoot,
        });
    }
    responses
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_reference_has_no_steps() {
        let time: Vec<f64> = (0..3000).map(|k| 0.01 * f64::from(k)).collect();
        let reference: Vec<f64> = time
            .iter()
            .map(|t| 0.06 * t.sin() + 0.06 * (2.7 * t + 0.1).sin())
            .collect();
        assert_eq!(step_responses(&time, &reference, &reference), []);
    }

    /// The paper's loop: `1 - e^{-ωt}(1 - ωt)` overshoots by 13.5 % and settles at 0.607 s.
    #[test]
    fn the_papers_step_response_is_measured() {
        let omega = 8.889;
        let time: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k)).collect();
        let reference: Vec<f64> = time
            .iter()
            .map(|t| if *t < 1.0 { 0.0 } else { 0.2 })
            .collect();
        let measured: Vec<f64> = time
            .iter()
            .map(|t| {
                let s = (t - 1.0).max(0.0) * omega;
                0.2 * (1.0 - (-s).exp() * (1.0 - s))
            })
            .map(|y| if y.abs() < 1e-12 { 0.0 } else { y })
            .collect();
        let steps = step_responses(&time, &reference, &measured);
        assert_eq!(steps.len(), 1);
        assert!((steps[0].overshoot_percent - 13.5).abs() < 0.4, "{steps:?}");
        assert!(
            (steps[0].settling_time_s.unwrap() - 0.607).abs() < 0.015,
            "{steps:?}"
        );
    }

    #[test]
    fn nothing_to_say_without_steps() {
        assert!(step_responses(&[0.0, 1.0], &[0.0, 0.0], &[0.0, 0.1]).is_empty());
        assert!(step_responses(&[], &[], &[]).is_empty());
    }
}
