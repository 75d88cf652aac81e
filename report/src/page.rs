//! The frame of every page: head, style, scripts, footer.

use crate::html::{escape, list, text};
use crate::packed::library;

/// The style of every page: CSS.
pub const PAGE_STYLE: &str = include_str!("../assets/page.css");
const SCRIPT: &str = include_str!("../assets/page.js");

/// What a page is about and where it comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Context {
    /// Title of the page.
    pub title: String,
    /// Name of the robot.
    pub model_name: String,
    /// The model file; absent where the log brought its own model.
    pub model_file: Option<String>,
    /// The log file; may be empty.
    pub log_file: String,
    /// Sentences to show at the top.
    pub notes: Vec<String>,
    /// The command that made the page.
    pub command: String,
}

/// A whole page around `body` (HTML), with the library that draws its charts.
pub(crate) fn page(context: &Context, body: &str) -> String {
    let scripts = format!(
        "<script type=\"application/gzip\" id=\"library\">{}</script>\n<script>\n{SCRIPT}</script>\n",
        library()
    );
    framed(
        context,
        body,
        "; charts by plotly.js (MIT licence)",
        &scripts,
    )
}

/// A whole page around `body` (HTML) that has no charts.
pub(crate) fn plain_page(context: &Context, body: &str) -> String {
    framed(context, body, "", "")
}

fn framed(context: &Context, body: &str, credits: &str, scripts: &str) -> String {
    let title = escape(&context.title);
    let mut about = vec![format!("<b>{}</b>", escape(&context.model_name))];
    about.extend(
        context
            .model_file
            .as_deref()
            .map(|f| format!("model <code>{}</code>", escape(f))),
    );
    if !context.log_file.is_empty() {
        about.push(format!("log <code>{}</code>", escape(&context.log_file)));
    }
    let about = about.join(" · ");
    let notes = list(&context.notes);
    let command = if context.command.is_empty() {
        String::new()
    } else {
        format!("Made with <code>{}</code>. ", escape(&context.command))
    };
    let version = env!("CARGO_PKG_VERSION");
    let warning = match scripts.is_empty() {
        true => "",
        false => {
            "<p class=\"box\" id=\"trouble\" hidden></p>\n\
             <noscript><p class=\"box\">The charts on this page need JavaScript.</p></noscript>\n"
        }
    };
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
         script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; \
         base-uri 'none'; form-action 'none'\">\n\
         <title>{title}</title>\n<style>\n{PAGE_STYLE}</style>\n</head>\n<body>\n<main>\n\
         <header><h1>{title}</h1><p class=\"about\">{about}</p></header>\n\
         {warning}{notes}{body}\
         <footer>{command}loopsight {version}{credits}.</footer>\n</main>\n\
         {scripts}</body>\n</html>\n"
    )
}

/// A section with a heading and one sentence that says what is to be seen in it (may be empty).
pub(crate) fn section(title: &str, what: &str, body: &str) -> String {
    let what = if what.is_empty() {
        String::new()
    } else {
        format!("<p class=\"what\">{}</p>\n", text(what))
    };
    format!(
        "<section>\n<h2>{}</h2>\n{what}{body}</section>\n",
        escape(title)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_users_stays_text() {
        let nasty = "a </script><script>alert(\"1\")</script> & 'b'";
        let context = Context {
            title: nasty.into(),
            model_name: nasty.into(),
            model_file: Some(nasty.into()),
            log_file: nasty.into(),
            notes: vec![nasty.into()],
            command: nasty.into(),
        };
        let page = page(&context, "");
        assert!(!page.contains("alert(\""));
        assert_eq!(page.matches("alert(&quot;1&quot;)").count(), 7);
        assert_eq!(page.matches("</script>").count(), 2);
    }

    #[test]
    fn nothing_is_fetched() {
        let page = page(&Context::default(), "").replace(library(), "");
        assert!(!page.contains("http://") && !page.contains("https://"));
        assert!(!page.contains("src=\"") && !page.contains("@import") && !page.contains("url("));
        // And should the library want to, the policy forbids it.
        assert!(page.contains("default-src 'none'"));
    }
}
