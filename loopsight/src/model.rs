//! A model: a plant with effects, sensors and parameter values, and the text that says so.

use std::path::Path;

use loopsight_core::PlantMeta;
use loopsight_model::config::{TomlSource, nearest, read_text};
use loopsight_model::model::{Model as Composed, ModelParameter};
use loopsight_model::registry;
use loopsight_recordings::output::Written;

use crate::error::{Error, Result};
use crate::files;

/// A plant with effects, sensors and parameter values, made from TOML.
///
/// ```
/// use loopsight::Model;
///
/// let text = "# my robot\n[plant.ddmr]\nhalf_track = 0.131   # measured with a ruler\nwheel_radius = 0.05\n";
/// let model = Model::from_toml("robot.toml", text)?;
/// assert_eq!(model.plant(), "ddmr");
/// let unknown: Vec<_> = model.parameters().filter(|p| p.value.is_none()).map(|p| p.name).collect();
/// assert_eq!(unknown, ["K_A", "K_B", "K_C", "K_D", "K_E", "K_F"]);
///
/// let model = model.with_value("K_A", -15.0)?;
/// assert!(model.to_toml().starts_with("# my robot\n") && model.to_toml().contains("K_A = -15.0"));
/// # Ok::<(), loopsight::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Model {
    pub(crate) composed: Composed,
    /// The name that stands for the file in error messages.
    pub(crate) file: String,
    text: String,
}

/// What a model says of one of its parameters.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ModelValue<'m> {
    /// Name within the model: `K_A`, `coulomb_friction.level`.
    pub name: &'m str,
    /// Symbol in the equations.
    pub symbol: &'static str,
    /// SI unit.
    pub unit: &'m str,
    /// One sentence.
    pub doc: &'static str,
    /// Its value; `None` where a fit has to find it.
    pub value: Option<f64>,
    /// Least and greatest admissible value.
    pub range: [f64; 2],
    /// A fit estimates it.
    pub estimated: bool,
}

impl<'m> From<&'m ModelParameter> for ModelValue<'m> {
    fn from(parameter: &'m ModelParameter) -> Self {
        Self {
            name: &parameter.name,
            symbol: parameter.declaration.symbol,
            unit: &parameter.unit,
            doc: parameter.declaration.doc,
            value: parameter.value,
            range: [parameter.declaration.min, parameter.declaration.max],
            estimated: parameter.free || parameter.per_run,
        }
    }
}

impl Model {
    /// Reads a model file.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or says something that cannot be: with line, column, and the nearest right
    /// thing.
    pub fn from_file(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::from_toml(&path.display().to_string(), &read_text(path)?)
    }

    /// Makes a model of a text; `name` stands for the file in messages and titles.
    ///
    /// # Errors
    ///
    /// As [`Model::from_file`].
    pub fn from_toml(name: &str, text: &str) -> Result<Self> {
        let (composed, _) = Composed::from_toml(name, text)?;
        Ok(Self {
            composed,
            file: name.to_owned(),
            text: text.to_owned(),
        })
    }

    /// The plain model of a plant, without values but for those that have a default.
    ///
    /// ```
    /// let axis = loopsight::Model::of_plant("dc_axis")?;
    /// let error = loopsight::Model::of_plant("dc_axes").unwrap_err();
    /// assert!(error.message().contains("did you mean `dc_axis`?"));
    /// # Ok::<(), loopsight::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// There is no such plant.
    pub fn of_plant(id: &str) -> Result<Self> {
        plant(id)?;
        Self::from_toml(&format!("the plant `{id}`"), &format!("[plant.{id}]\n"))
    }

    /// Name of the robot, for titles.
    pub fn name(&self) -> &str {
        &self.composed.name
    }

    /// The file, or the name under which the text was handed over.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Id of the plant.
    pub fn plant(&self) -> &'static str {
        self.composed.plant.id
    }

    /// The effects in the model, each with its channels.
    pub fn effects(&self) -> impl Iterator<Item = (&'static str, Vec<&'static str>)> {
        let effects = self.composed.effects.iter();
        effects.map(|e| (e.meta.id, e.at.iter().map(|channel| channel.id).collect()))
    }

    /// The parameters: those of the plant first, then those of the effects.
    pub fn parameters(&self) -> impl Iterator<Item = ModelValue<'_>> {
        self.composed.parameters.iter().map(ModelValue::from)
    }

    /// The value of a parameter; `None` where it has none, or is not there.
    pub fn value(&self, name: &str) -> Option<f64> {
        let mut parameters = self.composed.parameters.iter();
        parameters.find(|p| p.name == name)?.value
    }

    /// The same model with another value of one parameter.
    ///
    /// # Errors
    ///
    /// There is no such parameter, or the value is not in its range.
    pub fn with_value(&self, name: &str, value: f64) -> Result<Self> {
        let parameters = &self.composed.parameters;
        let Some(parameter) = parameters.iter().find(|p| p.name == name) else {
            let names = || parameters.iter().map(|p| p.name.as_str());
            let near = nearest(name, names())
                .map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
            return Err(Error::request(format!(
                "the model has no parameter `{name}`, expected one of {}{near}",
                names().collect::<Vec<_>>().join(", ")
            )));
        };
        if !parameter.declaration.admits(value) {
            return Err(Error::request(format!(
                "`{name}` is {value}, expected {}",
                registry::range_text(parameter.declaration)
            )));
        }
        let text = self
            .source()?
            .with_values(&[(parameter.path.clone(), value)]);
        Self::from_toml(&self.file, &text)
    }

    /// The model as TOML: the text it was made from, comments included, with its present values.
    pub fn to_toml(&self) -> &str {
        &self.text
    }

    /// Writes [`Model::to_toml`] to a file, whole or not at all.
    ///
    /// # Errors
    ///
    /// The file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<Written> {
        files::save(path.as_ref(), &self.text)
    }

    /// The text with the places of its keys.
    pub(crate) fn source(&self) -> Result<TomlSource> {
        Ok(TomlSource::parse(&self.file, &self.text)?)
    }
}

/// The plant of this id.
pub(crate) fn plant(id: &str) -> Result<&'static PlantMeta> {
    let plants = registry::plants();
    if let Some(meta) = plants.iter().find(|meta| meta.id == id) {
        return Ok(meta);
    }
    let ids = || plants.iter().map(|meta| meta.id);
    let mut message = format!("there is no plant `{id}`");
    match nearest(id, ids()) {
        Some(near) => message.push_str(&format!("; did you mean `{near}`?")),
        None => {
            let known: Vec<&str> = ids().collect();
            message.push_str(&format!("; known are {}", known.join(", ")));
        }
    }
    Err(Error::request(message))
}

/// Whether the parts that are linked can be told apart by their ids.
#[cfg(feature = "cli")]
pub(crate) fn check_registry() -> Result<()> {
    Ok(registry::check()?)
}
