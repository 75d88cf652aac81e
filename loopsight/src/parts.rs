//! What a plant, an effect, an estimator, a controller or a driver of one's own is written with.
//!
//! A part that is declared in the program, or in a crate that the program uses, is known everywhere: in
//! model files, fits, diagnoses, listings and pages.
//!
//! ```
//! use loopsight::parts::{Effect, EffectMeta};
//! assert!(loopsight::explain("coulomb_friction").is_ok());
//! # let _: Option<&EffectMeta> = None;
//! ```

pub use loopsight_core::*;
pub use loopsight_model::{declare_effect, declare_part, declare_plant, registry};
