//! Command lines.

use std::ffi::OsStr;

use super::Desk;

#[test]
fn requests_that_make_no_sense() {
    let desk = Desk::new();
    for (arguments, words) in [
        (&["compare", "model.toml"][..], &["model.toml", "log"][..]),
        (&["compare", "log.csv"], &["model file"]),
        (&["fit", "log.csv"], &["model file"]),
        (&["compare"], &["required"]),
        (
            &["compare", "model.toml", "log.csv", "log.csv"],
            &["log.csv"],
        ),
        (
            &["compare", "log.csv", "model.toml"],
            &["log.csv is a log", "the model file comes first"],
        ),
        (
            &["compare", "log.csv", "log.csv"],
            &["log.csv is a log", "--also log.csv"],
        ),
        (&["compare", "model.toml", "model.toml"], &["model.toml"]),
        (
            &["compare", "model.toml", "log.csv", "--jsn"],
            &["--jsn", "--json"],
        ),
        (&["compre", "model.toml", "log.csv"], &["compre", "compare"]),
        (
            &["fit", "model.toml", "log.csv", "--method", "lsr"],
            &["lsr", "rls"],
        ),
        (
            &["simulate", "model.toml", "experiment.toml"],
            &["--output"],
        ),
        (&["run", "model.toml"], &["model.toml:"]),
        (&["run", "experiment.toml"], &["experiment.toml:"]),
        (&["check"], &["required"]),
        (&["explain", "ddrm"], &["did you mean `ddmr`?"]),
        (&["explain", "qqqq"], &["coulomb_friction"]),
        (&["explain", ""], &["known"]),
        (&["list", "plant"], &["plants"]),
        (&["completions", "tcsh"], &["bash"]),
        (&[], &["Usage"]),
    ] {
        desk.refused_saying(arguments, words);
    }
}

#[test]
#[cfg(unix)]
fn arguments_that_are_no_text() {
    use std::os::unix::ffi::OsStrExt as _;
    let desk = Desk::new();
    let odd = OsStr::from_bytes(b"\xff\xfe");
    for arguments in [
        &[odd][..],
        &[OsStr::new("explain"), odd],
        &[OsStr::new("check"), odd],
        &[OsStr::new("run"), odd],
        &[OsStr::new("compare"), OsStr::new("model.toml"), odd],
    ] {
        desk.refused_words(arguments);
    }
    // A file may well have such a name.
    std::fs::copy(desk.path("log.csv"), desk.0.path().join(odd)).unwrap();
    let words = [OsStr::new("compare"), OsStr::new("model.toml"), odd];
    let output = desk.output(&words);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{text}");
    // So may the page that the command line is printed on.
    let words = [&words[..], &[OsStr::new("--html"), OsStr::new("page.html")]].concat();
    assert_eq!(desk.output(&words).status.code(), Some(0));
}
