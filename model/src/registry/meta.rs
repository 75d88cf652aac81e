//! What estimators, controllers and drivers say about themselves.

/// What an estimator, controller or driver says about itself.
#[derive(Clone, Copy, Debug)]
pub struct PartMeta {
    /// Identifier in TOML.
    pub id: &'static str,
    /// `estimator`, `controller` or `driver`; `plant` or `effect` for those of [`written`](super::written).
    pub role: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// The equations, or what it does, in plain text.
    pub equation: &'static str,
    /// Where they come from.
    pub reference: &'static str,
    /// A TOML table that builds it.
    pub example: &'static str,
    /// Its settings: key, unit, sentence.
    pub settings: &'static [Setting],
}

/// One setting of an estimator, controller or driver.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Key in TOML.
    pub id: &'static str,
    /// SI unit; empty where it has none to have (a list of names, a file).
    pub unit: &'static str,
    /// One sentence, with the default.
    pub doc: &'static str,
}

impl Setting {
    /// Declares a setting.
    pub const fn new(id: &'static str, unit: &'static str, doc: &'static str) -> Self {
        Self { id, unit, doc }
    }
}
