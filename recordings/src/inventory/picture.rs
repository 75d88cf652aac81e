//! A channel as a small picture.

/// Columns of a picture at most.
const COLUMNS: usize = 240;
/// A piece of time without a value.
const EMPTY: (f32, f32) = (f32::INFINITY, f32::NEG_INFINITY);
/// Width of a column before it has to be wider: what is closer together falls into one.
const NARROWEST: f64 = 1e-6;

/// The smallest and the largest value in each of some hundred equal pieces of time.
///
/// It is made in one pass over values whose number nobody knows beforehand: where a value lies behind the last
/// column, pairs of columns become one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Where the first column begins, and how wide each is: s, or rows where there are no time stamps.
    start: f64,
    width: f64,
    /// Infinite, the wrong way round, where nothing was measured.
    columns: Vec<(f32, f32)>,
}

impl Picture {
    /// Takes a value in; what is no number is left out, and so is a time before the first.
    pub(super) fn push(&mut self, time: f64, value: f64) {
        if !(time.is_finite() && value.is_finite()) {
            return;
        }
        if self.columns.is_empty() {
            (self.start, self.width) = (time, NARROWEST);
        }
        let mut at = ((time - self.start) / self.width).floor();
        while at >= COLUMNS as f64 {
            self.halve();
            at = ((time - self.start) / self.width).floor();
        }
        if at < 0.0 {
            return;
        }
        let at = at as usize;
        if self.columns.len() <= at {
            self.columns.resize(at + 1, EMPTY);
        }
        if let Some((low, high)) = self.columns.get_mut(at) {
            (*low, *high) = (low.min(value as f32), high.max(value as f32));
        }
    }

    fn halve(&mut self) {
        self.width *= 2.0;
        let pairs = self.columns.chunks(2).map(|pair| {
            let joined = |a: (f32, f32), b: &(f32, f32)| (a.0.min(b.0), a.1.max(b.1));
            pair.iter().fold(EMPTY, joined)
        });
        self.columns = pairs.collect();
    }

    /// The pieces with values: the middle of each, and the smallest and largest value in it.
    pub fn columns(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let middle = |at: usize| self.start + (at as f64 + 0.5) * self.width;
        let all = self.columns.iter().enumerate();
        all.filter(|(_, (low, _))| *low != f32::INFINITY)
            .map(move |(at, (low, high))| (middle(at), f64::from(*low), f64::from(*high)))
    }

    /// Width of a piece, s, or rows where there are no time stamps.
    pub fn width(&self) -> f64 {
        self.width
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_keeps_what_stands_out_however_long_the_log_is() {
        for n in [100_u32, 10_000, 300_000] {
            let mut picture = Picture::default();
            for k in 0..n {
                let value = if k == n / 2 { 9.0 } else { f64::from(k % 2) };
                picture.push(5.0 + 0.01 * f64::from(k), value);
            }
            let columns: Vec<_> = picture.columns().collect();
            assert!(
                (50..=COLUMNS).contains(&columns.len()),
                "{n}: {}",
                columns.len()
            );
            let peak = columns.iter().max_by(|a, b| a.2.total_cmp(&b.2)).unwrap();
            assert_eq!(peak.2, 9.0);
            let middle = 5.0 + 0.005 * f64::from(n);
            assert!((peak.0 - middle).abs() <= picture.width(), "{n}: {peak:?}");
            assert!(columns.iter().all(|c| c.1 == 0.0 || picture.width() < 0.02));
        }
        let mut picture = Picture::default();
        picture.push(f64::NAN, 1.0);
        picture.push(0.0, f64::INFINITY);
        picture.push(-1e300, 1.0);
        picture.push(1e300, 2.0);
        assert_eq!(picture.columns().count(), 2);
    }
}
