//! Reading TOML so that a mistake is shown where it stands.
//!
//! typetag loses the positions of what it reads. So a file is read with the path of keys kept
//! (serde_path_to_error), and the path of an error is looked up in the document as it was written.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use toml_edit::{Document, Item};

/// A mistake in a TOML file, with its place.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{file}:{line}:{column}: {message}")]
pub struct ConfigError {
    /// Name of the file.
    pub file: String,
    /// Its text.
    pub text: String,
    /// Where in the text, in bytes.
    pub span: Range<usize>,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1, in characters.
    pub column: usize,
    /// What was expected and what was found.
    pub message: String,
    /// The nearest right thing.
    pub help: Option<String>,
}

/// A file that could not be read at all.
#[derive(Debug, thiserror::Error)]
#[error("cannot read {}: {why}", path.display())]
pub struct ReadError {
    /// Which file.
    pub path: PathBuf,
    /// Why.
    pub why: String,
}

/// Reads a text file, with the reasons people meet spelled out.
pub fn read_text(path: &Path) -> Result<String, ReadError> {
    let error = |why: String| ReadError {
        path: path.to_owned(),
        why,
    };
    if path.is_dir() {
        return Err(error("it is a directory, expected a file".to_owned()));
    }
    let bytes = std::fs::read(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => error("there is no such file".to_owned()),
        _ => error(e.to_string()),
    })?;
    String::from_utf8(bytes).map_err(|e| {
        error(format!(
            "byte {} is not text (UTF-8), expected a text file",
            e.utf8_error().valid_up_to()
        ))
    })
}

/// A step in the path to a value.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Key of a table.
    Key(String),
    /// Index into an array.
    Index(usize),
}

impl From<&str> for Step {
    fn from(key: &str) -> Self {
        Step::Key(key.to_owned())
    }
}

impl From<usize> for Step {
    fn from(index: usize) -> Self {
        Step::Index(index)
    }
}

/// A TOML document that can say where its values stand.
#[derive(Debug)]
pub struct Source {
    /// Name of the file.
    pub file: String,
    /// Its text.
    pub text: String,
    document: Document<String>,
}

impl Source {
    /// Parses the syntax of `text`.
    pub fn parse(file: &str, text: &str) -> Result<Self, Box<ConfigError>> {
        match Document::parse(text.to_owned()) {
            Ok(document) => Ok(Self {
                file: file.to_owned(),
                text: text.to_owned(),
                document,
            }),
            Err(error) => {
                let span = error.span().unwrap_or(0..0);
                let message = error.message().replace('\n', "; ");
                Err(Box::new(make_error(file, text, span, message, None)))
            }
        }
    }

    /// Whether the document has this key at its top.
    pub fn has(&self, key: &str) -> bool {
        self.document.contains_key(key)
    }

