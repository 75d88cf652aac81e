//! Writing into a file, so that everything else stays as it was written.

use toml_edit::Item;

use super::{PathSegment, TomlSource};

impl TomlSource {
    /// The text with numbers replaced or added at the paths given; everything else, comments
    /// included, stays as it was written.
    pub fn with_values(&self, values: &[(Vec<PathSegment>, f64)]) -> String {
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
        push_effect(&mut document, entry);
        document.to_string()
    }

    /// The text with the `[[effect]]` entries of `entries` at the end of those it has.
    pub fn with_entries(&self, entries: &str) -> String {
        let parsed = [&self.text, entries].map(str::parse::<toml_edit::DocumentMut>);
        let [Ok(mut document), Ok(mut more)] = parsed else {
            return self.text.clone();
        };
        if let Some(Item::ArrayOfTables(more)) = more.remove("effect") {
            for mut entry in more {
                place_anew(&mut entry);
                push_effect(&mut document, entry);
            }
        }
        document.to_string()
    }

    /// The text with the `[[candidate]]` of this name as the last of its effects.
    pub fn with_candidate(&self, name: &str) -> String {
        let Ok(mut document) = self.text.parse::<toml_edit::DocumentMut>() else {
            return self.text.clone();
        };
        let Some(Item::ArrayOfTables(candidates)) = document.get_mut("candidate") else {
            return self.text.clone();
        };
        let is_it = |entry: &toml_edit::Table| {
            let mut parts = entry.iter().filter_map(|(_, part)| part.get("name"));
            parts.any(|given| given.as_str() == Some(name))
        };
        let Some(index) = candidates.iter().position(is_it) else {
            return self.text.clone();
        };
        let Some(mut entry) = candidates.get(index).cloned() else {
            return self.text.clone();
        };
        candidates.remove(index);
        if candidates.is_empty() {
            document.remove("candidate");
        }
        place_anew(&mut entry);
        push_effect(&mut document, entry);
        document.to_string()
    }

    /// The text with these parameters under `[fit] tied`, besides those that it has there.
    pub fn with_tied(&self, names: &[&str]) -> String {
        let Ok(mut document) = self.text.parse::<toml_edit::DocumentMut>() else {
            return self.text.clone();
        };
        let fit = document
            .entry("fit")
            .or_insert(Item::Table(toml_edit::Table::new()));
        let Some(fit) = fit.as_table_like_mut() else {
            return self.text.clone();
        };
        let tied = fit
            .entry("tied")
            .or_insert(toml_edit::value(toml_edit::Array::new()));
        if let Some(list) = tied.as_array_mut() {
            for name in names {
                if !list.iter().any(|known| known.as_str() == Some(name)) {
                    list.push(*name);
                }
            }
        }
        document.to_string()
    }

    /// The text without its `index`-th `[[effect]]`.
    pub fn without_effect(&self, index: usize) -> String {
        let Ok(mut document) = self.text.parse::<toml_edit::DocumentMut>() else {
            return self.text.clone();
        };
        match document.get_mut("effect") {
            Some(Item::ArrayOfTables(effects)) if index < effects.len() => effects.remove(index),
            _ => return self.text.clone(),
        };
        document.to_string()
    }
}

/// Sets the number at `path` below `item`, keeping what stands around it.
/// Puts an `[[effect]]` behind those that a document has.
fn push_effect(document: &mut toml_edit::DocumentMut, entry: toml_edit::Table) {
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
}

/// Lets a table of another document, and the tables in it, stand where they are put: their places in that document
/// mean nothing in this one.
fn place_anew(table: &mut toml_edit::Table) {
    table.set_position(None);
    for (_, item) in table.iter_mut() {
        if let Item::Table(inner) = item {
            place_anew(inner);
        }
    }
}

