use super::*;

/// What is in a folder, in order.
pub(super) fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn a_file_is_written_whole_and_says_what_it_replaces() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("page.html");
    let first = save(&path, b"old").unwrap();
    assert_eq!(first.to_string(), format!("wrote {}", path.display()));
    let second = save(&path, b"new").unwrap();
    assert!(
        second
            .to_string()
            .ends_with("in place of the file that was there"),
        "{second}"
    );
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
    // One that is given up leaves nothing.
    let mut given_up = OutputFile::create(&path).unwrap();
    given_up.write_all(b"half").unwrap();
    drop(given_up);
    check(&path).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(names(folder.path()), ["page.html"]);
}

#[test]
fn an_input_is_no_output() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("log.csv");
    std::fs::write(&file, "time_s\n").unwrap();
    let again = folder.path().join(".").join("log.csv");
    let error = apart(&again, [file.as_path()]).unwrap_err();
    assert!(
        error.to_string().contains("which this command reads"),
        "{error}"
    );
    assert!(error.is_request());
    apart(&folder.path().join("other.csv"), [file.as_path()]).unwrap();
    let hard = folder.path().join("hard.csv");
    std::fs::hard_link(&file, &hard).unwrap();
    if cfg!(unix) {
        apart(&hard, [file.as_path()]).unwrap_err();
    }
}

#[test]
fn two_outputs_have_two_places() {
    let folder = tempfile::tempdir().unwrap();
    let one = folder.path().join("a.html");
    let again = folder.path().join(".").join("a.html");
    let error = distinct([one.as_path(), &again]).unwrap_err();
    assert!(error.to_string().contains("another output"), "{error}");
    assert!(error.is_request());
    distinct([one.as_path(), &folder.path().join("b.html")]).unwrap();
}

#[test]
fn places_that_are_none() {
    let folder = tempfile::tempdir().unwrap();
    for (path, why) in [
        (folder.path().to_owned(), "directory"),
        (folder.path().join("no/page.html"), "there is no directory"),
        (PathBuf::new(), "expected the name of a file"),
        (folder.path().join(".."), "directory"),
    ] {
        for error in [
            check(&path).unwrap_err(),
            save(&path, b"x").unwrap_err(),
            Growing::create(&path).map(|_| ()).unwrap_err(),
        ] {
            assert!(error.to_string().contains(why), "{error}");
            assert!(error.is_request(), "{error}");
        }
    }
    assert!(names(folder.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn links_and_sockets_stay() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("a.csv"), folder.path().join("b.csv"));
    std::fs::write(&file, "old").unwrap();
    symlink(&file, &link).unwrap();
    for error in [
        save(&link, b"new").unwrap_err(),
        Growing::create(&link).map(|_| ()).unwrap_err(),
    ] {
        assert!(error.to_string().contains("symbolic link"), "{error}");
    }
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "old");
    assert!(link.is_symlink());
    let socket = folder.path().join("socket");
    let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
    let error = save(&socket, b"new").unwrap_err().to_string();
    assert!(error.contains("a socket"), "{error}");
    // A link that comes into the place while the file grows stays as well.
    let (growing, mut out) = Growing::create(&folder.path().join("log.csv")).unwrap();
    out.write_all(b"time_s\n").unwrap();
    let part = growing.part().to_owned();
    symlink(&file, growing.target()).unwrap();
    let error = growing.finish().unwrap_err().to_string();
    assert!(error.contains("symbolic link"), "{error}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "old");
    assert_eq!(std::fs::read_to_string(part).unwrap(), "time_s\n");
}

#[cfg(unix)]
#[test]
fn a_folder_behind_a_link_is_said() {
    use std::os::unix::fs::symlink;
    let desk = tempfile::tempdir().unwrap();
    let (here, away) = (desk.path().join("here"), desk.path().join("away"));
    std::fs::create_dir(&here).unwrap();
    std::fs::create_dir_all(away.join("deep")).unwrap();
    symlink(&away, here.join("out")).unwrap();
    let really = away.canonicalize().unwrap();
    for (name, lies) in [
        ("out/page.html", really.join("page.html")),
        ("out/deep/page.html", really.join("deep/page.html")),
    ] {
        let path = here.join(name);
        let written = save(&path, b"x").unwrap();
        assert_eq!(written.really.as_deref(), Some(lies.as_path()));
        let said = written.to_string();
        assert!(said.contains("through a link: it lies at"), "{said}");
        let (growing, _) = Growing::create(&path).unwrap();
        let written = growing.finish().unwrap();
        assert_eq!(written.really.as_deref(), Some(lies.as_path()));
        assert!(written.replaced);
    }
    let plain = here.canonicalize().unwrap().join("page.html");
    assert_eq!(save(&plain, b"x").unwrap().really, None);
}

#[cfg(unix)]
#[test]
fn who_may_read_a_file_stays() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    std::fs::write(&path, "old").unwrap();
    std::fs::set_permissions(&path, Permissions::from_mode(0o640)).unwrap();
    save(&path, b"new").unwrap();
    let mode = std::fs::metadata(&path).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
}

#[test]
fn a_folder_is_there_whole_or_not_at_all() {
    let desk = tempfile::tempdir().unwrap();
    let target = desk.path().join("robot");
    let mut folder = NewFolder::create(&target).unwrap();
    folder.write("src/a.rs", "// a\n").unwrap();
    assert!(!target.exists());
    let written = folder.finish().unwrap();
    assert_eq!(written.len(), 1);
    assert!(!written[0].replaced);
    assert_eq!(
        std::fs::read_to_string(target.join("src/a.rs")).unwrap(),
        "// a\n"
    );
    assert!(NewFolder::create(&target).is_err());
    drop(NewFolder::create(&desk.path().join("other")).unwrap());
    // One that another program makes meanwhile is not written into.
    let late = NewFolder::create(&desk.path().join("late")).unwrap();
    std::fs::create_dir(desk.path().join("late")).unwrap();
    assert!(late.finish().is_err());
    assert_eq!(names(desk.path()).len(), 2);
}
