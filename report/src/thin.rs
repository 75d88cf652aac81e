//! Fewer points for a drawing, without losing a peak.

/// Most points of one trace of a chart.
pub(crate) const MOST_POINTS: usize = 4000;

/// Indices of the samples to draw, in order, at most `most`: the first, the last, and the least and the greatest
/// value of every stretch.
///
/// Where samples are missing (not finite), the first missing one of each stretch stays, so that a gap shows.
pub(crate) fn kept(values: &[f64], most: usize) -> Vec<usize> {
    let n = values.len();
    if n <= most.max(2) {
        return (0..n).collect();
    }
    let per_stretch = if values.iter().all(|v| v.is_finite()) {
        2
    } else {
        3
    };
    let stretches = (most.saturating_sub(2) / per_stretch).max(1);
    let mut kept = vec![0, n - 1];
    for stretch in 0..stretches {
        let (from, to) = (stretch * n / stretches, (stretch + 1) * n / stretches);
        let finite = || (from..to).filter(|k| values[*k].is_finite());
        let by_value = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
        kept.extend(finite().min_by(by_value));
        kept.extend(finite().max_by(by_value));
        kept.extend((from..to).find(|k| !values[*k].is_finite()));
    }
    kept.sort_unstable();
    kept.dedup();
    kept
}

/// At most `most` of `n` indices, in order: one from each of `most` equal stretches. Its place in the stretch
/// varies, so that a periodic signal does not look as if it stood still.
pub(crate) fn spread(n: usize, most: usize) -> Vec<usize> {
    if n <= most {
        return (0..n).collect();
    }
    let stretch = n as f64 / most as f64;
    // Multiples of the golden ratio fill the unit interval evenly.
    let place = |k: usize| (k as f64 + (k as f64 * 0.618_033_988_75).fract()) * stretch;
    (0..most).map(|k| (place(k) as usize).min(n - 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_and_ends_stay() {
        let mut values: Vec<f64> = (0..100_000).map(|k| (f64::from(k) * 0.37).sin()).collect();
        values[0] = 0.123;
        values[99_999] = 0.456;
        values[43_210] = 17.0;
        values[43_211] = -19.0;
        let kept = kept(&values, MOST_POINTS);
        assert!(kept.len() <= MOST_POINTS, "{}", kept.len());
        assert!(kept.len() > MOST_POINTS / 2);
        assert!(kept.is_sorted());
        for k in [0, 43_210, 43_211, 99_999] {
            assert!(kept.contains(&k), "{k}");
        }
    }

    #[test]
    fn gaps_stay() {
        let mut values = vec![1.0; 20_000];
        values[5000] = f64::NAN;
        values[9000..11_000].fill(f64::NAN);
        let kept = kept(&values, 900);
        assert!(kept.len() <= 900);
        assert!(kept.contains(&5000));
        assert!(kept.iter().filter(|k| (9000..11_000).contains(*k)).count() > 10);
        assert!(kept.iter().filter(|k| values[**k].is_finite()).count() > 500);
    }

    #[test]
    fn short_series_stay_whole() {
        assert_eq!(kept(&[], 10), Vec::<usize>::new());
        assert_eq!(kept(&[3.0, f64::NAN], 1), [0, 1]);
        assert_eq!(kept(&[1.0, 2.0, 3.0], 3), [0, 1, 2]);
        assert_eq!(spread(3, 10), [0, 1, 2]);
        let spread = spread(10_000, 1000);
        assert!(spread.len() == 1000 && spread.is_sorted() && spread[999] < 10_000);
        let of_period: Vec<usize> = (0..10)
            .map(|at| spread.iter().filter(|k| *k % 10 == at).count())
            .collect();
        assert!(
            of_period.iter().all(|n| (90..=110).contains(n)),
            "{of_period:?}"
        );
    }
}
