//! What surrounds particles at a moment: their images in walls, their copies beyond periodic sides, and who sees whom.

use rayon::prelude::*;
use tremie_numerics::{DMat3, DVec3};

use crate::{
    Dimension, Gradients, Image, Neighbours, Smoothing, Space, Standing, at_surface, copies, images,
};

/// Share of a lattice's neighbours below which a particle belongs to a thread or a spray: one third of them are around those in a thread of two rows, one half around the middle one of three.
const FEW: f64 = 0.4;

/// The mirror across a plane with this normal.
fn flipped(n: DVec3) -> DMat3 {
    DMat3::IDENTITY - 2.0 * DMat3::from_cols(n.x * n, n.y * n, n.z * n)
}

/// What particles or images of particles have of particles.
#[derive(Debug, Clone, Copy)]
pub struct Source {
    /// The particle.
    pub of: usize,
    /// Its velocity is `turn` times the particle's, and `carried` in m/s.
    pub turn: DMat3,
    /// What the wall adds to it.
    pub carried: DVec3,
    /// What mirrors make of vectors.
    pub mirror: DMat3,
    /// What walls that move add to velocities that mirrors turn.
    pub thrown: DVec3,
    /// How far mirrors have moved it from the particle, in m.
    pub off: DVec3,
    /// The wall that it is an image in.
    pub wall: Option<usize>,
}

impl Source {
    /// Its velocity gradient, by those of particles.
    pub fn gradient(&self, of: &[DMat3]) -> DMat3 {
        self.turn * of[self.of] * self.mirror.transpose()
    }
}

/// Particles, and their images behind them.
pub struct Seen {
    /// Places in m of particles, images and copies, in this order.
    pub positions: Vec<DVec3>,
    /// What each of them has of particles.
    pub sources: Vec<Source>,
    /// Images, which follow the particles; copies follow them.
    pub images: Vec<Image>,
}

impl Seen {
    /// What is seen as far as `reach` in m from particles in space at a time in s, of which walls move on in a step of `step` in s.
    pub fn new(particles: &[DVec3], space: &Space, time: f64, step: f64, reach: f64) -> Self {
        let (number, one) = (particles.len(), DMat3::IDENTITY);
        let mut positions = particles.to_vec();
        let own = |of: usize| Source {
            of,
            turn: one,
            carried: DVec3::ZERO,
            mirror: one,
            thrown: DVec3::ZERO,
            off: DVec3::ZERO,
            wall: None,
        };
        let mut sources: Vec<Source> = (0..number).into_par_iter().with_min_len(64).map(own).collect();
        let mirrored = images(particles, &space.standing(time), reach);
        for image in &mirrored {
            let number = image.wall as usize;
            let (parent, wall) = (sources[image.of as usize], &space.walls[number]);
            let velocity = wall.velocity(time - 0.5 * step, step);
            let seen = |u: DVec3| image.velocity(u, velocity, wall.slip_length);
            let still = seen(DVec3::ZERO);
            let turn =
                DMat3::from_cols(seen(DVec3::X) - still, seen(DVec3::Y) - still, seen(DVec3::Z) - still);
            let mirror = flipped(image.normal);
            sources.push(Source {
                turn: turn * parent.turn,
                carried: turn * parent.carried + still,
                mirror: mirror * parent.mirror,
                thrown: mirror * parent.thrown + 2.0 * velocity.dot(image.normal) * image.normal,
                off: image.at - particles[parent.of],
                wall: Some(number),
                ..parent
            });
            positions.push(image.at);
        }
        for copy in copies(&positions, space.low, space.high, space.periodic, reach) {
            sources.push(sources[copy.of as usize]);
            positions.push(positions[copy.of as usize] + copy.off);
        }
        Self { positions, sources, images: mirrored }
    }
}

/// Particles, their images behind them, and who is near whom.
pub struct Surroundings {
    /// A plane or space.
    pub dimension: Dimension,
    /// The kernel, as far as whose support particles are neighbours.
    pub kernel: Smoothing,
    /// Distance of particles in m.
    pub spacing: f64,
    /// What each stands for, in m3, or m2 in a plane.
    pub volume: f64,
    /// How many particles there are.
    pub number: usize,
    /// Places in m of particles, images and copies, in this order.
    pub positions: Vec<DVec3>,
    /// What each of them has of particles.
    pub sources: Vec<Source>,
    /// Images, which follow the particles; copies follow them.
    pub images: Vec<Image>,
    /// Who is near particles.
    pub near: Neighbours,
}

impl Surroundings {
    /// Those of particles in space at a time in s, of which walls move on in a step of `step` in s.
    pub fn new(particles: &[DVec3], space: &Space, time: f64, step: f64) -> Self {
        Self::with(space.kernel(), particles, space, time, step)
    }

