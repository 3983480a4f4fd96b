//! Walls as mirrors: nodes behind them that continue the fluid.
//!
//! A node at the distance d from a wall has a mirror image at `x - 2 d n`, n pointing out of the wall. Where walls meet, what lies behind one of them is mirrored by the next, too:
//! in a corner of right angles the images fill all of the space behind, as if the nodes' lattice went on.
//!
//! What the image moves with says how the fluid slides along the wall: for the slip length lambda (Navier), the speed along the wall is `u (lambda - d)/(lambda + d)`, both
//! against the wall: -u without slip, u without friction, 0 for lambda = d, which is what Wu (2016) takes for partial slip and so
//! depends on the nodes' spacing. Across the wall it is -u: nothing goes through.

use rayon::prelude::*;
use tremie_geometry::Body;
use tremie_numerics::DVec3;

/// A wall where it is at a moment.
#[derive(Debug, Clone, Copy)]
pub struct Standing<'a> {
    /// Where it is drawn.
    pub body: &'a Body,
    /// How far from there it is, in m.
    pub offset: DVec3,
    /// Whether nodes are in a plane, in which then its images are, too.
    pub flat: bool,
}

impl Standing<'_> {
    /// Distance of a place in m from it, negative inside, and the unit vector out of it there.
    pub fn nearest(&self, at: DVec3) -> (f64, DVec3) {
        let (distance, normal) = self.body.nearest(at - self.offset);
        (distance, if self.flat { normal.with_y(0.0).normalize_or_zero() } else { normal })
    }

    /// Distance of a place in m from it, negative inside.
    pub fn signed_distance(&self, at: DVec3) -> f64 {
        self.body.signed_distance(at - self.offset)
    }

    /// Whether it stands between two places in m outside of it; what is thinner than a hundredth of their distance is not seen.
    pub fn blocks(&self, from: DVec3, to: DVec3) -> bool {
        let length = from.distance(to);
        let way = (to - from) / length;
        // As far as nothing can be in the way, again and again.
        let mut gone = 0.0;
        while gone < length {
            let distance = self.signed_distance(from + gone * way);
            if distance < 0.0 {
                return true;
            }
            gone += distance.max(0.01 * length);
        }
        false
    }
}

/// The image of a node in a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Image {
    /// Whose image it is, by number: of a node, or, from the number of nodes on, of an earlier image.
    pub of: u32,
    /// The wall, by its place in the list.
    pub wall: u32,
    /// Where it is, in m.
    pub at: DVec3,
    /// The wall's normal there, out of it.
    pub normal: DVec3,
    /// Distance in m of the image and of what it is the image of from the wall.
    pub distance: f64,
}

impl Image {
    /// Whether a node sees it: from in front of the wall's plane there, and through the wall.
    pub fn is_seen_from(&self, at: DVec3, wall: &Standing) -> bool {
        let foot = self.at + self.distance * self.normal;
        (at - foot).dot(self.normal) > 0.0 && wall.blocks(at, self.at)
    }

    /// How it moves, if what it is the image of moves with `u` and the wall with `wall`, in m/s, and fluid slides by the length `slip` in m, which may be infinite.
    pub fn velocity(&self, u: DVec3, wall: DVec3, slip: f64) -> DVec3 {
        let against = u - wall;
        let across = against.dot(self.normal) * self.normal;
        let kept = if slip.is_infinite() { 1.0 } else { (slip - self.distance) / (slip + self.distance) };
        wall + kept * (against - across) - across
    }
}

/// The images of all nodes that are nearer than `reach` in m to the surface of walls; those of a node follow each other.
///
/// Nodes within a wall have none there. The image may lie behind a thin wall, where other nodes are: [`Image::is_seen_from`] tells who sees it.
pub fn images(positions: &[DVec3], walls: &[Standing], reach: f64) -> Vec<Image> {
    let of = |n: usize| -> Vec<Image> {
        let mut found: Vec<Image> = Vec::new();
        for (number, wall) in (0..).zip(walls) {
            for parent in 0..=found.len() {
                let at = if parent == 0 { positions[n] } else { found[parent - 1].at };
                let (distance, normal) = wall.nearest(at);
                if distance <= 0.0 || distance >= reach {
                    continue;
                }
                // Numbers within the node's own images for now.
                let image = at - 2.0 * distance * normal;
                found.push(Image { of: parent as u32, wall: number, at: image, normal, distance });
            }
        }
        found
    };
    let lists: Vec<Vec<Image>> = (0..positions.len()).into_par_iter().with_min_len(64).map(of).collect();
    let mut all = Vec::new();
    for (n, list) in (0..).zip(lists) {
        let first = (positions.len() + all.len()) as u32;
        all.extend(
            list.into_iter()
                .map(|image| Image { of: if image.of == 0 { n } else { first + image.of - 1 }, ..image }),
        );
    }
    all
}

#[cfg(test)]
mod tests {
    use tremie_geometry::Shape;

    use super::*;
    use crate::{Dimension, Kernel, Neighbours, Smoothing, nodes};

