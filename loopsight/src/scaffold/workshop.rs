//! A crate with a plant and an effect of its own, and a command that has them.

use std::path::{Path, PathBuf};

use loopsight_model::config::read_text;
use loopsight_recordings::output::NewFolder;

use super::Made;
use crate::error::{Error, Result};

/// Files of `examples/custom-plant`. That crate is built and tested, so a copy of it works.
const FILES: [(&str, &str); 6] = [
    (
        "src/ship_heading.rs",
        include_str!("../../template/ship_heading.rs"),
    ),
    (
        "src/norrbin_damping.rs",
        include_str!("../../template/norrbin_damping.rs"),
    ),
    ("model.toml", include_str!("../../template/model.toml")),
    ("ship.toml", include_str!("../../template/ship.toml")),
    ("zigzag.toml", include_str!("../../template/zigzag.toml")),
    ("turns.toml", include_str!("../../template/turns.toml")),
];

const MAIN: &str = r"//! The command `loopsight` with a plant and an effect of our own in it.
//!
//! A part is known as soon as its file is a module here: `cargo run -- list` shows it, and models,
//! fits, diagnoses and pages use it.

mod norrbin_damping;
mod ship_heading;

use std::process::ExitCode;

fn main() -> ExitCode {
    loopsight::cli::run()
}
";

/// What to type next.
const COMMANDS: [&str; 3] = [
    "cargo run -- explain ship_heading",
    "cargo run -- simulate ship.toml turns.toml -o turns.csv",
    "cargo run -- diagnose model.toml turns.csv --html why.html",
];

/// Where this command was built: a crate of a checkout, or cargo's folder of a published one.
const BUILT_FROM: &str = env!("CARGO_MANIFEST_DIR");

/// Where a new crate takes loopsight from.
enum Source {
    /// A checkout of its repository.
    Checkout(PathBuf),
    /// The published version of this command.
    Published,
}

impl Source {
    /// A dependency on the crate in `room`, as a TOML value.
    fn dependency(&self, room: &str) -> String {
        match self {
            Self::Checkout(checkout) => {
                let path = checkout.join(room).display().to_string();
                // A JSON string is a TOML string.
                format!("{{ path = {} }}", serde_json::Value::from(path))
            }
            Self::Published => format!("\"{}\"", env!("CARGO_PKG_VERSION")),
        }
    }

    fn note(&self) -> String {
        match self {
            Self::Checkout(path) => format!(
                "loopsight is taken from {}; `--loopsight PATH` names another checkout",
                path.display()
            ),
            Self::Published => format!(
                "loopsight {} is taken from the registry; `--loopsight PATH` names a checkout",
                env!("CARGO_PKG_VERSION")
            ),
        }
    }
}

/// Makes the folder `target` for a crate that is built with the checkout `loopsight`, or else with the
/// one that this program came from, or else with what is published.
pub(crate) fn workshop(target: &Path, loopsight: Option<&Path>) -> Result<Made> {
    let mut folder = NewFolder::create(target)?;
    check_name(folder.name())?;
    let source = source(loopsight)?;
    let manifest = manifest(folder.name(), &source);
    folder.write("Cargo.toml", &manifest)?;
    if let Source::Checkout(checkout) = &source {
        // With the versions of everything that loopsight itself was tested with.
        folder.write("Cargo.lock", &read_text(&checkout.join("Cargo.lock"))?)?;
    }
    folder.write("src/main.rs", MAIN)?;
    for (name, text) in FILES {
        folder.write(name, text)?;
    }
    let text = readme(folder.name());
    folder.write("README.md", &text)?;
    folder.write(".gitignore", "/target\n")?;
    Ok(Made {
        written: folder.finish()?,
        note: Some(source.note()),
        next: COMMANDS.map(str::to_owned).to_vec(),
    })
}

/// Names that cargo or Rust keeps for itself; keywords are refused by cargo with a message of its
/// own.
const RESERVED: [&str; 9] = [
    "alloc",
    "build",
    "core",
    "proc_macro",
    "std",
    "test",
    "loopsight-core",
    "loopsight-model",
    "loopsight",
];

