//! What an answer is about: names for titles.

use loopsight_report::Context;

/// The model and the logs behind an answer.
#[derive(Clone, Debug, Default)]
pub(crate) struct About {
    pub(crate) model_name: String,
    /// A title of its own.
    pub(crate) title: Option<String>,
    /// The model's file or name; none where the log brought its model.
    pub(crate) model_file: Option<String>,
    pub(crate) log: String,
    /// The log that the answer was judged on, if it is another one.
    pub(crate) test: Option<String>,
    /// Sentences that belong beside the numbers.
    pub(crate) notes: Vec<String>,
    /// The unit of a SysId log, and what it is for the model (m or rad).
    pub(crate) sysid: Option<(String, f64)>,
}

impl About {
    /// The frame of a page.
    pub(crate) fn context(&self, title: String, command: &str) -> Context {
        Context {
            title,
            model_name: self.model_name.clone(),
            model_file: self.model_file.clone(),
            log_file: self.log.clone(),
            notes: self.notes.clone(),
            command: command.to_owned(),
        }
    }
}
