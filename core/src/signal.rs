//! Named quantities with units.

/// A quantity of a plant that has a name: a state, an input or something derived from them.
///
/// The declaration is data, so that help, templates, validation, reports and the mapping of a
/// log's columns all come from this one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// Identifier used in TOML, JSON and reports, e.g. `linear_velocity`.
    pub id: &'static str,
    /// Symbol in the equations, e.g. `v`.
    pub symbol: &'static str,
    /// SI unit, e.g. `m/s` (see [`crate::unit`]).
    pub unit: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// Size of a value that matters, in its unit, see [`crate::Channel::size`].
    pub size: f64,
    /// An input that a machine may be without: zero where a log has no column for it.
    pub optional: bool,
}

impl Signal {
    /// Declares a signal.
    pub const fn new(
        id: &'static str,
        symbol: &'static str,
        unit: &'static str,
        doc: &'static str,
    ) -> Self {
        Self {
            id,
            symbol,
            unit,
            doc,
            size: 1.0,
            optional: false,
        }
    }

    /// An input that is zero where a log has no column for it.
    pub const fn optional(mut self) -> Self {
        self.optional = true;
        self
    }

    /// Size of a value that matters; 1 unless said otherwise.
    pub const fn sized(mut self, size: f64) -> Self {
        self.size = size;
        self
    }
}
