//! Arrays of a length that is known when a program is compiled.

use core::ops::{Index, IndexMut};

mod sealed {
    pub trait Sealed {}
    impl<T, const N: usize> Sealed for [T; N] {}
}

/// An array `[T; N]` whose length a generic function need not name.
///
/// The sizes of a plant or an effect are types: `P::State<S>` is `[S; 6]` for a plant with six states.
/// Code for any plant uses the methods here. They compile to what the array itself compiles to, and
/// need neither `std` nor an allocator.
///
/// ```
/// use loopsight_core::Array;
///
/// fn sum<A: Array<f64>>(of: &A) -> f64 {
///     of.as_ref().iter().sum()
/// }
/// assert_eq!(sum(&[1.0, 2.0]), 3.0);
/// assert_eq!(<[f64; 3]>::filled(0.5), [0.5; 3]);
/// ```
pub trait Array<T>:
    sealed::Sealed
    + Sized
    + AsRef<[T]>
    + AsMut<[T]>
    + Index<usize, Output = T>
    + IndexMut<usize>
    + IntoIterator<Item = T>
{
    /// Number of elements.
    const LENGTH: usize;

    /// An array as long as this one, of other elements.
    type Of<U>: Array<U>;

    /// The array whose `i`-th element is `of(i)`.
    fn from_fn(of: impl FnMut(usize) -> T) -> Self;

    /// The elements of an iterator; `None` where there are more or fewer.
    fn collect(elements: impl IntoIterator<Item = T>) -> Option<Self>;

    /// A slice as an array; `None` where its length differs.
    fn from_slice(slice: &[T]) -> Option<&Self>;

    /// A slice that can be written to as an array; `None` where its length differs.
    fn from_mut_slice(slice: &mut [T]) -> Option<&mut Self>;

    /// The first elements of a slice as an array; `None` where there are too few.
    #[inline(always)]
    fn from_first(slice: &[T]) -> Option<&Self> {
        Self::from_slice(slice.get(..Self::LENGTH)?)
    }

    /// A slice as a list of arrays; what is left over is left out.
    fn chunks_mut(slice: &mut [T]) -> &mut [Self];

    /// The array whose elements are all `value`.
    #[inline(always)]
    fn filled(value: T) -> Self
    where
        T: Copy,
    {
        Self::from_fn(|_| value)
    }
}

impl<T, const N: usize> Array<T> for [T; N] {
    const LENGTH: usize = N;

    type Of<U> = [U; N];

    #[inline(always)]
    fn from_fn(of: impl FnMut(usize) -> T) -> Self {
        core::array::from_fn(of)
    }

    fn collect(elements: impl IntoIterator<Item = T>) -> Option<Self> {
        let mut collected = heapless::Vec::<T, N>::new();
        for element in elements {
            collected.push(element).ok()?;
        }
        collected.into_array().ok()
    }

    #[inline(always)]
    fn from_slice(slice: &[T]) -> Option<&Self> {
        slice.try_into().ok()
    }

    #[inline(always)]
    fn from_mut_slice(slice: &mut [T]) -> Option<&mut Self> {
        slice.try_into().ok()
    }

    #[inline(always)]
    fn chunks_mut(slice: &mut [T]) -> &mut [Self] {
        slice.as_chunks_mut().0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubled<A: Array<u8>>(of: &A) -> A::Of<u16> {
        A::Of::from_fn(|i| 2 * u16::from(of[i]))
    }

    #[test]
    fn lengths_are_kept() {
        assert_eq!(doubled(&[1, 2, 3]), [2, 4, 6]);
        assert_eq!(<[u8; 2]>::from_slice(&[1, 2, 3]), None);
        assert_eq!(<[u8; 2]>::from_first(&[1, 2, 3]), Some(&[1, 2]));
        assert_eq!(<[u8; 4]>::from_first(&[1, 2, 3]), None);
        assert_eq!(<[u8; 2]>::from_mut_slice(&mut [1]), None);
        assert_eq!(<[u8; 0]>::LENGTH, 0);
    }

    #[test]
    fn only_as_many_elements_are_collected() {
        for (count, expected) in [(1, None), (2, Some([0, 1])), (3, None)] {
            assert_eq!(<[u8; 2]>::collect(0..count), expected);
        }
    }
}
