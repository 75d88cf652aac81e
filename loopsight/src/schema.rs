//! The contracts of the answers, as JSON Schemas (draft 2020-12).

use schemars::{JsonSchema, SchemaGenerator, generate::SchemaSettings};
use serde_json::Value;

use crate::answers;
use crate::answers::Answer;

/// The schema of every command's answer, by the command's name: what is published under `docs/schema/`.
pub fn all() -> Vec<(&'static str, Value)> {
    vec![
        of::<answers::AddAnswer>(),
        of::<answers::CheckAnswer>(),
        of::<answers::InspectAnswer>(),
        of::<answers::CompareAnswer>(),
        of::<answers::ConvertAnswer>(),
        of::<answers::DiagnoseAnswer>(),
        of::<answers::ExperimentAnswer>(),
        of::<answers::ExplainAnswer>(),
        of::<answers::FitAnswer>(),
        of::<answers::ImproveAnswer>(),
        of::<answers::ListAnswer>(),
        of::<answers::RunAnswer>(),
        #[cfg(feature = "serial")]
        of::<answers::SendAnswer>(),
        of::<answers::SimulateAnswer>(),
    ]
}

fn of<A: Answer + JsonSchema>() -> (&'static str, Value) {
    // What is written is what the schema is of: a key that may be left out is not required.
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let schema = SchemaGenerator::new(settings).into_root_schema_for::<A>();
    // `loopsight/diagnose/1`
    let command = A::SCHEMA.split('/').nth(1).unwrap_or(A::SCHEMA);
    let mut all = schema.to_value();
    // What it is stands before what it says.
    let mut sorted = serde_json::Map::new();
    if let Some(words) = all.as_object_mut() {
        for word in ["$schema", "title", "description"] {
            sorted.extend(words.shift_remove_entry(word));
        }
        sorted.append(words);
    }
    (command, sorted.into())
}
