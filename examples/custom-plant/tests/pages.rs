//! The pages in `docs/` show the code of this crate, to the letter.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a page that shows something else is how this program fails"
)]

use std::path::{Path, PathBuf};

fn crate_folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// What stands between fences in a page: the line before the fence that is not empty, the
/// language, the text.
fn blocks(page: &str) -> Vec<(String, String, String)> {
    let mut found = Vec::new();
    let mut before = String::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            let text: Vec<&str> = lines.by_ref().take_while(|l| *l != "```").collect();
            let text = text.join("\n") + "\n";
            found.push((before.clone(), language.to_owned(), text));
        } else if !line.is_empty() {
            before = line.to_owned();
        }
    }
    found
}

/// The file of this crate that a line like ``**`src/main.rs`**`` names.
fn named(line: &str) -> Option<&str> {
    line.strip_prefix("**`")?.strip_suffix("`**")
}

#[test]
fn pages_show_the_files_of_this_crate() {
    let mut shown = Vec::new();
    for page in [
        "add-a-plant",
        "add-an-effect",
        "add-a-controller",
        "add-an-estimator",
        "add-a-driver",
    ] {
        let path = crate_folder().join(format!("../../docs/{page}.md"));
        let text = std::fs::read_to_string(&path).unwrap();
        for (before, language, block) in blocks(&text) {
            let Some(file) = named(&before) else {
                assert!(
                    !["rust", "toml", "python"].contains(&language.as_str()),
                    "{page}: a block of {language} is of no file: {block}"
                );
                continue;
            };
            let real = std::fs::read_to_string(crate_folder().join(file)).unwrap();
            assert!(
                block == real,
                "{page}: the block `{file}` differs from examples/custom-plant/{file}; copy the file"
            );
            shown.push(file.to_owned());
        }
    }
    // Every part of this crate has its page.
    for entry in std::fs::read_dir(crate_folder().join("src")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let page = shown
            .iter()
            .any(|s| Path::new(s).file_name().unwrap() == name.as_str());
        assert!(page || name == "main.rs", "src/{name} is on no page");
    }
}
