//! One file per command.

pub(crate) mod add;
pub(crate) mod bringup;
pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod convert;
mod dashboard;
pub(crate) mod diagnose;
pub(crate) mod experiment;
pub(crate) mod explain;
pub(crate) mod fit;
pub(crate) mod improve;
pub(crate) mod inspect;
pub(crate) mod list;
pub(crate) mod new;
mod person;
pub(crate) mod run;
pub(crate) mod send;
pub(crate) mod simulate;
