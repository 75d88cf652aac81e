//! The firmware on an emulated Cortex-M4 beside the same code on this machine, digit for digit.
//!
//! Needs `qemu-system-arm` and the firmware, built as its README says and named by `LOOPSIGHT_FIRMWARE`:
//! `cargo test -p loopsight-onboard --test lockstep -- --ignored --nocapture`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod board;
mod twil;

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use board::{Board, INSTRUCTIONS_PER_COUNT, firmware, machine};
use loopsight_link::*;
use twil::*;

const SESSION: u32 = 0xb0a2d;
const TICKS: u32 = 10_000;

/// A configuration for two that wait for each other: nobody looks at a clock.
fn patient(mut configuration: Configuration) -> Configuration {
    configuration.safety.watchdog_ticks = u16::MAX;
    configuration
}

/// Both greeted and configured.
fn begin(board: &mut Board, twin: &mut Line, configuration: Configuration) {
    let configuration = patient(configuration);
    for request in [hello(SESSION), configure(SESSION, configuration)] {
        let expected = twin.send(&request);
        assert_eq!([board.ask(&request)], expected[..]);
    }
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}

/// Drives both for `ticks`; what the firmware's ticks cost.
fn drive(board: &mut Board, twin: &mut Line, ticks: u32) -> (u32, Vec<u32>) {
    let mut body = Body::default();
    let (mut measured, mut costs) = ([0.0; 2], Vec::new());
    let (mut learned, mut saturated) = (0, 0);
    for tick in 0..ticks {
        let request = Request::Step(step(SESSION, tick, measured));
        let said = twin.send(&request);
        let ([Reply::Act(desk)], Reply::Act(act)) = (&said[..], board.ask(&request)) else {
            panic!("tick {tick}: {said:?}")
        };
        assert_eq!(bits(&act.command), bits(&desk.command), "tick {tick}");
        assert_eq!(bits(&act.parameters), bits(&desk.parameters), "tick {tick}");
        let outcome = |a: &Act| (a.tick, a.saturated, a.held, a.learned);
        assert_eq!(outcome(&act), outcome(desk), "tick {tick}");
        learned += act.learned.count_ones();
        saturated += u32::from(act.saturated);
        costs.push(act.cost);
        measured = body.drive(&act.command);
    }
    println!("{ticks} ticks, {learned} lessons, {saturated} saturated");
    // The first two say what the ticks before them cost, of which the first learns nothing.
    costs.drain(..2);
    (learned, costs)
}

fn instructions(counts: u32) -> f64 {
    f64::from(counts) * INSTRUCTIONS_PER_COUNT
}

fn told(name: &str, mut costs: Vec<u32>) -> f64 {
    costs.sort_unstable();
    let at = |share: f64| instructions(costs[((costs.len() - 1) as f64 * share) as usize]);
    println!(
        "instructions per tick, {name}: median {:.0}, 99 % {:.0}, most {:.0}",
        at(0.5),
        at(0.99),
        at(1.0)
    );
    at(0.5)
}

/// A count is at most a tenth more than what `tests/counts.toml` has of it.
fn no_more(name: &str, now: f64) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/counts.toml");
    let table: toml::Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
    let before = table["aboard"][name].as_integer().unwrap() as f64;
    assert!(
        now <= 1.1 * before,
        "{name}: {now:.0}, {before} in the table"
    );
}

#[test]
#[ignore = "needs qemu-system-arm and the firmware, named by LOOPSIGHT_FIRMWARE"]
fn the_firmware_does_what_the_desk_does() {
    let mut board = Board::start();
    let mut twin = Line::default();
    begin(&mut board, &mut twin, configuration());
    let (learned, costs) = drive(&mut board, &mut twin, TICKS);
    assert!(learned > TICKS, "{learned} lessons of two regressions");
    no_more("tick", told("all", costs));
    let stack = board.stack();
    println!("stack: {stack} bytes at most");
    // With what is static it must fit the 128 KiB of a board that people own, and leave room.
    assert!(stack < 64 << 10, "{stack}");
}

/// What each part of a tick costs: the same loop without it.
#[test]
#[ignore = "needs qemu-system-arm and the firmware, named by LOOPSIGHT_FIRMWARE"]
fn what_a_tick_costs() {
    type Leave = fn(&mut Configuration);
    let cases: [(&str, Leave); 3] = [
        ("all", |_| {}),
        ("no friction", |c| c.effects.clear()),
        ("no friction, no learning", |c| {
            c.effects.clear();
            c.learning = None;
        }),
    ];
    for (name, leave) in cases {
        let mut configuration = configuration();
        leave(&mut configuration);
        let mut board = Board::start();
        let mut twin = Line::default();
        begin(&mut board, &mut twin, configuration);
        told(name, drive(&mut board, &mut twin, 1000).1);
    }
}

/// What the parts cost by themselves, without what guards and connects them: the firmware's `parts`.
#[test]
#[ignore = "needs qemu-system-arm and the firmware, named by LOOPSIGHT_FIRMWARE"]
fn what_the_parts_cost() {
    let parts = firmware("LOOPSIGHT_FIRMWARE").with_file_name("parts");
    let mut board = machine(&parts, "stdio")
        .args(["-monitor", "none"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let said = BufReader::new(board.stdout.take().unwrap());
    let lines = said.lines().map(|line| line.unwrap());
    let lines: Vec<String> = lines.take_while(|line| line != "end").collect();
    board.kill().unwrap();
    board.wait().unwrap();
    let costs: Vec<f64> = (lines.iter())
        .map(|line| {
            let (name, cost) = line.split_once(": ").unwrap();
            let (counts, samples) = cost.split_once(" in ").unwrap();
            let [counts, samples]: [f64; 2] = [counts, samples].map(|n| n.parse().unwrap());
            let mean = counts / samples * INSTRUCTIONS_PER_COUNT;
            assert!(mean > 0.0, "{line}");
            println!("instructions, {name}: {mean:.0}");
            mean
        })
        .collect();
    let [learning, _, control] = costs[..] else {
        panic!("{lines:?}")
    };
    let list = learning + control;
    println!("instructions, the bare list: {list:.0}");
    no_more("bare_list", list);
}
