//! Where something stands in a file.

use std::ops::Range;

use toml_edit::Item;

use super::{ConfigError, PathSegment, TomlSource};

/// A mistake in the table of a part, which knows its own keys and not the file they stand in.
#[derive(Clone, Debug, PartialEq)]
pub struct Mistake {
    /// Path of keys from the part's table.
    pub path: Vec<PathSegment>,
    /// What of it is wrong.
    pub at: At,
    /// What was expected and what was found.
    pub message: String,
    /// The nearest right thing.
    pub help: Option<String>,
}

/// What a [`Mistake`] points at.
#[derive(Clone, Debug, PartialEq)]
pub enum At {
    /// The value.
    Value,
    /// The key.
    Key,
    /// These bytes of the value, which is a string.
    Text(Range<usize>),
}

impl Mistake {
    /// A wrong value.
    pub fn value(path: impl IntoIterator<Item = PathSegment>, message: impl Into<String>) -> Self {
        Self {
            path: path.into_iter().collect(),
            at: At::Value,
            message: message.into(),
            help: None,
        }
    }

    /// A wrong key.
    pub fn key(path: impl IntoIterator<Item = PathSegment>, message: impl Into<String>) -> Self {
        Self {
            at: At::Key,
            ..Self::value(path, message)
        }
    }

    /// Adds what would be right.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

impl TomlSource {
    /// Places a mistake in the table of a part, which stands at `table`.
    pub fn mistake(&self, table: &[PathSegment], mistake: Mistake) -> Box<ConfigError> {
        let path: Vec<PathSegment> = table.iter().chain(&mistake.path).cloned().collect();
        let span = match mistake.at {
            At::Value => self.locate(&path, false),
            At::Key => self.locate(&path, true),
            At::Text(within) => self
                .within(&path, within)
                .unwrap_or_else(|| self.locate(&path, false)),
        };
        self.error_at(span, &mistake.message, mistake.help)
    }

    /// Where a piece of the string at `path` stands; nothing for a string with escapes.
    fn within(&self, path: &[PathSegment], piece: Range<usize>) -> Option<Range<usize>> {
        let mut node = Node::Table(self.document.as_table());
        let mut span = None;
        let mut text = None;
        for step in path {
            let (next, _, value) = node.step(step)?;
            (span, text) = (value, next.text());
            node = next;
        }
        let (span, text) = (span?, text?);
        let start = span.start + self.text.get(span)?.find(text)?;
        Some(start + piece.start..start + piece.end)
    }

    /// Where the value at `path`, or the deepest known part of it, stands; with `key`, where the
    /// last key of the path stands.
    pub(super) fn locate(&self, path: &[PathSegment], key: bool) -> Range<usize> {
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

/// A place in a document.
enum Node<'a> {
    Table(&'a dyn toml_edit::TableLike),
    Array(&'a toml_edit::Array),
    Tables(&'a toml_edit::ArrayOfTables),
    Text(&'a str),
    Leaf,
}

type Found<'a> = (Node<'a>, Option<Range<usize>>, Option<Range<usize>>);

impl<'a> Node<'a> {
    fn step(&self, step: &PathSegment) -> Option<Found<'a>> {
        match (self, step) {
            (Node::Table(table), PathSegment::Key(key)) => {
                let (found, item) = table.get_key_value(key)?;
                let node = match item {
                    Item::Table(table) => Node::Table(table),
                    Item::ArrayOfTables(tables) => Node::Tables(tables),
                    Item::Value(value) => Node::of(value),
                    Item::None => Node::Leaf,
                };
                Some((node, found.span(), item.span()))
            }
            (Node::Array(array), PathSegment::Index(index)) => {
                let value = array.get(*index)?;
                Some((Node::of(value), value.span(), value.span()))
            }
            (Node::Tables(tables), PathSegment::Index(index)) => {
                let table = tables.get(*index)?;
                Some((Node::Table(table), table.span(), table.span()))
            }
            _ => None,
        }
    }

    fn text(&self) -> Option<&'a str> {
        match self {
            Node::Text(text) => Some(text),
            _ => None,
        }
    }

    fn of(value: &'a toml_edit::Value) -> Self {
        match value {
            toml_edit::Value::InlineTable(table) => Node::Table(table),
            toml_edit::Value::Array(array) => Node::Array(array),
            toml_edit::Value::String(text) => Node::Text(text.value()),
            _ => Node::Leaf,
        }
    }
}

fn line_end(text: &str, from: usize) -> usize {
    text[from..].find('\n').map_or(text.len(), |n| from + n)
}
