//! Reading TOML so that a mistake is shown where it stands.
//!
//! typetag loses the positions of what it reads. So a file is read with the path of keys kept
//! (serde_path_to_error), and the path of an error is looked up in the document as it was written.

mod edit;
mod place;

use std::io::Read as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use toml_edit::{Document, Item};

pub use place::{At, Mistake};

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

/// Most bytes of a model, loop or experiment file: beyond it another file was meant.
const MOST_TEXT: u64 = 10_000_000;

/// Reads a text file, with the reasons people meet spelled out.
///
/// # Errors
///
/// [`ReadError`] where the file is missing, unreadable, not text, or too large.
pub fn read_text(path: &Path) -> Result<String, ReadError> {
    let error = |why: String| ReadError {
        path: path.to_owned(),
        why,
    };
    if path.is_dir() {
        return Err(error("it is a directory, expected a file".to_owned()));
    }
    let wrong = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => error("there is no such file".to_owned()),
        _ => error(e.to_string()),
    };
    let mut bytes = Vec::new();
    // A device or a pipe need not have an end.
    let file = std::fs::File::open(path).map_err(wrong)?;
    file.take(MOST_TEXT + 1)
        .read_to_end(&mut bytes)
        .map_err(wrong)?;
    if bytes.len() as u64 > MOST_TEXT {
        let most = MOST_TEXT / 1_000_000;
        return Err(error(format!(
            "it has more than {most} MB, expected a text file of at most {most} MB"
        )));
    }
    String::from_utf8(bytes).map_err(|e| {
        error(format!(
            "byte {} is not text (UTF-8), expected a text file",
            e.utf8_error().valid_up_to()
        ))
    })
}

/// A segment of the path to a value: a key, or an index into an array.
#[derive(Clone, Debug, PartialEq)]
pub enum PathSegment {
    /// Key of a table.
    Key(String),
    /// Index into an array.
    Index(usize),
}

impl From<&str> for PathSegment {
    fn from(key: &str) -> Self {
        PathSegment::Key(key.to_owned())
    }
}

impl From<usize> for PathSegment {
    fn from(index: usize) -> Self {
        PathSegment::Index(index)
    }
}

/// The text of a TOML file, which says where each of its values stands.
#[derive(Debug)]
pub struct TomlSource {
    /// Name of the file.
    pub file: String,
    /// Its text.
    pub text: String,
    document: Document<String>,
}

impl TomlSource {
    /// Parses the syntax of `text`.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] where the text is not TOML, with line and column.
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
    ///
    /// # Errors
    ///
    /// [`ConfigError`] where the document is not a `T`, with line, column and the nearest right name.
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
            let path: Vec<PathSegment> = error
                .path()
                .iter()
                .filter_map(|segment| match segment {
                    serde_path_to_error::Segment::Map { key } => {
                        Some(PathSegment::Key(key.clone()))
                    }
                    serde_path_to_error::Segment::Enum { variant } => {
                        Some(PathSegment::Key(variant.clone()))
                    }
                    serde_path_to_error::Segment::Seq { index } => Some(PathSegment::Index(*index)),
                    serde_path_to_error::Segment::Unknown => None,
                })
                .collect();
            // Lines after the first repeat the path.
            let message = error.inner().message().lines().next();
            self.explain(path, &without_types(message.unwrap_or("")))
        })
    }

    /// Of two parts in one table typetag would take the first and drop the other without a word.
    fn one_part_each(&self) -> Result<(), Box<ConfigError>> {
        let table = self.document.as_table();
        let roles = ["plant", "driver", "controller", "estimator"].map(|role| {
            let part = table.get(role).and_then(Item::as_table_like);
            (vec![PathSegment::from(role)], part)
        });
        let effects = ["effect", "candidate"].into_iter().flat_map(|list| {
            let parts = table.get(list).and_then(Item::as_array_of_tables);
            parts.into_iter().flatten().enumerate().map(move |(i, t)| {
                let part: &dyn toml_edit::TableLike = t;
                (vec![list.into(), i.into()], Some(part))
            })
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
    pub fn error(
        &self,
        path: &[PathSegment],
        message: &str,
        help: Option<String>,
    ) -> Box<ConfigError> {
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
    fn explain(&self, mut path: Vec<PathSegment>, message: &str) -> Box<ConfigError> {
        let names = quoted(message);
        let unknown = ["unknown field", "unknown variant"]
            .iter()
            .any(|w| message.starts_with(w));
        if unknown || message.starts_with("field ") {
            // Depending on where serde noticed, the path ends above the key or with it.
            if let Some(name) = names.first().map(|n| PathSegment::Key(n.clone()))
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
        if message == "invalid type: map, expected a sequence"
            && let [PathSegment::Key(list)] = &*path
        {
            let message = format!("`{list}` is one table here, expected a list of them");
            let help = format!("begin each of them with a line `[[{list}]]`");
            return self.error(&path, &message, Some(help));
        }
        self.error(&path, message, None)
    }
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

fn unknown_text(path: &[PathSegment], found: &str, expected: &[String]) -> String {
    let place = match path {
        [] | [_] => String::new(),
        [.., PathSegment::Key(parent), _] => format!(" in `{parent}`"),
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

/// A message without the names of types: who writes a file knows tables.
fn without_types(message: &str) -> String {
    match message.split_once("expected struct ") {
        Some((found, _)) => format!("{found}expected a table"),
        None => message.to_owned(),
    }
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
        let source = TomlSource::parse("m.toml", "# a comment\nmas = 3.0\n").unwrap();
        let error = source.read::<Thing>().unwrap_err();
        assert_eq!((error.line, error.column), (2, 1));
        assert_eq!(error.help.as_deref(), Some("did you mean `mass`?"));
    }

    #[test]
    fn a_wrong_type_is_pointed_at() {
        #[derive(Debug, serde::Deserialize)]
        #[allow(dead_code, reason = "only read to be refused")]
        struct Outer {
            thing: Thing,
        }
        let source = TomlSource::parse("m.toml", "thing = \"x\"\n").unwrap();
        let message = source.read::<Outer>().unwrap_err().message;
        assert_eq!(message, "invalid type: string \"x\", expected a table");
        let source = TomlSource::parse("m.toml", "mass = 1.0\nlist = [1.0, \"x\"]\n").unwrap();
        let error = source.read::<Thing>().unwrap_err();
        assert_eq!((error.line, error.column), (2, 14));
        assert!(error.message.contains("invalid type"), "{}", error.message);
    }

    #[test]
    fn one_table_where_a_list_belongs_is_told_how_a_list_begins() {
        let source = TomlSource::parse("m.toml", "mass = 1.0\n[list.first]\n").unwrap();
        let error = source.read::<Thing>().unwrap_err();
        assert_eq!((error.line, error.column), (2, 2));
        let message = "`list` is one table here, expected a list of them";
        assert_eq!(error.message, message);
        let help = "begin each of them with a line `[[list]]`";
        assert_eq!(error.help.as_deref(), Some(help));
    }

    #[test]
    fn broken_syntax_is_pointed_at() {
        let error = TomlSource::parse("m.toml", "mass = \n").unwrap_err();
        assert_eq!(error.line, 1);
    }

    #[test]
    fn unlike_names_are_not_suggested() {
        assert_eq!(nearest("qqqq", ["mass", "inertia"]), None);
        assert_eq!(nearest("K_a", ["K_A", "K_B"]), Some("K_A"));
        assert_eq!(nearest("fti", ["log", "fit"]), Some("fit"));
    }
}
