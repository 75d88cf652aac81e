//! Parameter values as a file gives them.

use loopsight_core::Parameter;
use serde::ser::SerializeMap;

/// Parameter values as a file gives them, in the order of the declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// 0: the equations' own parameters; `i`: the `i`-th other parameterization.
    pub set: usize,
    /// One per parameter of that set; `None` where the file is silent.
    pub given: Vec<Option<f64>>,
}

impl Values {
    pub(crate) fn empty(set: usize, parameters: &[Parameter]) -> Self {
        Self {
            set,
            given: vec![None; parameters.len()],
        }
    }

    pub(crate) fn serialize_into<M: SerializeMap>(
        &self,
        map: &mut M,
        parameters: &[Parameter],
    ) -> Result<(), M::Error> {
        for (parameter, value) in parameters.iter().zip(&self.given) {
            if let Some(value) = value {
                map.serialize_entry(parameter.id, value)?;
            }
        }
        Ok(())
    }
}

/// The range of a parameter in words, e.g. `a number above 0 kg`; a plain number has no unit.
pub fn range_text(parameter: &Parameter) -> String {
    let Parameter { min, max, open, .. } = *parameter;
    let unit = match parameter.unit {
        "1" | "" => String::new(),
        unit => format!(" {unit}"),
    };
    match (min.is_finite(), max.is_finite(), open) {
        (false, false, _) => "a finite number".to_owned(),
        (true, false, true) => format!("a number above {min}{unit}"),
        (true, false, false) => format!("a number from {min}{unit} upwards"),
        (false, true, true) => format!("a number below {max}{unit}"),
        (false, true, false) => format!("a number up to {max}{unit}"),
        (true, true, _) => format!("a number from {min} to {max}{unit}"),
    }
}
