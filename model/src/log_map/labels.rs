//! Names of experiments that stand side by side in a log: a list of texts or whole numbers.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::list::list;

/// What stands for `{}` in the names of columns, once for each experiment; none: there is one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Labels(Vec<String>);

impl Labels {
    /// One for each experiment.
    pub fn of<T: Into<String>>(labels: impl IntoIterator<Item = T>) -> Self {
        Self(labels.into_iter().map(Into::into).collect())
    }

    /// The labels, in the order of the runs.
    pub fn names(&self) -> &[String] {
        &self.0
    }

    /// Whether nothing is said.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// An element of the list.
#[derive(Deserialize)]
#[serde(untagged)]
enum Element {
    Number(i64),
    Text(String),
}

const EXPECTED: &str = "a list of texts or whole numbers: `[1, 2, 3]`";

fn labels(elements: Vec<Element>) -> Result<Labels, String> {
    let mut labels: Vec<String> = Vec::new();
    for element in elements {
        let label = match element {
            Element::Number(number) => number.to_string(),
            Element::Text(text) => text,
        };
        if labels.contains(&label) {
            return Err(format!("`{label}` is listed twice"));
        }
        labels.push(label);
    }
    Ok(Labels(labels))
}

impl<'de> Deserialize<'de> for Labels {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        list(deserializer, EXPECTED, labels)
    }
}

impl Serialize for Labels {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    struct Table {
        side_by_side: Labels,
    }

    fn of(text: &str) -> Result<Vec<String>, String> {
        let table: Result<Table, _> = toml::from_str(text);
        table
            .map(|t| t.side_by_side.names().to_vec())
            .map_err(|e| e.to_string())
    }

    #[test]
    fn texts_or_numbers_each_once() {
        let list = of("side_by_side = [1, \"up\", \"\"]").unwrap();
        assert_eq!(list, ["1", "up", ""]);
        for wrong in ["side_by_side = [1.5]", "side_by_side = [[1]]"] {
            assert!(of(wrong).unwrap_err().contains("whole numbers"), "{wrong}");
        }
        let error = of("side_by_side = [1, \"1\"]").unwrap_err();
        assert!(error.contains("`1` is listed twice"), "{error}");
    }
}
