//! Effects and plants of your own, as expressions in TOML.

mod draft;

pub use draft::{EffectDraft, ParameterDraft};