    /// Reads the whole document as a `T`.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, Box<ConfigError>> {
        self.one_part_each()?;
        let deserializer = match toml::Deserializer::parse(&self.text) {
            Ok(deserializer) => deserializer,
            Err(error) => {
                let span = error.span().unwrap_or(0..0);
                return Err(Box::new(make_error(
                    &self.file,
                    &self.text,
                    span,
                    error.message().to_owned(),
                    None,
                )));
            }
        };
        serde_path_to_error::deserialize(deserializer).map_err(|error| {
            let path: Vec<Step> = error
                .path()
                .iter()
                .filter_map(|segment| match segment {
                    serde_path_to_error::Segment::Map { key } => Some(Step::Key(key.clone())),
                    serde_path_to_error::Segment::Enum { variant } => {
                        Some(Step::Key(variant.clone()))
                    }
                    serde_path_to_error::Segment::Seq { index } => Some(Step::Index(*index)),
                    serde_path_to_error::Segment::Unknown => None,
                })
                .collect();
            // Lines after the first repeat the path.
            let message = error.inner().message().lines().next();
            self.explain(path, message.unwrap_or(""))
        })
    }

    /// Of two parts in one table typetag would take the first and drop the other without a word.
    fn one_part_each(&self) -> Result<(), Box<ConfigError>> {
        let table = self.document.as_table();
        let roles = ["plant", "driver", "controller", "estimator"].map(|role| {
            let part = table.get(role).and_then(Item::as_table_like);
            (vec![Step::from(role)], part)
        });
        let effects = table.get("effect").and_then(Item::as_array_of_tables);
        let effects = effects.into_iter().flatten().enumerate().map(|(i, t)| {
            let part: &dyn toml_edit::TableLike = t;
            (vec!["effect".into(), i.into()], Some(part))
        });
        for (mut path, part) in roles.into_iter().chain(effects) {
            let mut keys = part.into_iter().flat_map(|t| t.iter());
            if let (Some((first, _)), Some((second, _))) = (keys.next(), keys.next()) {
                let message = format!("`{second}` stands beside `{first}`, expected one of them");
                path.push(second.into());
                return Err(self.error(&path, &message, None));
            }
        }
        Ok(())
    }

    /// An error at `path`; the deepest part of it that the document has is pointed at.
    pub fn error(&self, path: &[Step], message: &str, help: Option<String>) -> Box<ConfigError> {
        self.error_at(self.locate(path, false), message, help)
    }

    fn error_at(
        &self,
        span: Range<usize>,
        message: &str,
        help: Option<String>,
    ) -> Box<ConfigError> {
        Box::new(make_error(
            &self.file,
            &self.text,
            span,
            message.to_owned(),
            help,
        ))
    }

    /// Turns serde's words into an error with the nearest right name.
    fn explain(&self, mut path: Vec<Step>, message: &str) -> Box<ConfigError> {
        let names = quoted(message);
        let unknown = ["unknown field", "unknown variant"]
            .iter()
            .any(|w| message.starts_with(w));
        if unknown || message.starts_with("field ") {
            // Depending on where serde noticed, the path ends above the key or with it.
            if let Some(name) = names.first().map(|n| Step::Key(n.clone()))
                && path.last() != Some(&name)
            {
                path.push(name);
            }
        }
        if unknown {
            let (found, expected) = match names.split_first() {
                Some((found, expected)) => (found.as_str(), expected),
                None => ("", &[][..]),
            };
            return self.error_at(
                self.locate(&path, true),
                &unknown_text(&path, found, expected),
                nearest_text(found, expected),
            );
        }
        if let Some(missing) = message.strip_prefix("missing field ") {
            let message = format!("the key {missing} is missing here");
            return self.error(&path, &message, None);
        }
        self.error(&path, message, None)
    }

    /// The text with numbers replaced or added at the paths given; everything else, comments
    /// included, stays as it was written.
    pub fn with_values(&self, values: &[(Vec<Step>, f64)]) -> String {
        let Ok(mut document) = self.text.parse::<toml_edit::DocumentMut>() else {
            return self.text.clone();
        };
        for (path, value) in values {
            set_value(document.as_item_mut(), path, *value);
        }
        document.to_string()
    }

    /// The text with an `[[effect]]` at the end of those it has: its id, channels and parameters.
    pub fn with_effect(&self, id: &str, at: &[&str], parameters: &[(&str, f64)]) -> String {
        let Ok(mut document) = self.text.parse::<toml_edit::DocumentMut>() else {
            return self.text.clone();
        };
        let mut part = toml_edit::Table::new();
        part.insert(
            "at",
            toml_edit::value(at.iter().copied().collect::<toml_edit::Array>()),
        );
        for (name, value) in parameters {
            part.insert(name, toml_edit::value(*value));
        }
        let mut entry = toml_edit::Table::new();
        entry.insert(id, Item::Table(part));
        let effects = document
            .entry("effect")
            .or_insert(Item::ArrayOfTables(toml_edit::ArrayOfTables::new()));
        match effects {
            Item::ArrayOfTables(effects) => effects.push(entry),
            // `effect = []`, as an inline array
            other => {
                let mut effects = toml_edit::ArrayOfTables::new();
                effects.push(entry);
                *other = Item::ArrayOfTables(effects);
            }
        }
        document.to_string()
    }

    /// Where the value at `path`, or the deepest known part of it, stands; with `key`, where the
    /// last key of the path stands.
    fn locate(&self, path: &[Step], key: bool) -> Range<usize> {
        let mut span = 0..line_end(&self.text, 0);
        let mut node = Node::Table(self.document.as_table());
        for (depth, step) in path.iter().enumerate() {
            let Some((next, key_span, value_span)) = node.step(step) else {
                break;
            };
            let at_key = key && depth + 1 == path.len();
            if let Some(found) = if at_key {
                key_span
            } else {
                value_span.or(key_span)
            } {
                // A table reaches over many lines: its header is enough.
                span = found.start..found.end.min(line_end(&self.text, found.start));
            }
            node = next;
        }
        span
    }
}

