//! Text into HTML, safely.

use crate::typeset::typeset;

/// `text` as HTML text or as the value of a quoted attribute.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            _ => out.push(c),
        }
    }
    out
}

/// A sentence or a number as HTML, set as a printer would.
pub(crate) fn text(plain: &str) -> String {
    escape(&typeset(plain))
}

/// As [`escape`], and a long identifier may break into lines after its underscores and dots.
pub(crate) fn identifier(text: &str) -> String {
    escape(text).replace('_', "_<wbr>").replace('.', ".<wbr>")
}

/// A sentence as HTML in which `` `names` `` stand as code.
pub(crate) fn marked(plain: &str) -> String {
    let parts: Vec<&str> = plain.split('`').collect();
    let paired = parts.len() % 2 == 1;
    let mut out = String::new();
    for (at, part) in parts.iter().enumerate() {
        let code = paired && at % 2 == 1;
        if code && !part.is_empty() {
            out.push_str(&format!("<code>{}</code>", identifier(part)));
        } else {
            out.push_str(&text(part));
        }
    }
    out
}

/// A capital letter at the beginning and a full stop at the end.
pub(crate) fn sentence(text: &str) -> String {
    let mut chars = text.chars();
    match chars.next() {
        Some(first) => format!(
            "{}{}{}",
            first.to_uppercase(),
            chars.as_str(),
            if text.ends_with('.') { "" } else { "." }
        ),
        None => String::new(),
    }
}

/// A table; `numeric` columns are aligned to the right. Cells are HTML.
pub(crate) fn table(header: &[&str], numeric: &[bool], rows: &[Vec<String>]) -> String {
    let class = |column: usize| match numeric.get(column) {
        Some(true) => " class=\"number\"",
        _ => "",
    };
    let mut out = String::from("<div class=\"wide\"><table><thead><tr>");
    for (column, title) in header.iter().enumerate() {
        out.push_str(&format!("<th{}>{}</th>", class(column), escape(title)));
    }
    out.push_str("</tr></thead><tbody>");
    for row in rows {
        out.push_str("<tr>");
        for (column, cell) in row.iter().enumerate() {
            out.push_str(&format!("<td{}>{cell}</td>", class(column)));
        }
        out.push_str("</tr>");
    }
    out.push_str("</tbody></table></div>\n");
    out
}

/// A list of sentences; nothing when there are none.
pub(crate) fn list(sentences: &[String]) -> String {
    if sentences.is_empty() {
        return String::new();
    }
    let items: String = sentences
        .iter()
        .map(|s| format!("<li>{}</li>", text(s)))
        .collect();
    format!("<ul>{items}</ul>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_breaks_out() {
        assert_eq!(escape("a<b>&\"c'"), "a&lt;b&gt;&amp;&quot;c&#39;");
        assert_eq!(identifier("a_b.c<"), "a_<wbr>b.<wbr>c&lt;");
        assert_eq!(marked("a ` is <1"), "a  is &lt;1");
        assert_eq!(marked("`a<` is `` 1"), "<code>a&lt;</code> is  1");
        assert_eq!(list(&["<x>".into()]), "<ul><li>&lt;x&gt;</li></ul>\n");
    }

    #[test]
    fn a_table_aligns_its_numbers() {
        let text = table(
            &["signal", "rms"],
            &[false, true],
            &[vec!["v".into(), "1".into()]],
        );
        assert!(text.contains("<th class=\"number\">rms</th>"));
        assert!(text.contains("<td>v</td><td class=\"number\">1</td>"));
    }
}
