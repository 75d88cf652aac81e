//! Parts of a log: `[from, to]`, or a list of them.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::list::list;

/// Parts of a log, both ends included; none: all of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ranges(Vec<(f64, f64)>);

impl Ranges {
    /// From each `from` to its `to`, both included.
    pub fn of(parts: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self(parts.into_iter().collect())
    }

    /// The parts, in the order of the file.
    pub fn parts(&self) -> &[(f64, f64)] {
        &self.0
    }

    /// Whether nothing is said, which is all of the log.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// An element of the list.
#[derive(Deserialize)]
#[serde(untagged)]
enum Element {
    Number(f64),
    Pair((f64, f64)),
}

const EXPECTED: &str = "`[from, to]`, or a list of such pairs";

fn ranges(elements: Vec<Element>) -> Result<Ranges, String> {
    let (mut numbers, mut pairs) = (Vec::new(), Vec::new());
    for element in elements {
        match element {
            Element::Number(number) => numbers.push(number),
            Element::Pair(pair) => pairs.push(pair),
        }
    }
    match (numbers.as_slice(), pairs.is_empty()) {
        ([from, to], true) => pairs.push((*from, *to)),
        ([], false) => {}
        _ => return Err(format!("expected {EXPECTED}")),
    }
    // Written so that a NaN is refused, too.
    if let Some((from, to)) = pairs
        .iter()
        .find(|(from, to)| !matches!(from.partial_cmp(to), Some(o) if o.is_le()))
    {
        return Err(format!("the part [{from}, {to}] ends before it begins"));
    }
    Ok(Ranges(pairs))
}

impl<'de> Deserialize<'de> for Ranges {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        list(deserializer, EXPECTED, ranges)
    }
}

impl Serialize for Ranges {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    struct Table {
        rows: Ranges,
    }

    fn of(text: &str) -> Result<Vec<(f64, f64)>, String> {
        let table: Result<Table, _> = toml::from_str(text);
        table
            .map(|t| t.rows.parts().to_vec())
            .map_err(|e| e.to_string())
    }

    #[test]
    fn a_pair_or_a_list_of_pairs() {
        assert_eq!(of("rows = [1, 20]"), Ok(vec![(1.0, 20.0)]));
        assert_eq!(
            of("rows = [[1, 20.5], [30, 40]]"),
            Ok(vec![(1.0, 20.5), (30.0, 40.0)])
        );
        for wrong in [
            "rows = [1]",
            "rows = [1, 2, 3]",
            "rows = [[1, 2], 3]",
            "rows = [\"a\", 1]",
            "rows = []",
        ] {
            assert!(
                of(wrong).unwrap_err().contains("a list of such pairs"),
                "{wrong}"
            );
        }
        assert!(
            of("rows = [3, 1]")
                .unwrap_err()
                .contains("ends before it begins")
        );
        assert!(of("rows = [nan, 1]").is_err());
    }
}
