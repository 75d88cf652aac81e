//! Quantities that follow from a plant's parameters.

/// A quantity that follows from the parameters of a plant's equations: a parameter of another form of the model, a
/// time constant, a static gain.
///
/// It is shown beside the parameters, with an interval that is propagated from theirs. It configures nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derived {
    /// Identifier in JSON and reports, e.g. `kV`.
    pub id: &'static str,
    /// SI unit (see [`crate::unit`]).
    pub unit: &'static str,
    /// How it follows, e.g. `-K_A/K_C`.
    pub equation: &'static str,
    /// One sentence.
    pub doc: &'static str,
}

impl Derived {
    /// Declares a derived quantity.
    pub const fn new(
        id: &'static str,
        unit: &'static str,
        equation: &'static str,
        doc: &'static str,
    ) -> Self {
        Self {
            id,
            unit,
            equation,
            doc,
        }
    }
}