fn check_name(name: &str) -> Result<()> {
    let mut letters = name.chars();
    let first = letters.next().is_some_and(|c| c.is_ascii_alphabetic());
    let rest = letters.all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
    if first && rest && !RESERVED.contains(&name) {
        return Ok(());
    }
    let cleaned: String = name
        .chars()
        .map(|c| {
            if c.is_ascii_alphanumeric() || c == '_' {
                c.to_ascii_lowercase()
            } else {
                '-'
            }
        })
        .collect();
    let cleaned = cleaned.trim_matches('-');
    let near = if cleaned.starts_with(|c: char| c.is_ascii_alphabetic()) && cleaned != name {
        cleaned.to_owned()
    } else {
        format!("my-{cleaned}")
    };
    Err(Error::request(format!(
        "`{name}` cannot be the name of a crate, expected a letter and then letters, digits, - or _; \
         `{near}` would do"
    )))
}

/// What to build with: the checkout that was named, the one that this command came from, or what is published.
fn source(named: Option<&Path>) -> Result<Source> {
    let path = match named {
        Some(path) => path.to_owned(),
        None => Path::new(BUILT_FROM).join(".."),
    };
    match (checkout(&path), named) {
        (Ok(checkout), _) => Ok(Source::Checkout(checkout)),
        (Err(_), None) => Ok(Source::Published),
        (Err(why), Some(path)) => Err(Error::request(format!(
            "{} is no checkout of loopsight: {why}",
            path.display()
        ))),
    }
}

/// The full path of a checkout, or what it lacks.
fn checkout(path: &Path) -> std::result::Result<PathBuf, String> {
    let lacking = [
        "core/Cargo.toml",
        "model/Cargo.toml",
        "loopsight/Cargo.toml",
        "Cargo.lock",
    ]
    .into_iter()
    .find(|file| !path.join(file).is_file());
    match lacking {
        None => path.canonicalize().map_err(|e| e.to_string()),
        Some(file) => Err(format!("there is no {}", path.join(file).display())),
    }
}

fn manifest(name: &str, source: &Source) -> String {
    format!(
        r#"[package]
name = "{name}"
version = "0.1.0"
edition = "2024"
publish = false

[dependencies]
# What the equations are written with.
loopsight-core = {}
# What makes them known to files and commands: the registry.
loopsight-model = {}
# The command `loopsight` with all that ships, for the parts of this crate to join.
loopsight = {}

# Not a member of a workspace that the folder may lie in.
[workspace]

# Numerics in an unoptimised build crawl.
[profile.dev]
opt-level = 2
debug = "line-tables-only"
"#,
        source.dependency("core"),
        source.dependency("model"),
        source.dependency("loopsight")
    )
}

fn readme(name: &str) -> String {
    format!(
        "# {name}\n\n\
         The command `loopsight` with a plant and an effect of its own.\n\n\
         | file | what |\n|---|---|\n\
         | `src/ship_heading.rs` | the plant: a ship that is steered with its rudder |\n\
         | `src/norrbin_damping.rs` | the effect: damping of the hull with the cube of the yaw rate |\n\
         | `src/main.rs` | names both, and runs the command |\n\
         | `ship.toml` | the ship as it is, with the effect |\n\
         | `model.toml` | the model of it, without the effect |\n\
         | `zigzag.toml`, `turns.toml` | what the ship is driven with |\n\n\
         The next three commands, in this folder; the first one builds for some minutes:\n\n\
         ```sh\n{}\n```\n\n\
         The last one says which physics the model lacks: an effect that no other crate knows. Add it, and\n\
         the error falls to the noise of the sensors:\n\n\
         ```sh\ncargo run -- improve model.toml turns.csv -o better.toml\n```\n\n\
         Now make it yours: rename a file, the struct in it, its `mod` line in `src/main.rs` and the `id`\n\
         in `META` and in the last macro; write your own equation in `derivative` or `contribution`, and\n\
         say in `META` what it is made of. `cargo test` runs the tests that lie beside the equations. The\n\
         pages `docs/add-a-plant.md` and `docs/add-an-effect.md` of loopsight go through both files.\n",
        COMMANDS.join("\n")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_checkout_the_published_version_is_taken() {
        let text = manifest("ship", &Source::Published);
        let read: toml::Table = text.parse().unwrap();
        let version = read["dependencies"]["loopsight-model"].as_str();
        assert_eq!(version, Some(env!("CARGO_PKG_VERSION")));
    }

    #[test]
    fn names_that_cargo_refuses_are_refused_with_one_that_it_takes() {
        for right in ["ship", "my-crate", "a_1"] {
            assert!(check_name(right).is_ok(), "{right}");
        }
        for wrong in ["1st", "my crate", "core", "größe", "-"] {
            assert!(check_name(wrong).is_err(), "{wrong}");
        }
    }
}