    /// The same as seen with another kernel.
    pub fn with(kernel: Smoothing, particles: &[DVec3], space: &Space, time: f64, step: f64) -> Self {
        let (reach, number) = (kernel.support(), particles.len());
        let Seen { positions, sources, images } = Seen::new(particles, space, time, step, reach);
        let near = Neighbours::of_first(number, &positions, reach);
        let near = match space.walls.iter().any(|wall| wall.hides) {
            true => visible(&near, &positions, space, &space.standing(time), &images, number),
            false => near,
        };
        let (dimension, spacing, volume) = (space.dimension, space.spacing, space.volume());
        Self { dimension, kernel, spacing, volume, number, positions, sources, images, near }
    }

    /// Neighbours of a particle, images among them: number, way to it in m, and its source.
    pub fn around(&self, particle: usize) -> impl Iterator<Item = (usize, DVec3, &Source)> {
        let at = self.positions[particle];
        let near = self.near.of(particle).iter().map(|n| *n as usize);
        near.map(move |n| (n, self.positions[n] - at, &self.sources[n]))
    }

    /// The particle that one is, or that it is an image or copy of.
    #[inline]
    pub fn of(&self, n: usize) -> usize {
        if n < self.number { n } else { self.sources[n].of }
    }

    /// What an image or copy has of its particle; none of particles.
    #[inline]
    pub fn image(&self, n: usize) -> Option<&Source> {
        (n >= self.number).then(|| &self.sources[n])
    }

    /// The velocity gradient of a particle, image or copy, by those of particles.
    #[inline]
    pub fn gradient(&self, n: usize, of: &[DMat3]) -> DMat3 {
        self.image(n).map_or_else(|| of[n], |source| source.gradient(of))
    }

    /// What is told of each particle.
    pub fn each<T: Send>(&self, of: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..self.number).into_par_iter().with_min_len(64).map(of).collect()
    }

    /// The same into what there is of each.
    pub fn fill<T: Send>(&self, all: &mut [T], of: impl Fn(usize, &mut T) + Sync + Send) {
        all.par_iter_mut().with_min_len(64).enumerate().for_each(|(particle, to)| of(particle, to));
    }

    /// Integral over a lattice, its point in the middle included, of what depends on the distance in m from there.
    pub fn on_lattice(&self, of: impl Fn(f64) -> f64) -> f64 {
        let reach = (self.kernel.support() / self.spacing).ceil() as i32;
        let along = || (-reach..=reach).map(f64::from);
        let deep = move || if self.dimension == Dimension::Two { 0..=0 } else { -reach..=reach };
        let places = along().flat_map(move |x| {
            along().flat_map(move |z| deep().map(move |y| DVec3::new(x, f64::from(y), z)))
        });
        self.volume * places.map(|at| of(self.spacing * at.length())).sum::<f64>()
    }

    /// A value of all particles as images have it too.
    pub fn mirrored<T: Send>(&self, of: impl Fn(&Source) -> T + Sync + Send) -> Vec<T> {
        self.sources.par_iter().with_min_len(64).map(of).collect()
    }

    /// Velocities in m/s of all, images among them.
    pub fn velocities(&self, of: &[DVec3]) -> Vec<DVec3> {
        let image = |source: &Source| source.turn * of[source.of] + source.carried;
        of.iter().copied().chain(self.sources[self.number..].iter().map(image)).collect()
    }

    /// The same where images have what mirrors make of their velocities, as if no wall had friction: what is behind a wall is then without divergence if what is in front of it is. What images have for friction, odd along the wall and
    /// across it, is not. (Even across it, it would be, but nothing would keep fluid from going through.)
    pub fn reflected(&self, of: &[DVec3]) -> Vec<DVec3> {
        let image = |source: &Source| source.mirror * of[source.of] + source.thrown;
        of.iter().copied().chain(self.sources[self.number..].iter().map(image)).collect()
    }

    /// What gradients are formed with: exact for linear fields.
    pub fn gradients(&self) -> Gradients<'_> {
        let weight = |_, _, distance: f64| -self.volume * self.kernel.slope(distance) / distance;
        Gradients::new(&self.positions, &self.near, self.dimension, weight)
    }

    /// Which particles belong to threads and sprays: nothing around them holds a pressure.
    pub fn sprayed(&self) -> Vec<bool> {
        let reach = self.kernel.support();
        let all = self.on_lattice(|r| if r < reach { 1.0 } else { 0.0 }) / self.volume - 1.0;
        self.each(|a| (self.near.of(a).len() as f64) < FEW * all)
    }

    /// Which particles are at the free surface, by what gradients are formed with, or belong to threads and sprays.
    pub fn surface(&self, gradients: &Gradients) -> Vec<bool> {
        let surface = at_surface(gradients, self.kernel.support());
        surface.into_iter().zip(self.sprayed()).map(|(surface, sprayed)| surface || sprayed).collect()
    }
}

