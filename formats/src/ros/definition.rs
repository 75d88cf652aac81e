//! Definitions of ROS messages (`.msg`), as they stand in a file: the message itself, then those it
//! is made of, each behind a line of `=` and `MSG: package/Type`.
//!
//! Reference: ROS 2 design, "Interface definition using .msg / .srv / .action files".

use std::collections::HashMap;

/// All types that a message is made of; the message itself is the first.
#[derive(Debug, Default)]
pub(super) struct Definitions {
    pub(super) types: Vec<Message>,
}

/// One type.
#[derive(Debug, Default)]
pub(super) struct Message {
    pub(super) name: String,
    pub(super) fields: Vec<Field>,
}

#[derive(Debug)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) count: Count,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Count {
    One,
    /// Array of a fixed length.
    Fixed(usize),
    /// Sequence behind its length.
    Sequence,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Bool,
    Int(usize),
    Uint(usize),
    Float32,
    Float64,
    String,
    WString,
    /// Seconds and nanoseconds: a point in time or a duration.
    Time,
    Duration,
    /// Number of another type.
    Message(usize),
    /// A type whose definition is not there.
    Unknown,
}

impl Kind {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "bool" => Kind::Bool,
            "byte" | "char" | "uint8" => Kind::Uint(1),
            "int8" => Kind::Int(1),
            "int16" => Kind::Int(2),
            "uint16" => Kind::Uint(2),
            "int32" => Kind::Int(4),
            "uint32" => Kind::Uint(4),
            "int64" => Kind::Int(8),
            "uint64" => Kind::Uint(8),
            "float32" => Kind::Float32,
            "float64" => Kind::Float64,
            "string" => Kind::String,
            "wstring" => Kind::WString,
            "time" | "builtin_interfaces/Time" => Kind::Time,
            "duration" | "builtin_interfaces/Duration" => Kind::Duration,
            _ => return None,
        })
    }

    pub(super) fn declared(self) -> &'static str {
        match self {
            Kind::Bool => "bool",
            Kind::Int(1) => "int8",
            Kind::Int(2) => "int16",
            Kind::Int(4) => "int32",
            Kind::Int(_) => "int64",
            Kind::Uint(1) => "uint8",
            Kind::Uint(2) => "uint16",
            Kind::Uint(4) => "uint32",
            Kind::Uint(_) => "uint64",
            Kind::Float32 => "float32",
            Kind::Float64 => "float64",
            Kind::String | Kind::WString => "string",
            Kind::Time => "time",
            Kind::Duration => "duration",
            Kind::Message(_) | Kind::Unknown => "message",
        }
    }
}

/// `package/msg/Type` as `package/Type`.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

impl Definitions {
    /// Reads a text; `name` is the type that stands first.
    pub(super) fn parse(name: &str, text: &str) -> Self {
        let mut parts: Vec<(String, Vec<&str>)> = vec![(short(name), Vec::new())];
        for line in text.lines() {
            let line = line.trim();
            if line.len() >= 3 && line.bytes().all(|b| b == b'=') {
                parts.push((String::new(), Vec::new()));
            } else if let (Some(name), Some(last)) = (line.strip_prefix("MSG:"), parts.last_mut()) {
                last.0 = short(name.trim());
            } else if let Some(last) = parts.last_mut() {
                last.1.push(line);
            }
        }
        let mut find: HashMap<&str, usize> = HashMap::new();
        for (at, (name, _)) in parts.iter().enumerate() {
            find.entry(name).or_insert(at);
        }
        let types = parts
            .iter()
            .map(|(name, lines)| Message {
                name: name.clone(),
                fields: lines.iter().filter_map(|l| field(l, name, &find)).collect(),
            })
            .collect();
        Self { types }
    }
}

/// A line `type name`; none for comments and constants.
fn field(line: &str, within: &str, find: &HashMap<&str, usize>) -> Option<Field> {
    let line = line.split('#').next()?.trim();
    let (kind, rest) = line.split_once(char::is_whitespace)?;
    let rest = rest.trim();
    let name: &str = rest.split_whitespace().next()?;
    // `float64 MAX=1.0`, `uint8 A = 3`; a default value has no sign of equality.
    if name.contains('=') || rest[name.len()..].trim_start().starts_with('=') {
        return None;
    }
    let (kind, count) = match kind.split_once('[') {
        Some((kind, count)) => {
            let count = count.trim_end_matches(']');
            let count = count.parse().map_or(Count::Sequence, Count::Fixed);
            (kind, count)
        }
        None => (kind, Count::One),
    };
    // `string<=10`
    let kind = kind.split("<=").next().unwrap_or(kind);
    let full = short(kind);
    let package = within.split('/').next().unwrap_or("");
    let kind = Kind::of(&full).or_else(|| {
        let near = format!("{package}/{full}");
        let known = find.get(full.as_str()).or_else(|| find.get(near.as_str()));
        let ends = || {
            let end = format!("/{full}");
            find.iter()
                .find(|(name, _)| name.ends_with(&end))
                .map(|(_, at)| at)
        };
        known.or_else(ends).map(|at| Kind::Message(*at))
    });
    Some(Field {
        name: name.to_owned(),
        kind: kind.unwrap_or(Kind::Unknown),
        count,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_definition_with_everything() {
        let text = "# a comment\nuint8 MODE_A=1\nstring NAME = \"x\"\nstd_msgs/Header header\n\
            float64[] position\nfloat32[3] gains # three\nstring<=10 name \"default\"\nint32 n 5\n\
            Pose[<=4] poses\n================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\n\
            string frame_id\n===\nMSG: my_msgs/msg/Pose\nfloat64 x\n";
        let all = Definitions::parse("my_msgs/msg/State", text);
        let fields: Vec<(&str, Kind, Count)> = all.types[0]
            .fields
            .iter()
            .map(|f| (f.name.as_str(), f.kind, f.count))
            .collect();
        assert_eq!(
            fields,
            [
                ("header", Kind::Message(1), Count::One),
                ("position", Kind::Float64, Count::Sequence),
                ("gains", Kind::Float32, Count::Fixed(3)),
                ("name", Kind::String, Count::One),
                ("n", Kind::Int(4), Count::One),
                ("poses", Kind::Message(2), Count::Sequence),
            ]
        );
        assert_eq!(all.types[1].fields[0].kind, Kind::Time);
    }

    #[test]
    fn what_is_not_defined_is_unknown() {
        let all = Definitions::parse("a/B", "c/D d\n");
        assert_eq!(all.types[0].fields[0].kind, Kind::Unknown);
    }
}
