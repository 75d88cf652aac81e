//! The pages of `docs/effects` say what the library says.

#[path = "../examples/effect_gallery/page.rs"]
mod page;

use std::path::{Path, PathBuf};

use loopsight_hidden::Hidden;
use loopsight_model::registry;
use loopsight_plants as _;

const REMAKE: &str =
    "remake it: cargo run --release -p loopsight-tests --example effect_gallery -- docs/effects";

/// Whether a machine hides the effect, so that there is a picture.
fn drawn(id: &str) -> bool {
    id.parse::<Hidden>().is_ok()
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/effects")
}

/// A file of the folder; nothing where it cannot be read.
fn read(name: &str) -> String {
    std::fs::read_to_string(folder().join(name)).unwrap_or_default()
}

#[test]
fn every_effect_has_a_page_and_a_picture() {
    for meta in registry::effects() {
        let part = loopsight::explain(meta.id).unwrap().parts.remove(0);
        let text = read(&format!("{}.md", meta.id));
        let declared = page::declared(&part);
        let rest = text.strip_prefix(&declared);
        assert!(
            rest.is_some(),
            "{}.md is not what it should be; {REMAKE}",
            meta.id
        );
        let rest = rest.unwrap_or_default();
        if !drawn(meta.id) {
            assert_eq!(rest, "");
            continue;
        }
        assert!(
            rest.contains(&format!("]({}.svg)\n\nThe plain model", meta.id)),
            "{rest}"
        );
        // Both halves are drawn: lines over time, points over a quantity.
        let picture = read(&format!("{}.svg", meta.id));
        assert!(picture.contains("time, s"), "{}.svg", meta.id);
        let points = picture.matches("<circle").count();
        assert!(points >= 8, "{}.svg has {points} points", meta.id);
    }
}

#[test]
fn the_gallery_shows_all_of_them_and_nothing_else_lies_there() {
    assert_eq!(read("README.md"), page::gallery(&drawn), "{REMAKE}");
    let effects = registry::effects();
    let mut expected: Vec<String> = vec!["README.md".into()];
    for meta in &effects {
        expected.push(format!("{}.md", meta.id));
        if drawn(meta.id) {
            expected.push(format!("{}.svg", meta.id));
        }
    }
    expected.sort();
    let mut found: Vec<String> = std::fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    found.sort();
    assert_eq!(found, expected);
}
