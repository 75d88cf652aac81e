//! `loopsight new`: a starting point that runs at once.

mod folder;
mod model_text;
mod pace;
mod robot;
mod texts;
mod workshop;

use crate::cli::arguments::NewOptions;
use crate::cli::failure::Failure;

pub(crate) fn run(options: &NewOptions) -> Result<(), Failure> {
    match &options.plant {
        Some(plant) => robot::write(&options.folder, plant),
        None => workshop::write(&options.folder, options.loopsight.as_deref()),
    }
}
