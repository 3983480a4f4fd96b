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
/// Nodes within a wall have none there, nor have those for which a wall is too thin to hold the image.
pub fn images(positions: &[DVec3], walls: &[Body], reach: f64) -> Vec<Image> {
    let of = |n: usize| -> Vec<Image> {
        let mut found: Vec<Image> = Vec::new();
        for (wall, body) in (0..).zip(walls) {
            for parent in 0..=found.len() {
                let at = if parent == 0 { positions[n] } else { found[parent - 1].at };
                let (distance, normal) = body.nearest(at);
                if distance <= 0.0 || distance >= reach {
                    continue;
                }
                let image = at - 2.0 * distance * normal;
                if body.signed_distance(image) < 0.0 {
                    // Numbers within the node's own images for now.
                    found.push(Image { of: parent as u32, wall, at: image, normal, distance });
                }
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

    /// The walls of a tank that is open at the top, y, and is 0.2 m wide.
    fn tank(dimension: Dimension) -> Vec<Body> {
        let wall = |point, normal| Body::Shape(Shape::HalfSpace { point, normal });
        let mut walls = vec![
            wall(DVec3::ZERO, DVec3::X),
            wall(DVec3::splat(0.2), DVec3::NEG_X),
            wall(DVec3::ZERO, DVec3::Y),
        ];
        if dimension == Dimension::Three {
            walls.extend([wall(DVec3::ZERO, DVec3::Z), wall(DVec3::splat(0.2), DVec3::NEG_Z)]);
        }
        walls
    }

    /// At flat walls, along edges and in corners the sums of kernels are those in the midst of the lattice.
    #[test]
    fn the_lattice_goes_on_behind_walls() {
        for dimension in [Dimension::Two, Dimension::Three] {
            let spacing = 0.02;
            let full = Body::Shape(Shape::Box { min: DVec3::ZERO, max: DVec3::splat(0.2) });
            let fluid = nodes(&full, spacing, dimension);
            let kernel = Smoothing::new(Kernel::Wendland, dimension, 1.3 * spacing);
            let mut all = fluid.clone();
            let images = images(&fluid, &tank(dimension), kernel.support());
            all.extend(images.iter().map(|image| image.at));
            let near = Neighbours::within(&all, kernel.support());
            let sum = |n: usize| -> f64 {
                near.of(n).iter().map(|j| kernel.weight(all[*j as usize].distance(all[n]))).sum()
            };
            let below = |at: &DVec3| at.y < 0.2 - kernel.support();
            let inside = (0..fluid.len()).filter(|n| below(&fluid[*n])).map(sum);
            let (low, high) =
                inside.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
            assert!(high > 0.0 && high / low - 1.0 < 1e-9, "{dimension:?}: {low} {high}");
        }
    }

    #[test]
    fn images_continue_profiles_with_slip() {
        // At the floor y = 0, u = rate (y + slip) along x, and something through the floor.
        let wall = DVec3::new(0.3, 0.0, -0.1);
        for slip in [0.0, 0.004, 0.01, 0.5] {
            let at = DVec3::new(0.1, 0.01, 0.0);
            let images = images(&[at], &tank(Dimension::Two), 0.05);
            assert_eq!((images.len(), images[0].of, images[0].at), (1, 0, at * DVec3::new(1.0, -1.0, 1.0)));
            let profile = |y: f64| wall + DVec3::new(7.0 * (y + slip), 3.0 * y, 0.0);
            let found = images[0].velocity(profile(at.y), wall, slip);
            assert!((found - profile(-at.y)).length() < 1e-14, "{slip}");
        }
        let image = images(&[DVec3::new(0.1, 0.01, 0.0)], &tank(Dimension::Two), 0.05)[0];
        let u = DVec3::new(1.0, 2.0, 0.5);
        assert_eq!(image.velocity(u, DVec3::ZERO, f64::INFINITY), DVec3::new(1.0, -2.0, 0.5));
        assert_eq!(image.velocity(u, DVec3::ZERO, 0.01), DVec3::new(0.0, -2.0, 0.0));
    }

    #[test]
    fn images_of_images_know_whose_they_are() {
        let at = [DVec3::new(0.1, 0.1, 0.0), DVec3::new(0.01, 0.02, 0.0)];
        let found = images(&at, &tank(Dimension::Two), 0.05);
        let parents: Vec<(u32, u32)> = found.iter().map(|image| (image.of, image.wall)).collect();
        assert_eq!(parents, [(1, 0), (1, 2), (2, 2)]);
        assert!((found[2].at - DVec3::new(-0.01, -0.02, 0.0)).length() < 1e-15);
        // A plate thinner than the node is far from it shows nothing.
        let plate = Shape::Box { min: DVec3::new(0.0, 0.0, -1.0), max: DVec3::new(0.005, 1.0, 1.0) };
        assert!(images(&[DVec3::new(-0.01, 0.5, 0.0)], &[Body::Shape(plate)], 0.05).is_empty());
    }
}
