//! What the metadata of an entry say.

use serde_json::Value;

/// The unit, where the metadata are JSON that names one.
pub(super) fn unit(metadata: &[u8]) -> Option<String> {
    let json: Value = serde_json::from_slice(metadata).ok()?;
    let find = |json: &Value| {
        ["unit", "units"]
            .iter()
            .find_map(|key| Some(json.get(key)?.as_str()?.to_owned()))
    };
    find(&json)
        .or_else(|| find(json.get("properties")?))
        .filter(|unit| !unit.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_stands_in_the_metadata_or_their_properties() {
        assert_eq!(unit(br#"{"unit":"V"}"#).as_deref(), Some("V"));
        assert_eq!(
            unit(br#"{"properties":{"units":"rad/s"}}"#).as_deref(),
            Some("rad/s")
        );
        assert_eq!(unit(b"{\"source\":\"NT\"}"), None);
        assert_eq!(unit(b"no json"), None);
    }
}
