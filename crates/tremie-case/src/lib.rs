//! The case file: what the user wants computed, read from TOML, checked, and in SI units.
//!
//! [`Case::parse`] gives plain data without a trace of TOML, or a [`CaseError`] that shows the line, says what is
//! wrong with it and what to write instead. [`units`] reads quantities such as `"30 Pa s"`; the command line uses
//! it too.
//!
//! Inside: `document` wraps the parsed document in getters that know where everything stands; `schema` says which keys
//! there are and what they mean (a new section, flow curve or shape is one entry there); `describe` turns the same
//! into a JSON Schema; `check` holds what is
//! wrong only in combination; `files` finds the files that a case names, `stl` and `bars` read them, so that what is wrong with them is told at the line too; `inclusions` are the keys of bodies in the fluid, and their places at the start; `cuts` reads another file, of what is cut out of a cast, in the same way, and `beam` that of a hardened beam; `fault` turns a complaint about a place in the text into a message.

mod bars;
mod beam;
mod case;
mod check;
mod cuts;
mod describe;
mod document;
mod fault;
mod fibre_field;
mod files;
mod inclusions;
mod listed;
mod schema;
mod stl;
mod suggestion;
pub mod units;

pub use beam::{BeamCase, BeamFibres, BeamLattice, BeamTest, FibreBond, Lying, Matrix};
pub use case::{
    AboveFill, Cage, Case, Collision, Course, Domain, FillingGauge, FluidRegion, FrontGauge, Gauges, Inlet,
    Isph, Lattice, Layer, Lbm, Ldd, LddCoupling, LddLaplacian, LddScheme, LevelGauge, LightGauge, Load,
    Loaded, Material, MeshFile, Method, NamedFile, Outlet, Output, Precision, Preset, PressureGauge,
    PressureStep, Rest, Role, Scheme, Side, Solid, SpreadGauge, Stepping, Stop, StrainConvention, StressStep,
    Surface, Textbook,
};
pub use cuts::{Beam, Cuts, Plane};
pub use fault::{CaseError, InvalidCase};
pub use fibre_field::FibreField;
pub use inclusions::{Bodies, FibreSection, Following, InclusionGroup, Incoming, Random};
pub use listed::{Listed, ListedBody};

/// The JSON Schema (draft 2020-12) of the case file: its keys, what they mean, and what may stand there.
pub fn json_schema() -> serde_json::Value {
    schema::describe()
}

/// The same of the beam file.
pub fn beam_schema() -> serde_json::Value {
    beam::describe()
}
