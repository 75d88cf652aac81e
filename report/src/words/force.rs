//! A force that no effect of the library is.

use loopsight_diagnosis::ResidualForce;

/// What is known of the force, and an expression to begin with, for a terminal; each line with a line's end
/// before it.
pub(crate) fn text(force: Option<&ResidualForce>) -> String {
    let Some(force) = force else {
        return String::new();
    };
    let mut text = format!("\nresidual force: {}", force.statement);
    if let Some(expression) = &force.expression {
        text.push_str(&format!(
            "\n\na first expression, for the end of the model file (then fit and edit it; `improve --discover` does so):\n\n{}",
            expression.toml.trim_end()
        ));
    }
    text
}
