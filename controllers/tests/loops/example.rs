//! `examples/twil-adaptive`: the table of its page is what its files give.

use std::path::PathBuf;

use super::*;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../examples/twil-adaptive")
}

fn read(name: &str) -> String {
    std::fs::read_to_string(folder().join(name)).unwrap()
}

/// Root mean squares of the errors over the whole of a loop, and over its last half.
fn errors(name: &str) -> [[f64; 2]; 2] {
    let text = read(name);
    let source = TomlSource::parse(name, &text).unwrap();
    let file = LoopFile::parse(&source).unwrap();
    let ticks = (file.duration_s.unwrap() / file.period_s).round() as usize;
    let believed = model(&read(&file.model));
    let trace = run(&text, &believed, &model(&read("robot.toml")), ticks);
    [0, ticks / 2].map(|from| [0, 1].map(|i| trace.rms(i, from)))
}

#[test]
fn the_table_is_what_the_files_give() {
    let page = read("README.md");
    let rows = ["before", "after", "pid", "mrac", "adaptive"].map(|name| {
        let file = format!("{name}.toml");
        let [whole, half] = errors(&file);
        let [v, omega] = if name == "adaptive" { half } else { whole };
        let row = format!("{:.2} mm/s | {:.1} mrad/s", 1e3 * v, 1e3 * omega);
        println!("{file}: {row}");
        let found = page.lines().find(|l| l.starts_with(&format!("| `{file}`")));
        assert!(found.unwrap().contains(&row), "{file}: {row}");
        [v, omega]
    });
    let [before, after, pid, mrac, adaptive] = rows;
    for i in 0..2 {
        assert!(after[i] < 0.5 * before[i]);
        assert!(after[i] < pid[i].min(mrac[i]) && adaptive[i] < pid[i].min(mrac[i]));
    }
}

/// Where the robot really is, against where the path is, over the second lap: rms, m.
#[test]
fn the_eight_is_as_close_as_its_page_says() {
    let positions = "[log.measured.position_x]\nsensor = \"instantaneous\"\n\
                     [log.measured.position_y]\nsensor = \"instantaneous\"\n";
    let text = read("eight.toml");
    let path = loopsight_controllers::Path::FigureEight {
        length_m: 1.6,
        width_m: 0.8,
        lap_s: 40.0,
    };
    let off = |believed: &str| {
        let [believed, robot] =
            [believed, "robot.toml"].map(|name| model(&format!("{}\n{positions}", read(name))));
        let trace = run(&text, &believed, &robot, 8000);
        let squares = trace.measured.iter().enumerate().skip(4000).map(|(k, y)| {
            let goal = path.at(0.01 * k as f64, 1.0).position;
            (y[2] - goal[0]).powi(2) + (y[3] + 0.1 - goal[1]).powi(2)
        });
        (squares.sum::<f64>() / 4000.0).sqrt()
    };
    let (before, after) = (off("nominal.toml"), off("improved.toml"));
    let said = format!(
        "{:.1} mm with `improved.toml`, {:.1} mm with `nominal.toml`",
        1e3 * after,
        1e3 * before
    );
    println!("{said}");
    assert!(
        read("README.md").replace('\n', " ").contains(&said),
        "{said}"
    );
    assert!(after < before);
}
