//! Names in messages: all of them, or the one that was meant.

/// `; did you mean …?`, or nothing.
pub(crate) fn did_you_mean(nearest: &Option<Box<str>>) -> String {
    nearest
        .as_ref()
        .map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

pub(crate) fn list(names: &[String]) -> String {
    if names.is_empty() {
        return "none".into();
    }
    names
        .iter()
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Less alike than this, a name is no suggestion.
const ALIKE: f64 = 0.5;

/// The candidate most like `name`, if any is.
pub(crate) fn nearest<'c>(
    name: &str,
    candidates: impl IntoIterator<Item = &'c str>,
) -> Option<Box<str>> {
    let name = name.to_lowercase();
    candidates
        .into_iter()
        .map(|c| {
            (
                strsim::normalized_damerau_levenshtein(&name, &c.to_lowercase()),
                c,
            )
        })
        .filter(|(alike, _)| *alike >= ALIKE)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, c)| c.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found_or_none() {
        let names = ["voltage_right_V", "voltage_left_V", "time_s"];
        assert_eq!(
            nearest("Voltage_rigth", names).as_deref(),
            Some("voltage_right_V")
        );
        assert_eq!(nearest("heading", names), None);
    }
}
