//! The box at the top of a page that says what a diagnosis or an improvement concludes.

use loopsight_diagnosis::Conclusion;

use crate::html::text;
use crate::words::Said;

/// `said` as a box, coloured by what is still missing.
pub(crate) fn conclusion(said: &Said, verdict: Conclusion) -> String {
    let class = match verdict {
        Conclusion::EffectMissing => "missing",
        Conclusion::NothingMissing => "nothing",
        Conclusion::UnknownEffect => "unknown",
        Conclusion::DataInsufficient
        | Conclusion::LogFaulty
        | Conclusion::NotFitted
        | Conclusion::Cancelled => "refused",
    };
    let paragraphs = |sentences: &[String], class: &str| -> String {
        sentences
            .iter()
            .map(|s| format!("<p{class}>{}</p>", text(s)))
            .collect()
    };
    format!(
        "<div class=\"conclusion {class}\"><p class=\"headline\">{}</p>{}{}</div>\n",
        text(&said.headline),
        paragraphs(&said.because, ""),
        paragraphs(&said.open, " class=\"open\"")
    )
}