    fn standing(bodies: &[Body]) -> Vec<Standing<'_>> {
        bodies.iter().map(|body| Standing { body, offset: DVec3::ZERO, flat: false }).collect()
    }

    /// The walls of a tank that is open at the top and 0.2 m wide.
    fn tank(dimension: Dimension) -> Vec<Body> {
        let wall = |point, normal| Body::Shape(Shape::HalfSpace { point, normal });
        let mut walls = vec![
            wall(DVec3::ZERO, DVec3::X),
            wall(DVec3::splat(0.2), DVec3::NEG_X),
            wall(DVec3::ZERO, DVec3::Z),
        ];
        if dimension == Dimension::Three {
            walls.extend([wall(DVec3::ZERO, DVec3::Y), wall(DVec3::splat(0.2), DVec3::NEG_Y)]);
        }
        walls
    }

    /// At flat walls, along edges and in corners the sums of kernels are those in the midst of the lattice.
    #[test]
    fn the_lattice_goes_on_behind_walls() {
        for dimension in [Dimension::Two, Dimension::Three] {
            let spacing = 0.02;
            let full = Body::Shape(Shape::Box { min: DVec3::ZERO, max: DVec3::splat(0.2) });
            let fluid = nodes(&full, spacing, dimension, 0.1);
            let kernel = Smoothing::new(Kernel::Wendland, dimension, 1.3 * spacing);
            let mut all = fluid.clone();
            let images = images(&fluid, &standing(&tank(dimension)), kernel.support());
            all.extend(images.iter().map(|image| image.at));
            let near = Neighbours::within(&all, kernel.support());
            let sum = |n: usize| -> f64 {
                near.of(n).iter().map(|j| kernel.weight(all[*j as usize].distance(all[n]))).sum()
            };
            let below = |at: &DVec3| at.z < 0.2 - kernel.support();
            let inside = (0..fluid.len()).filter(|n| below(&fluid[*n])).map(sum);
            let (low, high) =
                inside.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
            assert!(high > 0.0 && high / low - 1.0 < 1e-9, "{dimension:?}: {low} {high}");
        }
    }

    #[test]
    fn images_continue_profiles_with_slip() {
        // At the floor z = 0, u = rate (z + slip) along x, and something through the floor.
        let wall = DVec3::new(0.3, -0.1, 0.0);
        for slip in [0.0, 0.004, 0.01, 0.5] {
            let at = DVec3::new(0.1, 0.0, 0.01);
            let images = images(&[at], &standing(&tank(Dimension::Two)), 0.05);
            assert_eq!((images.len(), images[0].of, images[0].at), (1, 0, at * DVec3::new(1.0, 1.0, -1.0)));
            let profile = |z: f64| wall + DVec3::new(7.0 * (z + slip), 0.0, 3.0 * z);
            let found = images[0].velocity(profile(at.z), wall, slip);
            assert!((found - profile(-at.z)).length() < 1e-14, "{slip}");
        }
        let image = images(&[DVec3::new(0.1, 0.0, 0.01)], &standing(&tank(Dimension::Two)), 0.05)[0];
        let u = DVec3::new(1.0, 0.5, 2.0);
        assert_eq!(image.velocity(u, DVec3::ZERO, f64::INFINITY), DVec3::new(1.0, 0.5, -2.0));
        assert_eq!(image.velocity(u, DVec3::ZERO, 0.01), DVec3::new(0.0, 0.0, -2.0));
    }

    #[test]
    fn images_of_images_know_whose_they_are() {
        let at = [DVec3::new(0.1, 0.0, 0.1), DVec3::new(0.01, 0.0, 0.02)];
        let found = images(&at, &standing(&tank(Dimension::Two)), 0.05);
        let parents: Vec<(u32, u32)> = found.iter().map(|image| (image.of, image.wall)).collect();
        assert_eq!(parents, [(1, 0), (1, 2), (2, 2)]);
        assert!((found[2].at - DVec3::new(-0.01, 0.0, -0.02)).length() < 1e-15);
    }

    /// A plate thinner than the node is far from it shows its image behind it, but only to nodes in front.
    #[test]
    fn images_are_seen_through_their_wall_only() {
        let plate = Shape::Box { min: DVec3::new(0.0, -1.0, 0.0), max: DVec3::new(0.005, 1.0, 1.0) };
        let plate = Body::Shape(plate);
        let plate = Standing { body: &plate, offset: DVec3::ZERO, flat: true };
        let image = images(&[DVec3::new(-0.01, 0.0, 0.5)], &[plate], 0.05)[0];
        assert!((image.at - DVec3::new(0.01, 0.0, 0.5)).length() < 1e-15);
        let seen = |x: f64, z: f64| image.is_seen_from(DVec3::new(x, 0.0, z), &plate);
        assert!(seen(-0.002, 0.5) && seen(-0.03, 0.51) && !seen(0.006, 0.5) && !seen(0.012, 0.52));
        // From above its end one looks past it.
        let image = images(&[DVec3::new(-0.01, 0.0, 0.99)], &[plate], 0.05)[0];
        assert!(!image.is_seen_from(DVec3::new(-0.001, 0.0, 1.02), &plate));
        assert!(plate.blocks(DVec3::new(-0.01, 0.0, 0.5), DVec3::new(0.01, 0.0, 0.5)));
        assert!(!plate.blocks(DVec3::new(-0.01, 0.0, 1.001), DVec3::new(0.01, 0.0, 1.001)));
        assert!(!plate.blocks(DVec3::new(-0.01, 0.0, 0.5), DVec3::new(-0.001, 0.0, 0.5)));
    }
}
