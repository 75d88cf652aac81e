//! Tables in plain text.

/// A table with columns aligned: the first to the left, the others to the right.
///
/// ```
/// use loopsight_report::words::table;
/// let rows = [["speed", "0.01 m/s"], ["angle", "0.2 rad"]].map(|row| row.map(str::to_owned).to_vec());
/// assert_eq!(
///     table(&["signal", "rmse"], &rows),
///     "  signal      rmse\n  speed   0.01 m/s\n  angle    0.2 rad"
/// );
/// ```
pub fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    aligned(head, rows, 1)
}

/// A table with all columns aligned to the left.
pub fn columns(head: &[&str], rows: &[Vec<String>]) -> String {
    aligned(head, rows, head.len())
}

/// A table whose first `left` columns are aligned to the left, the others to the right.
fn aligned(head: &[&str], rows: &[Vec<String>], left: usize) -> String {
    let mut widths: Vec<usize> = head.iter().map(|h| h.chars().count()).collect();
    for row in rows {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = (*width).max(cell.chars().count());
        }
    }
    let line = |cells: Vec<&str>| {
        let mut text = String::new();
        for (i, (cell, width)) in cells.iter().zip(&widths).enumerate() {
            let gap = " ".repeat(width - cell.chars().count());
            if i < left {
                text.push_str(&format!("  {cell}{gap}"));
            } else {
                text.push_str(&format!("  {gap}{cell}"));
            }
        }
        text.trim_end().to_owned()
    };
    let mut lines = vec![line(head.to_vec())];
    for row in rows {
        lines.push(line(row.iter().map(String::as_str).collect()));
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let rows = [vec!["ä".to_owned(), "long".into()]];
        assert_eq!(columns(&["ab", "c"], &rows), "  ab  c\n  ä   long");
        assert_eq!(table(&["ab", "c"], &rows), "  ab     c\n  ä   long");
        assert_eq!(table(&["ab"], &[]), "  ab");
    }
}