/// The neighbours that walls do not hide: particles on the other side of a wall, and images that are not behind their wall.
fn visible(
    near: &Neighbours,
    positions: &[DVec3],
    space: &Space,
    standing: &[Standing],
    images: &[Image],
    number: usize,
) -> Neighbours {
    let hiding = || space.walls.iter().zip(standing).filter(|(wall, _)| wall.hides).map(|(_, at)| at);
    let clear = |n: usize| hiding().map(|wall| wall.signed_distance(positions[n])).fold(f64::MAX, f64::min);
    let clear: Vec<f64> = (0..number).into_par_iter().with_min_len(64).map(clear).collect();
    near.only(|a, b| match images.get(b.wrapping_sub(number)) {
        // Nothing can stand between places that are as far from all walls together as from each other.
        None => {
            let far = |n: usize| clear.get(n).copied().unwrap_or(f64::MAX);
            let between = |wall: &Standing| wall.blocks(positions[a], positions[b]);
            far(a) + far(b) > positions[a].distance(positions[b]) || !hiding().any(between)
        }
        Some(image) => {
            let wall = image.wall as usize;
            !space.walls[wall].hides || image.is_seen_from(positions[a], &standing[wall])
        }
    })
}

#[cfg(test)]
mod tests {
    use tremie_geometry::{Body, Motion, Shape};

    use super::*;
    use crate::Wall;

    /// Fluid that sticks to a floor and is drawn along it, `u = c x z, w = -c z^2/2`, and is sheared besides: the divergence is what disorder leaves of it, and does not see the floor.
    #[test]
    fn walls_do_not_swell_fluid() {
        let (c, shear, spacing) = (3.0, 40.0, 0.05);
        let floor = Shape::HalfSpace { point: DVec3::ZERO, normal: DVec3::Z };
        let floor = Wall {
            body: Body::Shape(floor),
            motion: Motion::REST,
            sliding: DVec3::ZERO,
            slip_length: 0.0,
            hides: false,
        };
        let space = Space { walls: vec![floor], ..Space::free(Dimension::Two, spacing) };
        // Rows that lean, as they do where they slide along each other.
        let at = |n: usize| {
            let (i, k) = (n % 41, n / 41);
            spacing * DVec3::new(i as f64 - 20.0 + 0.3 * k as f64, 0.0, k as f64 + 0.5)
        };
        let positions: Vec<DVec3> = (0..41 * 12).map(at).collect();
        let velocity = |at: &DVec3| DVec3::new((c * at.x + shear) * at.z, 0.0, -0.5 * c * at.z * at.z);
        let around = Surroundings::new(&positions, &space, 0.0, 1.0);
        let velocities: Vec<DVec3> = positions.iter().map(velocity).collect();
        let gradients = around.gradients();
        let first: Vec<usize> =
            (0..positions.len()).filter(|n| positions[*n].abs().max_element() < 0.2).collect();
        let most = |of: &dyn Fn(usize) -> f64| first.iter().map(|n| of(*n).abs()).fold(0.0, f64::max);
        let divergence = |seen: Vec<DVec3>| {
            most(&|a| {
                let l = gradients.velocity_gradient(a, &seen);
                l.x_axis.x + l.z_axis.z
            })
        };
        let [told, odd] = [around.reflected(&velocities), around.velocities(&velocities)].map(divergence);
        assert!(odd > 0.2 * c * spacing && told < 0.5 * odd, "{told} {odd}");
    }

    /// A drop of five with nobody else around: the one in the middle has neighbours on all sides, and still nothing to press against. In the midst of a block it has.
    #[test]
    fn sprays_are_all_surface() {
        let spacing = 0.01;
        let surface = |positions: &[DVec3]| {
            let around = Surroundings::new(positions, &Space::free(Dimension::Two, spacing), 0.0, 1.0);
            around.surface(&around.gradients())
        };
        let cross =
            [DVec3::ZERO, DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z].map(|at| 1.2 * spacing * at);
        assert_eq!(surface(&cross), [true; 5]);
        let block: Vec<DVec3> =
            (0..49).map(|n| spacing * DVec3::new(f64::from(n % 7), 0.0, f64::from(n / 7))).collect();
        assert!(!surface(&block)[24] && surface(&block)[3]);
    }
}