/// Sets the number at `path` below `item`, keeping what stands around it.
fn set_value(item: &mut Item, path: &[Step], value: f64) {
    match path {
        [] => {}
        [Step::Key(key)] => {
            let Some(table) = item.as_table_like_mut() else {
                return;
            };
            let mut new = toml_edit::Value::from(value);
            if let Some(old) = table.get(key).and_then(Item::as_value) {
                *new.decor_mut() = old.decor().clone();
            }
            table.insert(key, Item::Value(new));
        }
        [Step::Key(key), rest @ ..] => {
            let next = item.as_table_like_mut().and_then(|t| t.get_mut(key));
            if let Some(next) = next {
                set_value(next, rest, value);
            }
        }
        [Step::Index(index), rest @ ..] => {
            let table = item
                .as_array_of_tables_mut()
                .and_then(|a| a.get_mut(*index));
            let [Step::Key(part), rest @ ..] = rest else {
                return;
            };
            if let Some(next) = table.and_then(|t| t.get_mut(part)) {
                set_value(next, rest, value);
            }
        }
    }
}

/// A place in a document.
enum Node<'a> {
    Table(&'a dyn toml_edit::TableLike),
    Array(&'a toml_edit::Array),
    Tables(&'a toml_edit::ArrayOfTables),
    Leaf,
}

type Found<'a> = (Node<'a>, Option<Range<usize>>, Option<Range<usize>>);

impl<'a> Node<'a> {
    fn step(&self, step: &Step) -> Option<Found<'a>> {
        match (self, step) {
            (Node::Table(table), Step::Key(key)) => {
                let (found, item) = table.get_key_value(key)?;
                let node = match item {
                    Item::Table(table) => Node::Table(table),
                    Item::ArrayOfTables(tables) => Node::Tables(tables),
                    Item::Value(value) => Node::of(value),
                    Item::None => Node::Leaf,
                };
                Some((node, found.span(), item.span()))
            }
            (Node::Array(array), Step::Index(index)) => {
                let value = array.get(*index)?;
                Some((Node::of(value), value.span(), value.span()))
            }
            (Node::Tables(tables), Step::Index(index)) => {
                let table = tables.get(*index)?;
                Some((Node::Table(table), table.span(), table.span()))
            }
            _ => None,
        }
    }

    fn of(value: &'a toml_edit::Value) -> Self {
        match value {
            toml_edit::Value::InlineTable(table) => Node::Table(table),
            toml_edit::Value::Array(array) => Node::Array(array),
            _ => Node::Leaf,
        }
    }
}

fn line_end(text: &str, from: usize) -> usize {
    text[from..].find('\n').map_or(text.len(), |n| from + n)
}

