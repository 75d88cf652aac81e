//! What is known of the values of a channel, in one pass.

use loopsight_formats::Kind;

use super::picture::Picture;

/// Words of a text that are shown.
pub(super) const WORDS: usize = 12;
/// Letters of a word that are shown.
const LETTERS: usize = 60;

/// What is kept of the values of a channel.
#[derive(Clone, Debug, Default)]
pub(super) struct ValueCount {
    /// Values, missing ones included.
    pub(super) values: usize,
    pub(super) missing: usize,
    range: Option<(f64, f64)>,
    pub(super) words: Vec<String>,
    pub(super) picture: Picture,
    first: f64,
    last: Option<f64>,
    numbers: f64,
    sum: f64,
    squares: f64,
    changes: f64,
}

impl ValueCount {
    /// A number at a time, s, or at the number of its row.
    pub(super) fn number(&mut self, time: f64, value: f64) {
        self.values += 1;
        if value.is_nan() {
            self.missing += 1;
            return;
        }
        let (low, high) = self.range.unwrap_or((value, value));
        self.range = Some((low.min(value), high.max(value)));
        self.picture.push(time, value);
        match self.last.replace(value) {
            Some(last) => self.changes += (value - last) * (value - last),
            None => self.first = value,
        }
        // From the first value: large offsets cost no digits.
        let shifted = value - self.first;
        self.numbers += 1.0;
        self.sum += shifted;
        self.squares += shifted * shifted;
    }

    pub(super) fn text(&mut self, text: &str) {
        self.values += 1;
        if self.words.len() < WORDS {
            let word = short(text);
            if !self.words.contains(&word) {
                self.words.push(word);
            }
        }
    }

    pub(super) fn skip(&mut self, missing: usize) {
        self.values += missing;
        self.missing += missing;
    }

    pub(super) fn range(&self, kind: Kind) -> Option<(f64, f64)> {
        self.range.filter(|_| kind != Kind::Text)
    }

    /// Root mean square change from value to value over the standard deviation: small for what is smooth, √2 for
    /// noise; none where nothing changes.
    pub(super) fn roughness(&self) -> Option<f64> {
        let mean = self.sum / self.numbers;
        let variance = self.squares / self.numbers - mean * mean;
        let change = self.changes / (self.numbers - 1.0);
        (self.numbers > 1.0 && variance > 0.0 && change.is_finite())
            .then(|| (change / variance).sqrt())
    }
}

/// A text that may be a page long, on a part of a line.
pub(super) fn short(text: &str) -> String {
    let mut letters = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    let mut short: String = letters.by_ref().take(LETTERS).collect();
    if letters.next().is_some() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_smooth_is_told_from_what_jumps() {
        let of = |value: fn(f64) -> f64| {
            let mut count = ValueCount::default();
            (0..1000).for_each(|k| count.number(f64::from(k), 1e6 + value(f64::from(k))));
            count.roughness()
        };
        assert!(of(|k| (k / 30.0).sin()).unwrap() < 0.1);
        let noise = of(|k| ((k * 12.9898).sin() * 43758.5453).rem_euclid(1.0)).unwrap();
        assert!((noise - 2.0_f64.sqrt()).abs() < 0.15, "{noise}");
        assert_eq!(of(|_| 1.0), None);
    }

    #[test]
    fn long_texts_are_shown_in_part() {
        assert_eq!(short("a\nb"), "a b");
        let long = short(&"ä".repeat(100));
        assert_eq!(long.chars().count(), 61);
        assert!(long.ends_with("ä…"), "{long}");
    }
}
