//! Flat faces through which something passes, such as the end of a hose.

use tremie_numerics::DVec3;

use crate::{Body, Shape};

/// A flat face, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Its middle.
    pub centre: DVec3,
    /// Where it looks, of unit length.
    pub direction: DVec3,
    /// Its outline.
    pub outline: Outline,
}

/// The outline of a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outline {
    /// A circle.
    Disc {
        /// Its radius.
        radius: f64,
    },
    /// A rectangle, the first side along x where the face looks straight up or down, and else horizontal.
    Rectangle {
        /// Its sides.
        size: [f64; 2],
    },
}

impl Face {
    /// Area in m2.
    pub fn area(&self) -> f64 {
        match self.outline {
            Outline::Disc { radius } => std::f64::consts::PI * radius * radius,
            Outline::Rectangle { size: [a, b] } => a * b,
        }
    }

    /// Its smallest extent.
    pub fn least_extent(&self) -> f64 {
        match self.outline {
            Outline::Disc { radius } => 2.0 * radius,
            Outline::Rectangle { size: [a, b] } => a.min(b),
        }
    }

    /// Two unit vectors in its plane, for a rectangle along its sides.
    fn sides(&self) -> [DVec3; 2] {
        let first = DVec3::Z.cross(self.direction).try_normalize().unwrap_or(DVec3::X);
        [first, self.direction.cross(first)]
    }

    /// A plate of a thickness behind it.
    pub fn plate(&self, thickness: f64) -> Body {
        let behind = |point: DVec3, normal: DVec3| Body::Shape(Shape::HalfSpace { point, normal });
        let mut cut = vec![behind(self.centre - thickness * self.direction, self.direction)];
        match self.outline {
            Outline::Disc { radius } => {
                let pipe = Shape::Cylinder { point: self.centre, axis: self.direction, radius };
                cut.push(Body::Complement(Box::new(Body::Shape(pipe))));
            }
            Outline::Rectangle { size } => {
                for (side, length) in self.sides().into_iter().zip(size) {
                    cut.extend([side, -side].map(|way| behind(self.centre + 0.5 * length * way, -way)));
                }
            }
        }
        Body::Difference(Box::new([behind(self.centre, self.direction), Body::Union(cut)]))
    }

    /// Smallest axis-parallel box around it and a plate of a thickness behind it, as its two corners.
    pub fn bounds(&self, thickness: f64) -> (DVec3, DVec3) {
        let [a, b] = self.sides();
        let reach = match self.outline {
            Outline::Disc { radius } => {
                let along = |axis: usize| radius * a[axis].hypot(b[axis]);
                DVec3::new(along(0), along(1), along(2))
            }
            Outline::Rectangle { size } => 0.5 * size[0] * a.abs() + 0.5 * size[1] * b.abs(),
        };
        let back = self.centre - thickness * self.direction;
        (self.centre.min(back) - reach, self.centre.max(back) + reach)
    }

    /// Points spread evenly over it.
    pub fn points(&self) -> impl Iterator<Item = DVec3> + '_ {
        const ALONG: usize = 64;
        let [a, b] = self.sides();
        let size = match self.outline {
            Outline::Disc { radius } => [2.0 * radius; 2],
            Outline::Rectangle { size } => size,
        };
        let at = |n: usize, length: f64| length * ((n as f64 + 0.5) / ALONG as f64 - 0.5);
        let place = move |n: usize| [at(n % ALONG, size[0]), at(n / ALONG, size[1])];
        let inside = |[x, y]: &[f64; 2]| match self.outline {
            Outline::Disc { radius } => x.hypot(*y) < radius,
            Outline::Rectangle { .. } => true,
        };
        (0..ALONG * ALONG).map(place).filter(inside).map(move |[x, y]| self.centre + x * a + y * b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DISC: Face = Face {
        centre: DVec3::new(0.1, 0.2, 0.3),
        direction: DVec3::NEG_Z,
        outline: Outline::Disc { radius: 0.05 },
    };

    #[test]
    fn a_plate_lies_behind_its_face() {
        let slanted = Face {
            direction: DVec3::new(0.6, 0.0, -0.8),
            outline: Outline::Rectangle { size: [0.1, 0.06] },
            ..DISC
        };
        for face in [DISC, slanted] {
            let plate = face.plate(0.02);
            let distance = |along: f64| plate.signed_distance(face.centre + along * face.direction);
            for (along, expected) in [(0.01, 0.01), (-0.005, -0.005), (-0.018, -0.002), (-0.03, 0.01)] {
                assert!((distance(along) - expected).abs() < 1e-12, "{along}: {}", distance(along));
            }
            let (min, max) = face.bounds(0.02);
            for p in face.points() {
                assert!(plate.signed_distance(p - 1e-6 * face.direction) < 0.0);
                assert!(p.cmpge(min - 1e-12).all() && p.cmple(max + 1e-12).all());
            }
        }
        // The first side of a rectangle is horizontal.
        let plate = slanted.plate(0.02);
        let beside = |y: f64| plate.signed_distance(slanted.centre - 0.01 * slanted.direction + DVec3::Y * y);
        assert!(beside(0.049) < 0.0 && beside(0.051) > 0.0);
    }

    #[test]
    fn points_cover_the_face_evenly() {
        let points: Vec<DVec3> = DISC.points().collect();
        let share = points.iter().filter(|p| p.x > DISC.centre.x).count() as f64 / points.len() as f64;
        assert!((share - 0.5).abs() < 1e-12);
        assert!((points.len() as f64 / 4096.0 / (DISC.area() / 0.01) - 1.0).abs() < 0.01);
    }
}
