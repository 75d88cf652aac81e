//! Arrays of numbers as channels: the longer side is time.

use crate::error::FormatError;
use crate::sink::{ARRAY_MOST, ChannelInfo, Kind, Sink};

/// Order in which the elements of an array stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// The first index runs fastest: MATLAB, Fortran.
    Column,
    /// The last index runs fastest: C, NumPy.
    Row,
}

/// A numeric array with a name.
pub(crate) struct Array<'a> {
    pub(crate) path: &'a str,
    pub(crate) shape: &'a [usize],
    pub(crate) order: Order,
    pub(crate) kind: Kind,
    pub(crate) declared: &'a str,
    pub(crate) unit: Option<String>,
    /// Whether indices count from 1 and stand in parentheses, as in MATLAB.
    pub(crate) matlab: bool,
}

impl Array<'_> {
    /// Hands the array on, one channel for each column (or row, where there are fewer of them).
    pub(crate) fn emit(&self, values: &[f64], sink: &mut dyn Sink) -> Result<(), FormatError> {
        let sides: Vec<usize> = self.shape.iter().copied().filter(|n| *n != 1).collect();
        let (length, across, along_first) = match sides[..] {
            [] => (1, 1, true),
            [n] => (n, 1, true),
            [rows, columns] if rows >= columns => (rows, columns, true),
            [rows, columns] => (columns, rows, false),
            _ => (0, usize::MAX, true),
        };
        let size = length.checked_mul(across);
        if across > ARRAY_MOST || size != Some(values.len()) || values.is_empty() {
            return self.opaque(sink);
        }
        let one = across == 1;
        for k in 0..across {
            let mut path = self.path.to_owned();
            let mut alias = None;
            if !one {
                path = format!("{}[{k}]", self.path);
                if self.matlab {
                    alias = Some(match along_first {
                        true => format!("{}(:,{})", self.path, k + 1),
                        false => format!("{}({},:)", self.path, k + 1),
                    });
                }
            }
            let mut info = ChannelInfo::new(path, self.kind, self.declared);
            info.alias = alias;
            info.unit.clone_from(&self.unit);
            let channel = sink.channel(info)?;
            // Whether the elements of a channel stand side by side.
            let beside = one || along_first == (self.order == Order::Column);
            for n in 0..length {
                let at = if beside {
                    k * length + n
                } else {
                    n * across + k
                };
                if let Some(value) = values.get(at) {
                    sink.number(channel, *value)?;
                }
            }
        }
        Ok(())
    }

    fn opaque(&self, sink: &mut dyn Sink) -> Result<(), FormatError> {
        let shape: Vec<String> = self.shape.iter().map(usize::to_string).collect();
        let declared = format!("{} {}", self.declared, shape.join("x"));
        let channel = sink.channel(ChannelInfo::new(self.path, Kind::Opaque, declared))?;
        sink.opaque(channel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Format, LogBuilder};

    fn columns(shape: &[usize], order: Order) -> Vec<(String, Vec<f64>)> {
        let n: usize = shape.iter().product();
        let values: Vec<f64> = (0..n).map(|k| k as f64).collect();
        let mut log = LogBuilder::new("l", Format::Mat5, 100);
        let array = Array {
            path: "x",
            shape,
            order,
            kind: Kind::Number,
            declared: "double",
            unit: None,
            matlab: true,
        };
        array.emit(&values, &mut log).unwrap();
        let log = log.finish().unwrap();
        log.channels
            .iter()
            .map(|c| {
                (
                    c.info.path.clone(),
                    c.numbers().unwrap_or_default().to_vec(),
                )
            })
            .collect()
    }

    #[test]
    fn the_longer_side_is_time() {
        let x = |k: usize, v: &[f64]| (format!("x[{k}]"), v.to_vec());
        let (a, b) = ([0.0, 1.0, 2.0], [3.0, 4.0, 5.0]);
        let (c, d) = ([0.0, 2.0, 4.0], [1.0, 3.0, 5.0]);
        assert_eq!(columns(&[3, 2], Order::Column), [x(0, &a), x(1, &b)]);
        assert_eq!(columns(&[3, 2], Order::Row), [x(0, &c), x(1, &d)]);
        assert_eq!(columns(&[2, 3], Order::Row), [x(0, &a), x(1, &b)]);
        assert_eq!(columns(&[2, 3], Order::Column), [x(0, &c), x(1, &d)]);
        assert_eq!(
            columns(&[1, 3], Order::Column),
            [("x".to_owned(), a.to_vec())]
        );
        assert_eq!(columns(&[1, 1], Order::Row), [("x".to_owned(), vec![0.0])]);
        assert_eq!(columns(&[3, 3, 3], Order::Row), [("x".to_owned(), vec![])]);
    }
}
