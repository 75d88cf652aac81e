//! Messages of ROS: their definitions as text, and their bytes.

mod common;
mod decode;
mod definition;

pub(crate) use common::definition_of;
pub(crate) use decode::{Layout, Ros};
