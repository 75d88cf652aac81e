//! What SysId would make of a log.

use super::number::number;

/// A term of a feedforward: its name, value, 95 % interval and unit.
pub struct Term<'a> {
    /// `kV`.
    pub name: &'a str,
    /// Its value.
    pub value: f64,
    /// Its interval, where it is known.
    pub interval: Option<[f64; 2]>,
    /// Its unit.
    pub unit: &'a str,
}

/// A feedforward in a sentence, and the gains of feedback loops in another: proportional gain on the speed,
/// proportional and derivative gain on the position.
pub fn summary(terms: &[Term<'_>], gains: [f64; 3]) -> Vec<String> {
    let term = |term: &Term<'_>| {
        let half = term.interval.map(|[low, high]| 0.5 * (high - low));
        let error = half.map_or_else(String::new, |half| format!(" \u{b1} {half:.2e}"));
        format!(
            "{} = {}{error} {}",
            term.name,
            number(term.value),
            term.unit
        )
    };
    let [velocity, position, derivative] = gains.map(number);
    vec![
        format!(
            "In the units of the log: {}.",
            terms.iter().map(term).collect::<Vec<_>>().join(", ")
        ),
        format!(
            "Gains of feedback every 20 ms, as SysId has them: kP = {velocity} on the speed; kP = {position} and \
             kD = {derivative} on the position."
        ),
    ]
}
