//! What is known before a diagnosis ends, in a line.

use loopsight_diagnosis::{Early, Finding};

use super::number::percent;
use super::place::place_in_brackets;

/// What was found, in a line: `most promising: coulomb_friction (mass) 3.4 %, wheel_slip (…) 7 %`.
pub fn line(early: &Early) -> String {
    match &early.finding {
        Finding::Compared { nrmse, floor } => {
            let noise = match floor.is_finite() {
                true => format!(", of which noise is {}", percent(*floor)),
                false => String::new(),
            };
            format!("without more the model leaves {}{noise}", percent(*nrmse))
        }
        Finding::Promised { candidates } => {
            let said = candidates.iter().map(|candidate| {
                let place = place_in_brackets(&candidate.place);
                format!("{place} {}", percent(candidate.nrmse))
            });
            format!("most promising: {}", said.collect::<Vec<_>>().join(", "))
        }
        Finding::Finalist(found) => {
            let place = place_in_brackets(&found.place);
            format!("with {place} it leaves {}", percent(found.nrmse))
        }
        Finding::Added(found) => {
            let place = place_in_brackets(&found.place);
            format!("added {place}: {} left", percent(found.nrmse))
        }
        _ => String::new(),
    }
}
