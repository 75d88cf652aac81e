//! The change from rest at which effects with a sign have their full size.

use super::Affine;

/// Speeds that are tried, from the least, each this much faster than the one before.
const LEAST: f64 = 1e-6;
const RATIO: f64 = 1.25;
const TRIED: usize = 78;
/// Share of the slope at rest that is left of a chord's where a sign has grown up: `tanh(s)/s` is
/// there at `s = 3.3`, where `tanh` is 0.997.
const GROWN: f64 = 0.3;

impl Affine {
    /// For each controlled state the change from rest at which efforts that depend on its sign have their full size; 0
    /// where none does.
    ///
    /// ```text
    /// c(s) = (f(s) - f(-s))/2s, of the efforts alone      band = least s with c(s) - c_min < 0.3 (c(0) - c_min)
    /// ```
    ///
    /// The chord of a linear effect (viscous friction) has the same slope everywhere, and that of drag grows steeper:
    /// both have no sign. Levels that are 0 or not known yet are tried at their scale, because they may be learned.
    pub(super) fn find_bands(&mut self) -> Vec<f64> {
        let n = self.bands.len();
        if self.bounds.efforts.is_empty() {
            return vec![0.0; n];
        }
        let known = self.values.clone();
        self.values = super::treatment::lively(&self.whole);
        self.p = self.whole.lower(&self.values);
        let bands = (0..n).map(|i| self.find_band(i)).collect();
        self.values = known;
        self.learned = true;
        self.use_learned();
        self.state.fill(0.0);
        self.ahead.fill(0.0);
        bands
    }

    fn find_band(&mut self, i: usize) -> f64 {
        let state = self.model.plant.controlled[i];
        self.state.fill(0.0);
        self.ahead.fill(0.0);
        self.u.fill(0.0);
        let mut chord = |s: f64| {
            let mut at = |s: f64| {
                self.ahead[state] = s;
                self.rate();
                self.dx[state]
            };
            (at(-s) - at(s)) / (2.0 * s)
        };
        let speeds: Vec<f64> = (0..TRIED).map(|k| LEAST * RATIO.powi(k as i32)).collect();
        let chords: Vec<f64> = speeds.iter().map(|s| chord(*s)).collect();
        let least = chords.iter().fold(f64::INFINITY, |a, c| a.min(*c));
        let excess = chords[0] - least;
        if !(excess > 1e-6 * chords[0].abs() && excess.is_finite()) {
            return 0.0;
        }
        let grown = chords.iter().position(|c| c - least < GROWN * excess);
        grown.map_or(0.0, |k| speeds[k])
    }
}