fn make_error(
    file: &str,
    text: &str,
    span: Range<usize>,
    message: String,
    help: Option<String>,
) -> ConfigError {
    let start = span.start.min(text.len());
    let before = text.get(..start).unwrap_or("");
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
    let end = span.end.clamp(start, text.len());
    ConfigError {
        file: file.to_owned(),
        text: text.to_owned(),
        span: start..end,
        line,
        column,
        message,
        help,
    }
}

/// What stands between backticks.
fn quoted(message: &str) -> Vec<String> {
    message
        .split('`')
        .skip(1)
        .step_by(2)
        .map(str::to_owned)
        .collect()
}

fn unknown_text(path: &[Step], found: &str, expected: &[String]) -> String {
    let place = match path {
        [] | [_] => String::new(),
        [.., Step::Key(parent), _] => format!(" in `{parent}`"),
        _ => String::new(),
    };
    if expected.is_empty() {
        format!("unknown name `{found}`{place}, nothing is expected here")
    } else {
        format!(
            "unknown name `{found}`{place}, expected one of {}",
            expected.join(", ")
        )
    }
}

fn nearest_text(found: &str, expected: &[String]) -> Option<String> {
    nearest(found, expected.iter().map(String::as_str)).map(|n| format!("did you mean `{n}`?"))
}

/// The candidate most like `found`, if any is (Jaro–Winkler above 0.7, or few letters changed).
pub fn nearest<'a>(found: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let found = found.to_lowercase();
    candidates
        .into_iter()
        .filter_map(|c| {
            let name = c.to_lowercase();
            let alike = strsim::jaro_winkler(&found, &name);
            let edits = strsim::normalized_damerau_levenshtein(&found, &name);
            (alike > 0.7 || edits > 0.6).then_some((alike.max(edits), c))
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, c)| c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only read to be refused")]
    struct Thing {
        mass: f64,
        list: Option<Vec<f64>>,
    }

    #[test]
    fn an_unknown_key_is_pointed_at_with_the_nearest_name() {
        let source = Source::parse("m.toml", "# a comment\nmas = 3.0\n").unwrap();
        let error = source.read::<Thing>().unwrap_err();
        assert_eq!((error.line, error.column), (2, 1));
        assert_eq!(error.help.as_deref(), Some("did you mean `mass`?"));
    }

    #[test]
    fn a_wrong_type_is_pointed_at() {
        let source = Source::parse("m.toml", "mass = 1.0\nlist = [1.0, \"x\"]\n").unwrap();
        let error = source.read::<Thing>().unwrap_err();
        assert_eq!((error.line, error.column), (2, 14));
        assert!(error.message.contains("invalid type"), "{}", error.message);
    }

    #[test]
    fn values_are_replaced_and_comments_kept() {
        let text = "# robot\n[plant.a]\nk = 1.0 # first\n\n[[effect]]\n[effect.b]\nat = [\"x\"]\n";
        let source = Source::parse("m.toml", text).unwrap();
        let new = source.with_values(&[
            (vec!["plant".into(), "a".into(), "k".into()], -2.5),
            (
                vec!["effect".into(), 0.into(), "b".into(), "level".into()],
                0.25,
            ),
        ]);
        assert_eq!(
            new,
            "# robot\n[plant.a]\nk = -2.5 # first\n\n[[effect]]\n[effect.b]\nat = [\"x\"]\nlevel = 0.25\n"
        );
    }

    #[test]
    fn broken_syntax_is_pointed_at() {
        let error = Source::parse("m.toml", "mass = \n").unwrap_err();
        assert_eq!(error.line, 1);
    }

    #[test]
    fn unlike_names_are_not_suggested() {
        assert_eq!(nearest("qqqq", ["mass", "inertia"]), None);
        assert_eq!(nearest("K_a", ["K_A", "K_B"]), Some("K_A"));
        assert_eq!(nearest("fti", ["log", "fit"]), Some("fit"));
    }
}
