//! Whether a JSON document keeps a JSON Schema: the part of draft 2020-12 that schemas made from Rust
//! types use. A word that is not known here is refused, so that nothing goes unchecked.

use serde_json::Value;

/// Words that say nothing about which documents are right.
const SILENT: [&str; 6] = [
    "$schema",
    "$defs",
    "title",
    "description",
    "format",
    "default",
];

/// What in `document` does not keep `schema`, one line each; empty: it keeps it.
pub fn violations(schema: &Value, document: &Value) -> Vec<String> {
    let mut found = Vec::new();
    check(schema, schema, document, "", &mut found);
    found
}

fn check(root: &Value, schema: &Value, value: &Value, at: &str, found: &mut Vec<String>) {
    let words = match schema {
        Value::Bool(true) => return,
        Value::Object(words) => words,
        other => return found.push(format!("{at}: {other} is no schema")),
    };
    for (word, says) in words {
        match word.as_str() {
            "$ref" => {
                let path = says.as_str().and_then(|path| path.strip_prefix('#'));
                match path.and_then(|path| root.pointer(path)) {
                    Some(target) => check(root, target, value, at, found),
                    None => found.push(format!("{at}: there is no {says}")),
                }
            }
            "type" => {
                let is = |name: &Value| name.as_str().is_some_and(|name| is_a(value, name));
                let right = says
                    .as_array()
                    .map_or_else(|| is(says), |a| a.iter().any(is));
                if !right {
                    found.push(format!("{at}: {value} is no {says}"));
                }
            }
            "const" if value != says => found.push(format!("{at}: {value} is not {says}")),
            "enum" if !says.as_array().is_some_and(|all| all.contains(value)) => {
                found.push(format!("{at}: {value} is none of {says}"));
            }
            "const" | "enum" => {}
            "anyOf" | "oneOf" => {
                let fits = |one: &Value| {
                    let mut wrong = Vec::new();
                    check(root, one, value, at, &mut wrong);
                    wrong.is_empty()
                };
                let n = says
                    .as_array()
                    .map_or(0, |all| all.iter().filter(|s| fits(s)).count());
                if n == 0 || (word == "oneOf" && n > 1) {
                    found.push(format!("{at}: {value} fits {n} of {word}"));
                }
            }
            "required" => {
                for key in says.as_array().into_iter().flatten() {
                    if let (Some(key), Some(object)) = (key.as_str(), value.as_object())
                        && !object.contains_key(key)
                    {
                        found.push(format!("{at}: the key `{key}` is missing"));
                    }
                }
            }
            "properties" => {
                for (key, inner) in value.as_object().into_iter().flatten() {
                    if let Some(schema) = says.get(key) {
                        check(root, schema, inner, &format!("{at}/{key}"), found);
                    }
                }
            }
            "additionalProperties" => {
                for (key, inner) in value.as_object().into_iter().flatten() {
                    if words.get("properties").and_then(|p| p.get(key)).is_none() {
                        check(root, says, inner, &format!("{at}/{key}"), found);
                    }
                }
            }
            "items" => {
                for (i, inner) in value.as_array().into_iter().flatten().enumerate() {
                    check(root, says, inner, &format!("{at}/{i}"), found);
                }
            }
            "minItems" | "maxItems" => {
                let (n, most) = (value.as_array().map(Vec::len), says.as_u64());
                if let (Some(n), Some(bound)) = (n, most)
                    && (if word == "minItems" {
                        (n as u64) < bound
                    } else {
                        n as u64 > bound
                    })
                {
                    found.push(format!("{at}: {n} items, {word} is {bound}"));
                }
            }
            "minimum" => {
                if let (Some(number), Some(least)) = (value.as_f64(), says.as_f64())
                    && number < least
                {
                    found.push(format!("{at}: {number} is below {least}"));
                }
            }
            silent if SILENT.contains(&silent) => {}
            other => found.push(format!("{at}: the word `{other}` is not known here")),
        }
    }
}

fn is_a(value: &Value, name: &str) -> bool {
    match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => false,
    }
}

/// Keys of `document` that its `schema` does not name, by path: a contract names every key.
pub fn unnamed(schema: &Value, document: &Value) -> Vec<String> {
    let mut found = Vec::new();
    walk(schema, &[schema], document, "", &mut found);
    found
}

fn walk(root: &Value, schemas: &[&Value], value: &Value, at: &str, found: &mut Vec<String>) {
    let mut open: Vec<&Value> = schemas.to_vec();
    let mut all: Vec<&Value> = Vec::new();
    while let Some(schema) = open.pop() {
        all.push(schema);
        let path = schema.get("$ref").and_then(Value::as_str);
        open.extend(path.and_then(|p| root.pointer(p.strip_prefix('#')?)));
        for word in ["anyOf", "oneOf"] {
            let list = schema.get(word).and_then(Value::as_array);
            open.extend(list.into_iter().flatten());
        }
    }
    match value {
        Value::Object(object) => {
            for (key, inner) in object {
                let at = format!("{at}/{key}");
                let named = all.iter().filter_map(|s| s.get("properties")?.get(key));
                let any = all.iter().filter_map(|s| s.get("additionalProperties"));
                let next: Vec<&Value> = named.chain(any).collect();
                if next.is_empty() {
                    found.push(at);
                } else {
                    walk(root, &next, inner, &at, found);
                }
            }
        }
        Value::Array(list) => {
            let items: Vec<&Value> = all.iter().filter_map(|s| s.get("items")).collect();
            for (i, inner) in list.iter().enumerate() {
                walk(root, &items, inner, &format!("{at}/{i}"), found);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_breaks_a_schema_is_named_with_its_place() {
        let schema = json!({
            "type": "object",
            "required": ["a"],
            "properties": {
                "a": {"$ref": "#/$defs/level"},
                "b": {"type": "array", "items": {"type": ["number", "null"]}, "maxItems": 2},
                "c": {"anyOf": [{"type": "null"}, {"enum": ["x", "y"]}]},
            },
            "$defs": {"level": {"type": "integer", "minimum": 0}},
        });
        let right = json!({"a": 1, "b": [0.5, null], "c": "y"});
        assert_eq!(violations(&schema, &right), [""; 0]);
        assert_eq!(unnamed(&schema, &right), [""; 0]);
        for (wrong, says) in [
            (json!({"b": []}), ": the key `a` is missing"),
            (json!({"a": -1}), "/a: -1 is below 0"),
            (json!({"a": "1"}), "/a: \"1\" is no \"integer\""),
            (
                json!({"a": 1, "b": ["x"]}),
                "/b/0: \"x\" is no [\"number\",\"null\"]",
            ),
            (
                json!({"a": 1, "b": [1, 2, 3]}),
                "/b: 3 items, maxItems is 2",
            ),
            (json!({"a": 1, "c": "z"}), "/c: \"z\" fits 0 of anyOf"),
        ] {
            assert_eq!(violations(&schema, &wrong), [says]);
        }
        assert_eq!(unnamed(&schema, &json!({"a": 1, "d": 2})), ["/d"]);
        let strange = json!({"propertyNames": {}});
        assert_eq!(violations(&strange, &json!({})).len(), 1);
    }
}
