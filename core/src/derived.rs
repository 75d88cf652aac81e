//! Quantities that follow from a plant's parameters.

/// A quantity that follows from the parameters of a plant's equations: the same model in the words of
/// another school, a time constant, a gain at rest.
///
/// It is shown beside the parameters, with the interval that follows from theirs; nothing is
/// configured by it.
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
