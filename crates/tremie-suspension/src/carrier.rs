//! The fluid as inclusions see it.

use tremie_numerics::DVec3;

/// The fluid around a point, as the mean over a few grains of the method (cells, or nodes).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Seen {
    /// Velocity in m/s.
    pub velocity: DVec3,
    /// Share of what lies around that is fluid: 1 inside, 0 in air, where nothing is felt.
    pub share: f64,
    /// Where more air than fluid lies around: the way back, of length 0 at the surface and 1 where there is nothing but air.
    pub inward: DVec3,
    /// By how much of the plastic viscosity the apparent one is larger; 0 as long as nobody asks ([`Carrier::thicken`]).
    pub thickening: f64,
    /// By how much, as a share, more friction than the fluid there takes in a step is asked of it by all points together; 0 where it takes it.
    pub crowding: f64,
}

/// What a point does to the fluid around it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Push {
    /// Force in N.
    pub force: DVec3,
    /// Friction in N s/m that it asks for, before crowding.
    pub friction: f64,
}

/// A fluid that carries inclusions.
///
/// In each of its steps the inclusions ask first ([`Carrier::see`]), and then push ([`Carrier::push`]); the fluid feels the
/// forces during the step that follows.
pub trait Carrier {
    /// Length in m over which the method smears a point: the size of a cell, or of a node.
    fn grain(&self) -> f64;

    /// Radius in m of the cylinder as which a line of points that are a grain apart moves through the fluid.
    fn line_radius(&self) -> f64;

    /// Density in kg/m3.
    fn density(&self) -> f64;

    /// Viscosity in Pa s that bodies meet where they are small against the grain: the plastic viscosity.
    fn viscosity(&self) -> f64;

    /// Acceleration of gravity in m/s2.
    fn gravity(&self) -> DVec3;

    /// Length in s of the step that follows.
    fn time_step(&self) -> f64;

    /// What there is around each point, all points together being allowed to take hold of such a part of what flowing fluid lets them.
    fn see(&mut self, points: &[DVec3], part: f64, seen: &mut [Seen]);

    /// Finds the thickening around each point, from the shear rate there.
    fn thicken(&mut self, points: &[DVec3], seen: &mut [Seen]);

    /// Pushes the fluid at each point that was asked for last, spread over the fluid that [`Carrier::see`] saw from there.
    fn push(&mut self, pushes: &[Push]);
}
