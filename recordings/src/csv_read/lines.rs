//! Which lines of a text its rows stand in.

/// Line numbers of rising byte positions; blank lines and comments before a record are skipped.
pub(super) struct Lines<'t> {
    text: &'t [u8],
    at: usize,
    line: usize,
}

impl<'t> Lines<'t> {
    pub(super) fn new(text: &'t [u8]) -> Self {
        Self {
            text,
            at: 0,
            line: 1,
        }
    }

    pub(super) fn of(&mut self, byte: u64) -> usize {
        let byte = usize::try_from(byte)
            .unwrap_or(usize::MAX)
            .min(self.text.len());
        let mut comment = false;
        while let Some(b) = self.text.get(self.at) {
            if self.at >= byte {
                match b {
                    b'#' => comment = true,
                    b'\n' => comment = false,
                    b'\r' => {}
                    _ if comment => {}
                    _ => break,
                }
            }
            self.line += usize::from(*b == b'\n');
            self.at += 1;
        }
        self.line
    }
}

/// The lines of rows: the first, how many, and each of them where they do not follow one another.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RowLines {
    first: usize,
    count: usize,
    all: Vec<usize>,
}

impl RowLines {
    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    pub(super) fn push(&mut self, line: usize) {
        if self.count == 0 {
            self.first = line;
        }
        let follows = self.all.is_empty() && line == self.first + self.count;
        if !follows {
            if self.all.is_empty() {
                self.all = (self.first..self.first + self.count).collect();
            }
            self.all.push(line);
        }
        self.count += 1;
    }

    /// The first, and each of them where they do not follow one another.
    pub(super) fn first_and_all(self) -> (usize, Vec<usize>) {
        (self.first, self.all)
    }

    /// Those of more rows, which are counted from `before` on.
    pub(super) fn extend(&mut self, more: &Self, before: usize) {
        if more.all.is_empty() && self.all.is_empty() {
            let first = before + more.first;
            if self.count == 0 || first == self.first + self.count || more.count == 0 {
                self.first = if self.count == 0 { first } else { self.first };
                self.count += more.count;
                return;
            }
        }
        for row in 0..more.count {
            let own = more.all.get(row).copied();
            self.push(before + own.unwrap_or(more.first + row));
        }
    }
}
