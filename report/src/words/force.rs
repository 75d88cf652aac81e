//! A force that no effect of the library is.

use loopsight_diagnosis::{ForceExpression, ResidualForce};

use super::number::hundredths;

/// What an expression left that was fitted and not added; none where it was not fitted.
pub(crate) fn fitted(expression: &ForceExpression) -> Option<String> {
    let left = hundredths(expression.left?);
    Some(format!(
        "fitted, it leaves {left} on data that the model was not fitted to, which is not enough to add it"
    ))
}

/// What is known of the force, and an expression to begin with, for a terminal; each line with a line's end
/// before it.
pub(crate) fn text(force: Option<&ResidualForce>) -> String {
    let Some(force) = force else {
        return String::new();
    };
    let mut text = format!("\nresidual force: {}", force.statement);
    if let Some(expression) = &force.expression {
        let then = fitted(expression)
            .unwrap_or_else(|| "then fit and edit it; `improve --discover` does so".to_owned());
        text.push_str(&format!(
            "\n\na first expression, for the end of the model file ({then}):\n\n{}",
            expression.toml.trim_end()
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What was fitted already is not recommended.
    #[test]
    fn an_expression_that_was_fitted_is_no_first_one() {
        let force = |left| ResidualForce {
            at: vec!["shaft".into()],
            unit: "V".into(),
            statement: "the residual force at shaft depends on no single quantity".into(),
            depends_on: Vec::new(),
            expression: Some(ForceExpression {
                force: "0.25 * flow".into(),
                share_of_variance: 0.4,
                toml: "[[effect]]".into(),
                beside: Vec::new(),
                left,
            }),
        };
        let said = |left| text(Some(&force(left)));
        assert!(said(None).contains("(then fit and edit it; `improve --discover` does so)"));
        assert!(said(Some(0.0371)).contains("(fitted, it leaves 3.71 % on data"));
    }
}
