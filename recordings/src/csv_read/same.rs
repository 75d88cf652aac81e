//! The quick way through a table reads what the general reader does.

use proptest::prelude::*;

use super::*;

/// What the general reader alone makes of a text.
fn general(text: &str) -> Result<Table, RecordingError> {
    let spaced = dialect::tabs_for_spaces(text);
    let mut rows = Rows::new("l.csv", delimiter(&spaced));
    rows.general(&spaced, false)?;
    rows.table()
}

/// The quick way and the general reader have the same values to the last bit, lines and messages.
fn same(text: &str) -> Result<bool, TestCaseError> {
    let (quick, slow) = (parse_csv(text, "l.csv"), general(text));
    let bits = |table: &Table| -> Vec<u64> {
        let values = table.runs.iter().flat_map(|run| &run.rows);
        // Any NaN is a missing value.
        values
            .map(|v| if v.is_nan() { u64::MAX } else { v.to_bits() })
            .collect()
    };
    match (&quick, &slow) {
        (Ok(a), Ok(b)) => {
            prop_assert_eq!(bits(a), bits(b), "{}", text);
            let about = |table: &Table| {
                let mut about = table.clone();
                about.runs.iter_mut().for_each(|run| run.rows = Vec::new());
                about
            };
            prop_assert_eq!(about(a), about(b), "{}", text);
        }
        (Err(a), Err(b)) => prop_assert_eq!(a.to_string(), b.to_string(), "{}", text),
        _ => prop_assert!(false, "{text}\n{quick:?}\n{slow:?}"),
    }
    let mut rows = Rows::new("l.csv", delimiter(text));
    let to = rows.general(text, true);
    Ok(to.is_ok_and(|to| to < text.len() && rows.quick(text, to).is_ok()))
}

#[test]
fn a_table_of_numbers_is_read_quickly() {
    for text in [
        "t_s,u_V\n0,1\n0.5,-2.25e-3\n# pause\n\n1,nan\n",
        "t_s;u_V\r\n0,5;1,25\r\n1,0;;\r\n",
        "t_s\tu_V\n0\t1\n 1 \t +.5",
        "t_s,mode,u_V\n0,auto,1\n1,by hand,2\n",
        "when,u\n2024-05-01T12:00:00Z,1\n2024-05-01T12:00:01Z,2\n",
    ] {
        assert!(same(text).unwrap(), "{text}");
    }
    for text in [
        "t_s,u_V\n0,1\n\"1\",2\n",
        "t_s,u_V\n0,1\r1,2\r",
        "t_s,u_V\n0,1\n1\n",
        "t_s\n0\n \n1\n",
        "t_s,u_V\n0,1\n1,x\n",
    ] {
        assert!(!same(text).unwrap(), "{text}");
    }
}

/// Rows of some text more than one core reads at a time, with what may stand between them.
#[test]
fn a_long_table_is_read_in_pieces() {
    let mut text = String::from("t_s,u_V\n");
    for k in 0..400_000 {
        text.push_str(&format!(
            "{},{}\n",
            f64::from(k) / 1000.0,
            f64::from(k % 977) / 7.0
        ));
        if k % 90_001 == 17 {
            text.push_str("# a pause\n\n");
        }
    }
    assert!(text.len() > 4 << 20);
    assert!(same(&text).unwrap());
    let wrong = text.replace("350.5,", "350.5;");
    assert!(!same(&wrong).unwrap());
}

/// Numbers as any program may write them.
fn number() -> impl Strategy<Value = String> {
    prop_oneof![
        any::<f64>().prop_map(|v| format!("{v:?}")),
        any::<f64>().prop_map(|v| format!("{v:e}")),
        (-1e4..1e4).prop_map(|v: f64| format!("{v:.4}")),
        (-1e4..1e4).prop_map(|v: f64| format!("{v:.18e}")),
        "[+-]?[0-9]{0,22}[.,]?[0-9]{0,22}([eE][+-]?[0-9]{0,5})?",
        Just(String::new()),
        "(nan|NaN|-inf|NA|null| 1|2 |x|\"3\"|1\u{a0}|\r|#)",
    ]
}

proptest! {
    #[test]
    fn the_quick_way_reads_what_the_general_reader_does(
        rows in prop::collection::vec(prop::collection::vec(number(), 3), 1..12),
        (separator, end) in (prop::sample::select(vec![",", ";", "\t", " "]), prop::sample::select(vec!["\n", "\r\n", "\r"])),
        odd in prop::collection::vec("(#.{0,5}|| |,|1|1,2,3,|a,b,c|\"1\",2,3)", 0..3),
        plain in any::<bool>(),
    ) {
        let mut lines = vec![["t_s", "u_V", "mode"].join(separator)];
        if plain {
            lines.push(["0", "1", "2"].join(separator));
        }
        lines.extend(rows.iter().map(|row| row.join(separator)));
        for (k, odd) in odd.into_iter().enumerate() {
            lines.insert((3 * k + 2).min(lines.len()), odd);
        }
        same(&lines.join(end))?;
        same(&(lines.join(end) + end))?;
    }

    #[test]
    fn so_it_is_near_the_rules(text in "[t_s,V;\"#\n\r0-9.e-]{0,200}") {
        same(&text)?;
    }
}
