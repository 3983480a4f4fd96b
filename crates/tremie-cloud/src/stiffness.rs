//! Fluid so stiff that in a step velocities follow stresses at once, and inertia counts for little: what pressures have to do with that.
//!
//! A projection makes velocities u* free of divergence by dt/rho grad (p' - p), however stiff the fluid: by viscosities of many rho D^2/dt (D: spacing) it would take as many steps to come to the pressure under which u* has
//! none by itself. So what the next step begins with is
//!
//! ```text
//!     p'' = p' - (1 - s) chi mu div u*,      s = 1/(1 + 2 d mu dt/(rho D^2)),      at the surface  p'' = (1 - s^2) p' - (1 - s) chi mu div u*
//! ```
//!
//! in d dimensions: the incremental projection in rotational form (Timmermans, Minev and van de Vosse 1996; Guermond, Minev and Shen 2006), and as fluid is stiffer, the method of Uzawa. mu is what neighbours make of the viscosity,
//! the harmonic mean of those between them, as what yields gives way. Only so the surface has a pressure at all: the one that balances the viscous stress across it.
//!
//! What the divergence of a gradient does not see of a pressure, and the Laplacian does, would add up. As much of it as inertia lets counts for a divergence (Hughes, Franca and Balestra 1986): in the projection the share s of div grad p - lap p;
//! in what p'' falls by `D^2/(4 d mu + rho D^2/dt)` times as much, by which what alternates between nodes does not grow.
//!
//! A node at the surface bears on one side only: an even stress s pushes it with s o, by a vector o into the fluid. As its pressure p is the one at the surface, it stands for what is within half a spacing of that, and across
//! the surface o is raised until it is twice g, the sum of the weights of its gradient: of -grad p - p o, -p (o - g) is what its own pressure does to it, and that must drive it out, as it drives the others in, or nodes that
//! stick out do so more and more. On a lattice grad p + p o is then (p_s + p_1)/D.

use tremie_numerics::{DMat3, DVec3};

/// Forces across the surface at most, over what they are unraised.
const STEEPEST: f64 = 8.0;

/// How inertia and viscosity share what a step does.
#[derive(Debug, Clone, Copy)]
pub struct Stiffness {
    /// rho/dt in kg/(m3 s).
    rate: f64,
    /// D^2 in m2.
    square: f64,
    /// 2 d.
    sides: f64,
}

impl Stiffness {
    /// Of a fluid's density in kg/m3, nodes so far apart in m in so many dimensions, and a step in s.
    pub fn new(density: f64, spacing: f64, dimensions: usize, step: f64) -> Self {
        Self { rate: density / step, square: spacing * spacing, sides: 2.0 * dimensions as f64 }
    }

    /// s: the share of inertia, with a viscosity in Pa s.
    pub fn inertia(&self, viscosity: f64) -> f64 {
        let inertia = self.rate * self.square;
        inertia / (inertia + self.sides * viscosity)
    }

    /// By how much in Pa a pressure is too large, with a viscosity in Pa s, by a divergence in 1/s and by how much div grad p is more than lap p, in Pa/m2.
    pub fn excess(&self, chi: f64, viscosity: f64, divergence: f64, rough: f64) -> f64 {
        let soft = self.square / (self.rate * self.square + 2.0 * self.sides * viscosity);
        (1.0 - self.inertia(viscosity)) * chi * viscosity * (divergence + soft * rough)
    }

    /// Takes off `pressures` in Pa what a `stress` in Pa wants, and of nodes at the `surface` what is left from when viscosities in Pa s were more to a step.
    pub fn follow(&self, surface: &[bool], stress: &[f64], viscosity: &[f64], pressures: &mut [f64]) {
        for (a, p) in pressures.iter_mut().enumerate() {
            let kept = if surface[a] { 1.0 - self.inertia(viscosity[a]).powi(2) } else { 1.0 };
            *p = kept * *p - stress[a];
        }
    }
}

/// The viscosity that a node of a viscosity feels, by the weights and viscosities of its neighbours.
pub fn felt(own: f64, neighbours: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (all, sum) = neighbours.fold((0.0, 0.0), |(all, sum), (weight, other)| {
        (all + weight, sum + weight * 0.5 * (1.0 / own + 1.0 / other))
    });
    if sum > 0.0 { all / sum } else { own }
}

/// By how much more than along it forces across the surface count at a node there, by the `normal` out of the fluid and its vectors o (`open`) and g (`slope`): r along the normal, if a force f counts as f + r (r . f).
pub fn raised(normal: DVec3, open: DVec3, slope: DVec3) -> DVec3 {
    let (open, slope) = (open.dot(normal), slope.dot(normal));
    let more = if open < 0.0 { (2.0 * slope / open).clamp(1.0, STEEPEST) - 1.0 } else { 0.0 };
    more.sqrt() * normal
}

/// I + r r^T.
pub fn raise(raised: DVec3) -> DMat3 {
    let r = raised;
    DMat3::IDENTITY + DMat3::from_cols(r.x * r, r.y * r, r.z * r)
}
