//! Data elements: a type, a size, and numbers in either order of bytes.

pub(super) const MATRIX: u32 = 14;
pub(super) const COMPRESSED: u32 = 15;

/// Elements one after the other.
#[derive(Clone, Copy)]
pub(super) struct Bits<'d> {
    data: &'d [u8],
    at: usize,
    big: bool,
}

/// One element.
#[derive(Clone, Copy)]
pub(super) struct Element<'d> {
    pub(super) kind: u32,
    pub(super) data: &'d [u8],
    big: bool,
}

impl<'d> Bits<'d> {
    pub(super) fn new(data: &'d [u8], big: bool) -> Self {
        Self { data, at: 0, big }
    }

    pub(super) fn at(&self) -> usize {
        self.at
    }

    pub(super) fn is_empty(&self) -> bool {
        self.at >= self.data.len()
    }

    pub(super) fn take(&mut self, n: usize) -> Option<&'d [u8]> {
        let end = self.at.checked_add(n)?;
        let taken = self.data.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    /// Leaves out what fills an element of so many bytes up to a multiple of eight. What is packed
    /// is not filled up, so that the next one may begin anywhere.
    pub(super) fn pad(&mut self, size: usize) {
        let padding = size.next_multiple_of(8) - size;
        self.at = self.at.saturating_add(padding).min(self.data.len());
    }

    /// Type and size of an element that is not a small one.
    pub(super) fn tag(&mut self) -> Option<(u32, usize)> {
        let kind = self.word()?;
        let size = self.word()?;
        Some((kind, usize::try_from(size).ok()?))
    }

    fn word(&mut self) -> Option<u32> {
        let bytes: [u8; 4] = self.take(4)?.try_into().ok()?;
        Some(match self.big {
            true => u32::from_be_bytes(bytes),
            false => u32::from_le_bytes(bytes),
        })
    }

    /// The next element; a small one has its content within its tag.
    pub(super) fn element(&mut self) -> Option<Element<'d>> {
        let first = self.word()?;
        let (kind, size) = (first & 0xffff, first >> 16);
        if size != 0 {
            let content = self.take(4)?;
            return Some(Element {
                kind,
                data: content.get(..size as usize)?,
                big: self.big,
            });
        }
        let size = usize::try_from(self.word()?).ok()?;
        let data = self.take(size)?;
        self.pad(size);
        Some(Element {
            kind: first,
            data,
            big: self.big,
        })
    }
}

impl Element<'_> {
    /// Bytes of one number; none for a type that holds no numbers.
    fn width(&self) -> Option<usize> {
        Some(match self.kind {
            1 | 2 | 16 => 1,
            3 | 4 | 17 => 2,
            5..=7 | 18 => 4,
            9 | 12 | 13 => 8,
            _ => return None,
        })
    }

    /// How many numbers there are.
    pub(super) fn len(&self) -> Option<usize> {
        Some(self.data.len() / self.width()?)
    }

    /// The numbers, as doubles.
    pub(super) fn numbers(&self) -> Option<impl Iterator<Item = f64>> {
        let width = self.width()?;
        let (kind, big) = (self.kind, self.big);
        Some(self.data.chunks_exact(width).map(move |bytes| {
            let add = |sum: u64, b: &u8| (sum << 8) | u64::from(*b);
            let raw = match big {
                true => bytes.iter().fold(0, add),
                false => bytes.iter().rev().fold(0, add),
            };
            match kind {
                1 => f64::from(raw as u8 as i8),
                3 => f64::from(raw as u16 as i16),
                5 => f64::from(raw as u32 as i32),
                12 => raw as i64 as f64,
                7 => f64::from(f32::from_bits(raw as u32)),
                9 => f64::from_bits(raw),
                _ => raw as f64,
            }
        }))
    }

    /// Whole numbers that are sizes.
    pub(super) fn sizes(&self) -> Option<Vec<usize>> {
        let sizes = self.numbers()?.map(|n| {
            let fits = n >= 0.0 && n <= f64::from(u32::MAX);
            fits.then_some(n as usize)
        });
        sizes.collect()
    }

    /// Bytes as text.
    pub(super) fn text(&self) -> String {
        String::from_utf8_lossy(self.data)
            .trim_end_matches('\0')
            .to_owned()
    }
}
