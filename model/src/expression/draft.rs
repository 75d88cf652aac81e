//! An effect as an expression, written as TOML.

use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, Value};

/// A parameter of an [`EffectDraft`].
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterDraft {
    /// Name in the expression.
    pub id: String,
    /// Its value; `None` where a fit has to find it.
    pub value: Option<f64>,
    /// SI unit, e.g. `V` or `rad/s`; `1` for a plain number.
    pub unit: String,
    /// Least and greatest admissible value; infinite where there is none.
    pub range: Option<[f64; 2]>,
    /// A fit leaves it as it is.
    pub held: bool,
    /// One sentence; may be empty.
    pub doc: String,
}

/// An effect as an expression, to be written into a model file: a starting point where the
/// library has nothing that fits.
///
/// ```
/// use loopsight_model::expression::{EffectDraft, ParameterDraft};
///
/// let draft = EffectDraft {
///     name: "my_friction".to_owned(),
///     at: vec!["shaft".to_owned()],
///     force: "-c * tanh(flow / s)".to_owned(),
///     summary: "friction".to_owned(),
///     parameters: vec![
///         ParameterDraft {
///             id: "c".to_owned(),
///             value: Some(0.5),
///             unit: "V".to_owned(),
///             range: Some([0.0, 12.0]),
///             held: false,
///             doc: "size of the friction".to_owned(),
///         },
///         ParameterDraft {
///             id: "s".to_owned(),
///             value: Some(0.05),
///             unit: "rad/s".to_owned(),
///             range: None,
///             held: true,
///             doc: String::new(),
///         },
///     ],
/// };
/// assert_eq!(
///     draft.to_toml(),
///     r#"[[effect]]
/// [effect.expression]
/// name = "my_friction"
/// summary = "friction"
/// at = ["shaft"]
/// force = "-c * tanh(flow / s)"
///
/// [effect.expression.parameters]
/// c = { value = 0.5, unit = "V", range = [0.0, 12.0], doc = "size of the friction" }
/// s = { value = 0.05, unit = "rad/s", held = true }
/// "#
/// );
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EffectDraft {
    /// Its name in reports, and of its parameters; may be empty.
    pub name: String,
    /// The channels it acts on.
    pub at: Vec<String>,
    /// What is added there, in the channel's unit. Names: the roles of the channel (`flow`,
    /// `position`, `drive`, …), signals of the plant, `nominal`, `side`, `time` and the parameters.
    pub force: String,
    /// One sentence; may be empty.
    pub summary: String,
    /// The parameters of the expression.
    pub parameters: Vec<ParameterDraft>,
}

impl EffectDraft {
    /// The `[[effect]]` entry, ready to be put at the end of a model file.
    pub fn to_toml(&self) -> String {
        let mut part = Table::new();
        // Right below `[[effect]]`, as the other entries of the examples stand.
        part.decor_mut().set_prefix("");
        if !self.name.is_empty() {
            part.insert("name", toml_edit::value(&self.name));
        }
        if !self.summary.is_empty() {
            part.insert("summary", toml_edit::value(&self.summary));
        }
        let at: Array = self.at.iter().collect();
        part.insert("at", toml_edit::value(at));
        part.insert("force", toml_edit::value(&self.force));
        let mut parameters = Table::new();
        for parameter in &self.parameters {
            parameters.insert(&parameter.id, Item::Value(parameter.table().into()));
        }
        if !parameters.is_empty() {
            part.insert("parameters", Item::Table(parameters));
        }
        let mut entry = Table::new();
        entry.insert("expression", Item::Table(part));
        let mut effects = toml_edit::ArrayOfTables::new();
        effects.push(entry);
        let mut document = DocumentMut::new();
        document.insert("effect", Item::ArrayOfTables(effects));
        document.to_string()
    }
}

impl ParameterDraft {
    fn table(&self) -> InlineTable {
        let mut table = InlineTable::new();
        if let Some(value) = self.value {
            table.insert("value", value.into());
        }
        table.insert("unit", Value::from(&self.unit));
        if let Some(range) = self.range {
            table.insert("range", range.into_iter().collect::<Array>().into());
        }
        if self.held {
            table.insert("held", true.into());
        }
        if !self.doc.is_empty() {
            table.insert("doc", Value::from(&self.doc));
        }
        table
    }
}