fn set_value(item: &mut Item, path: &[PathSegment], value: f64) {
    match path {
        [] => {}
        [PathSegment::Key(key)] => {
            let is_new = item.get(key).is_none();
            if let Some(inline) = item.as_inline_table_mut().filter(|_| is_new)
                && let Some((_, last)) = inline.iter_mut().last()
            {
                // The space before the closing brace goes to the new last value.
                last.decor_mut().set_suffix("");
            }
            let Some(table) = item.as_table_like_mut() else {
                return;
            };
            let mut new = toml_edit::Value::from(value);
            if let Some(old) = table.get(key).and_then(Item::as_value) {
                *new.decor_mut() = old.decor().clone();
            }
            table.insert(key, Item::Value(new));
        }
        [PathSegment::Key(key), rest @ ..] => {
            let next = item.as_table_like_mut().and_then(|t| t.get_mut(key));
            if let Some(next) = next {
                set_value(next, rest, value);
            }
        }
        [PathSegment::Index(index), rest @ ..] => {
            let table = item
                .as_array_of_tables_mut()
                .and_then(|a| a.get_mut(*index));
            let [PathSegment::Key(part), rest @ ..] = rest else {
                return;
            };
            if let Some(next) = table.and_then(|t| t.get_mut(part)) {
                set_value(next, rest, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_replaced_and_comments_kept() {
        let text = "# robot\n[plant.a]\nk = 1.0 # first\n\n[[effect]]\n[effect.b]\nat = [\"x\"]\n";
        let source = TomlSource::parse("m.toml", text).unwrap();
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
    fn a_candidate_becomes_an_effect() {
        let candidate = |name: &str| {
            format!("# why {name}\n[[candidate]]\n[candidate.own]\nname = \"{name}\" # kept\n\n")
        };
        let file = format!(
            "# mine\n[[effect]]\n[effect.drag]\n\n{}{}[log]\ntime = \"t\"\n",
            candidate("a"),
            candidate("b")
        );
        let read = |text: &str| TomlSource::parse("m.toml", text).unwrap();
        let one = read(&file).with_candidate("b");
        let table: toml::Table = one.parse().unwrap();
        let effects = table["effect"].as_array().unwrap();
        assert_eq!(
            (effects.len(), table["candidate"].as_array().unwrap().len()),
            (2, 1)
        );
        assert_eq!(effects[1]["own"]["name"].as_str(), Some("b"));
        assert!(
            one.contains("# why b\n[[effect]]") && one.contains("\"b\" # kept"),
            "{one}"
        );
        let both: toml::Table = read(&one).with_candidate("a").parse().unwrap();
        assert_eq!(both["effect"].as_array().unwrap().len(), 3);
        assert!(!both.contains_key("candidate"));
        assert_eq!(read(&one).with_candidate("c"), one);
    }

    #[test]
    fn entries_stand_behind_those_of_the_file() {
        let entry = "[[effect]]\n[effect.own]\nforce = \"c\"\n\n[effect.own.parameters]\nc = 2.0\n";
        let file = "# mine\n[[effect]]\n[effect.drag]\nlevel = 1.0 # kept\n\n[log]\ntime = \"t\"\n";
        let with = TomlSource::parse("m.toml", file)
            .unwrap()
            .with_entries(entry);
        let document: toml::Table = with.parse().unwrap();
        let effects = document["effect"].as_array().unwrap();
        assert_eq!(effects[0]["drag"]["level"].as_float(), Some(1.0));
        assert_eq!(effects[1]["own"]["parameters"]["c"].as_float(), Some(2.0));
        assert!(with.starts_with("# mine\n") && with.contains("# kept"));
        // A file without effects, and one with an empty list of them.
        for file in ["", "effect = []\n"] {
            let with = TomlSource::parse("m.toml", file)
                .unwrap()
                .with_entries(entry);
            let document: toml::Table = with.parse().unwrap();
            assert_eq!(document["effect"].as_array().unwrap().len(), 1, "{with}");
        }
    }
}
