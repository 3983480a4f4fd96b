//! Bodies made from shapes by the algebra of sets.
//!
//! The union's distance is the least, the difference's the larger of the one and the other turned inside out. Both are right where they
//! matter, on the surface, and nowhere larger than the true distance.

use std::sync::Arc;

use tremie_numerics::DVec3;

use crate::Shape;
use crate::mesh::ClosedMesh;
use crate::tree::Tree;

/// A closed region of space, in metres.
#[derive(Debug, Clone, PartialEq)]
pub enum Body {
    /// A primitive shape.
    Shape(Shape),
    /// What a triangle mesh bounds.
    Mesh(Arc<ClosedMesh>),
    /// All that lies outside of this: of the inside of a mould, the mould, without end.
    Complement(Box<Body>),
    /// All that lies in any of several.
    Union(Union),
    /// All that lies in the first but not in the second.
    Difference(Box<[Body; 2]>),
}

impl Body {
    /// Signed distance in metres from `p` to the surface, negative inside: exact near the surface, and nowhere further from zero
    /// than the true distance.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        self.nearest(p).0
    }

    /// The same, and the unit normal of the surface that is nearest, out of the body.
    pub fn nearest(&self, p: DVec3) -> (f64, DVec3) {
        match self {
            Self::Shape(shape) => shape.nearest(p),
            Self::Mesh(mesh) => mesh.nearest(p),
            Self::Complement(body) => {
                let (distance, normal) = body.nearest(p);
                (-distance, -normal)
            }
            Self::Union(union) => union.nearest(p),
            Self::Difference(bodies) => {
                let [from, without] = &**bodies;
                let (one, (distance, normal)) = (from.nearest(p), without.nearest(p));
                if one.0 >= -distance { one } else { (-distance, -normal) }
            }
        }
    }

    /// Of the volume between the surface and the cells of a lattice whose centres are outside, over that of a cell, what is in the column through the centre `p` of such a cell along the way `to_next` in m to the next, whose centre is inside.
    ///
    /// At the distance q along the column from the last centre the surface leaves q - 1/2. The sum over all columns along any axis is the volume by which the body is smaller than its cells; here each axis counts by as much of the
    /// surface as is across it, n^2, so that all ways together tell it once, near edges too.
    pub fn left_in_column(&self, p: DVec3, to_next: DVec3) -> f64 {
        // Of the surface that the way meets, and not another that is nearer.
        let middle = p + 0.5 * to_next;
        let (distance, normal) = self.nearest(middle);
        let across = -normal.dot(to_next);
        if across <= 0.0 {
            return 0.0;
        }
        let way = (distance / across + 0.5).clamp(0.0, 1.0);
        across * across / to_next.length_squared() * (way - 0.5)
    }

    /// An axis-parallel box around the body, as its two corners; infinite along an infinite axis.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        match self {
            Self::Shape(shape) => shape.bounds(),
            Self::Mesh(mesh) => mesh.bounds(),
            Self::Complement(_) => (DVec3::NEG_INFINITY, DVec3::INFINITY),
            Self::Union(union) => union.tree.bounds(),
            Self::Difference(bodies) => bodies[0].bounds(),
        }
    }
}

/// Bodies as one: of many, such as the bars of a cage, only those near a point are asked for their distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Union {
    bodies: Vec<Body>,
    tree: Tree,
}

