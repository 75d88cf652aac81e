//! What was applied before a recording began.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use loopsight_model::model::Model;
use loopsight_model::simulate::Simulator;
use loopsight_plants as _;

/// Where a spring of 2 N/m is after 10 ms under 2 N that come 0.1 s late, and late by a lag of 0.1 s,
/// from a position at rest; and where it is after 10 ms without any force, and under it all the time.
fn after(position: f64) -> ([f64; 2], f64, f64) {
    let moved = |effect: &str, input: f64| {
        let text = format!(
            "[plant.oscillator.physical]\nmass = 1.0\ndamping = 0.5\nstiffness = 2.0\n\
             [log.measured.position]\nsensor = \"instantaneous\"\n{effect}\n"
        );
        let (model, _) = Model::from_toml("m.toml", &text).unwrap();
        let mut simulator = Simulator::new(&model, &model.values());
        simulator.reset(&[0.0, position], &[input]);
        simulator.advance(0.01, &[input]);
        simulator.state()[1]
    };
    let effect = |id: &str, value: &str| {
        format!("[[effect]]\n[effect.{id}]\nat = [\"input\"]\n{value} = 0.1")
    };
    let late = [("input_delay", "delay"), ("actuator_lag", "lag")];
    (
        late.map(|(id, value)| moved(&effect(id, value), 2.0)),
        moved("", 0.0),
        moved("", 2.0),
    )
}

#[test]
fn a_machine_was_under_what_keeps_it_where_it_is() {
    // In the middle of its spring: nothing had been applied, and nothing has arrived.
    let ([delayed, lagged], free, pushed) = after(0.0);
    assert_eq!(free, 0.0);
    assert_eq!(delayed, 0.0);
    assert!(lagged > 0.0 && lagged < 0.1 * pushed, "{lagged} {pushed}");
    // Held against the spring: it always was.
    let ([delayed, lagged], free, pushed) = after(1.0);
    assert_eq!(pushed, 1.0);
    assert_eq!([delayed, lagged], [1.0, 1.0]);
    assert!(free < 1.0);
}
