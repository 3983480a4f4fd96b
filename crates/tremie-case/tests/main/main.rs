//! Case files as users write them: right ones give the case that they mean, wrong ones a message at the right place.

mod bars;
mod cages;
mod inclusions;
mod random_text;
mod right_cases;
mod schema;
mod stl;
mod wrong_cases;

/// A case that uses most of what there is.
const SLUMP_FLOW: &str = include_str!("slump_flow.toml");