impl Union {
    /// Of these bodies, at least one.
    pub fn new(bodies: Vec<Body>) -> Self {
        let boxes: Vec<[DVec3; 2]> = bodies.iter().map(|body| body.bounds().into()).collect();
        Self { tree: Tree::new(&boxes), bodies }
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    fn nearest(&self, p: DVec3) -> (f64, DVec3) {
        // Squares, as the tree has them, with the sign of the distance.
        let signed = |n: usize| {
            let found = self.bodies[n].nearest(p);
            (found.0 * found.0.abs(), found)
        };
        self.tree.nearest(p, signed).map_or((f64::INFINITY, DVec3::Z), |(_, found)| found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_with_a_hole_is_one_where_it_is_solid() {
        let plate = Shape::Box { min: DVec3::splat(-1.0), max: DVec3::new(1.0, 1.0, 0.0) };
        let hole = Shape::Cylinder { point: DVec3::ZERO, axis: DVec3::Z, radius: 0.5 };
        let knob = Shape::Sphere { centre: DVec3::new(0.8, 0.8, 0.0), radius: 0.1 };
        let pierced = Body::Difference(Box::new([Body::Shape(plate), Body::Shape(hole)]));
        let body = Body::Union(Union::new(vec![pierced, Body::Shape(knob)]));
        for (x, z, inside) in [(0.0, -0.5, false), (0.7, -0.5, true), (1.2, -0.5, false), (0.7, 0.1, false)] {
            assert_eq!(body.signed_distance(DVec3::new(x, 0.0, z)) < 0.0, inside, "{x} {z}");
        }
        assert!(body.signed_distance(DVec3::new(0.8, 0.8, 0.05)) < 0.0);
        // Half-way between two faces and the hole: the hole is nearest, and the body's normal points into it.
        let (distance, normal) = body.nearest(DVec3::new(0.6, 0.0, -0.5));
        assert!(
            (distance + 0.1).abs() < 1e-15 && (normal + DVec3::X).length() < 1e-15,
            "{distance} {normal}"
        );
        assert_eq!(body.bounds(), (DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.1)));
    }

    /// Of cells outside a sphere and a box, and what these leave beside them.
    #[test]
    fn columns_tell_what_cells_leave_out() {
        let size = 0.1;
        let radius = 0.437;
        let ball = Shape::Sphere { centre: DVec3::new(0.013, -0.02, 0.031), radius };
        let half = DVec3::new(0.33, 0.53, 0.48);
        let block = Shape::Box { min: -half, max: half };
        let volume = |shape: Shape, n: i32| {
            let body = Body::Shape(shape);
            let places = || (-n..n).map(|i| size * (f64::from(i) + 0.5));
            let (mut outside, mut left) = (0.0, 0.0);
            for p in
                places().flat_map(|x| places().flat_map(move |y| places().map(move |z| DVec3::new(x, y, z))))
            {
                if body.signed_distance(p) < 0.0 {
                    continue;
                }
                outside += 1.0;
                for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                    for to_next in [size * axis, -size * axis] {
                        if body.signed_distance(p + to_next) < 0.0 {
                            left += body.left_in_column(p, to_next);
                        }
                    }
                }
            }
            [outside, left].map(|cells| cells * size.powi(3))
        };
        let ball_takes = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let block_takes = 8.0 * half.element_product();
        // Right but for how surfaces bend within a cell, and where edges are.
        let bent = 0.2 * (size / radius).powi(2);
        for (shape, takes, most) in [(ball, ball_takes, bent), (block, block_takes, 0.02)] {
            let [cells, left] = volume(shape, 10);
            let off = (8.0 - cells - left) / takes - 1.0;
            assert!(off.abs() < most, "{shape:?}: {off}, and {left} m3 of {takes}");
            if shape == block {
                assert!(left.abs() > 0.05 * takes, "{left} m3 of {takes}");
            }
        }
    }

    #[test]
    fn a_cage_of_many_bars_is_as_near_as_its_nearest_bar() {
        let bar = |i: usize, j: usize| {
            let start = DVec3::new(0.05 * i as f64, 0.07 * j as f64, 0.0);
            Shape::Bar { start, end: start + DVec3::new(0.0, 0.1, 0.5), radius: 0.006 + 1e-4 * i as f64 }
        };
        let bars: Vec<Shape> = (0..150).map(|n| bar(n % 15, n / 15)).collect();
        let column = Shape::Cylinder { point: DVec3::new(0.3, 0.3, 0.0), axis: DVec3::Z, radius: 0.03 };
        let all = [&bars[..], &[column]].concat();
        let union = Body::Union(Union::new(all.iter().map(|shape| Body::Shape(*shape)).collect()));
        for n in 0..4000 {
            let at = |step: f64| -0.1 + (n as f64 * step).fract();
            let p = DVec3::new(at(0.618), at(0.414), at(0.732));
            let nearest = all.iter().map(|shape| shape.signed_distance(p)).fold(f64::INFINITY, f64::min);
            assert_eq!(union.signed_distance(p), nearest, "{p}");
        }
        assert_eq!(union.bounds().1.z, f64::INFINITY);
    }
}
