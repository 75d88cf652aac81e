//! Recursive estimators, one file each.
//!
//! An estimator is written once, generic over the scalar and the number of parameters: `Const<N>`
//! runs without an allocator, `Dyn` on a host runs the same code to the same digits. A program
//! that wants them in its TOML says `use loopsight_estimators as _;`.

#![cfg_attr(not(feature = "std"), no_std)]

mod rls;

pub use rls::{Rls, RlsError, RlsSettings};
