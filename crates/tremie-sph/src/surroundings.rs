//! What surrounds particles at a moment: their images in walls, and who is near whom.

use tremie_cloud::{Dimension, Gradients, Kernel, Neighbours, Smoothing, at_surface, images};
use tremie_geometry::Body;
use tremie_numerics::{DMat3, DVec3};

use crate::Wall;

/// Smoothing length in spacings: wide in a plane; in space, where there are five times as many neighbours, less so.
fn smoothing_length(dimension: Dimension) -> f64 {
    match dimension {
        Dimension::Two => 2.0,
        Dimension::Three => 1.3,
    }
}

/// The kernel of particles so far apart, in m.
pub(crate) fn kernel(dimension: Dimension, spacing: f64) -> Smoothing {
    Smoothing::new(Kernel::Wendland, dimension, smoothing_length(dimension) * spacing)
}

/// The share of a smoothing length that is added to distances where they divide.
const SOFT: f64 = 0.01;

/// The mirror across a plane with this normal.
fn flipped(n: DVec3) -> DMat3 {
    DMat3::IDENTITY - 2.0 * DMat3::from_cols(n.x * n, n.y * n, n.z * n)
}

/// What particles or images of particles have of particles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Source {
    /// The particle.
    pub(crate) of: usize,
    /// Its velocity is `turn` times the particle's, and `carried`.
    pub(crate) turn: DMat3,
    pub(crate) carried: DVec3,
    /// What mirrors make of vectors.
    pub(crate) mirror: DMat3,
    /// How far it is from the particle, in m.
    pub(crate) off: DVec3,
}

/// Particles, their images behind them, and who is near whom.
pub(crate) struct Surroundings {
    pub(crate) dimension: Dimension,
    pub(crate) kernel: Smoothing,
    /// (0.01 h)^2 in m2.
    pub(crate) soft: f64,
    /// What a particle stands for, in m3, or m2 in a plane.
    pub(crate) volume: f64,
    pub(crate) number: usize,
    pub(crate) positions: Vec<DVec3>,
    pub(crate) sources: Vec<Source>,
    pub(crate) near: Neighbours,
}

impl Surroundings {
    /// Those of particles at these places.
    pub(crate) fn new(particles: &[DVec3], spacing: f64, dimension: Dimension, walls: &[Wall]) -> Self {
        let kernel = kernel(dimension, spacing);
        let bodies: Vec<Body> = walls.iter().map(|wall| wall.body.clone()).collect();
        let mut positions = particles.to_vec();
        let one = DMat3::IDENTITY;
        let own = |of: usize| Source { of, turn: one, carried: DVec3::ZERO, mirror: one, off: DVec3::ZERO };
        let mut sources: Vec<Source> = (0..particles.len()).map(own).collect();
        for image in images(particles, &bodies, kernel.support()) {
            let (parent, wall) = (sources[image.of as usize], &walls[image.wall as usize]);
            let seen = |u: DVec3| image.velocity(u, wall.velocity, wall.slip_length);
            let still = seen(DVec3::ZERO);
            let turn =
                DMat3::from_cols(seen(DVec3::X) - still, seen(DVec3::Y) - still, seen(DVec3::Z) - still);
            sources.push(Source {
                of: parent.of,
                turn: turn * parent.turn,
                carried: turn * parent.carried + still,
                mirror: flipped(image.normal) * parent.mirror,
                off: image.at - particles[parent.of],
            });
            positions.push(image.at);
        }
        let near = Neighbours::within(&positions, kernel.support());
        let length = smoothing_length(dimension) * spacing;
        let volume = spacing.powi(dimension.number() as i32);
        let soft = (SOFT * length).powi(2);
        Self { dimension, kernel, soft, volume, number: particles.len(), positions, sources, near }
    }

    /// Neighbours of a particle, images among them: number, way to it in m, and its source.
    pub(crate) fn around(&self, particle: usize) -> impl Iterator<Item = (usize, DVec3, &Source)> {
        let at = self.positions[particle];
        let near = self.near.of(particle).iter().map(|n| *n as usize);
        near.map(move |n| (n, self.positions[n] - at, &self.sources[n]))
    }

    /// Share of the volume around a particle that particles stand for, by the kernel.
    pub(crate) fn crowd(&self, particle: usize) -> f64 {
        let others = self.around(particle).map(|(_, x, _)| self.kernel.weight(x.length())).sum::<f64>();
        self.volume * (self.kernel.weight(0.0) + others)
    }

    /// The same on a lattice.
    pub(crate) fn lattice(&self) -> f64 {
        let spacing = self.volume.powf(1.0 / self.dimension.number() as f64);
        let reach = (self.kernel.support() / spacing).ceil() as i32;
        let along = || (-reach..=reach).map(f64::from);
        let high = move || if self.dimension == Dimension::Two { 0..=0 } else { -reach..=reach };
        let places = along().flat_map(move |x| {
            along().flat_map(move |y| high().map(move |z| DVec3::new(x, y, f64::from(z))))
        });
        self.volume * places.map(|at| self.kernel.weight(spacing * at.length())).sum::<f64>()
    }

    /// A value of all particles as images have it too.
    pub(crate) fn mirrored<T>(&self, of: impl Fn(&Source) -> T) -> Vec<T> {
        self.sources.iter().map(of).collect()
    }

    /// What gradients are formed with: exact for linear fields.
    pub(crate) fn gradients(&self) -> Gradients<'_> {
        let weight = |_, _, distance: f64| -self.volume * self.kernel.slope(distance) / distance;
        Gradients::new(&self.positions, &self.near, self.dimension, weight)
    }

    /// Which particles are at the free surface.
    pub(crate) fn surface(&self) -> Vec<bool> {
        let mut found = at_surface(&self.positions, &self.near, &self.kernel, self.volume, self.dimension);
        found.truncate(self.number);
        found
    }
}
