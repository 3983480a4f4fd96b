//! Flat faces through which something passes, such as the end of a hose.

use std::f64::consts::{PI, TAU};

use tremie_numerics::DVec3;

use crate::{Body, Shape, Union};

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
            Outline::Disc { radius } => PI * radius * radius,
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

    /// The point of it that two numbers from 0 to 1 stand for: where these are uniform, so is it over the area. None beside a disc, in the corners
    /// of the square around it.
    pub fn point(&self, numbers: [f64; 2]) -> Option<DVec3> {
        let [a, b] = self.sides();
        let [x, y] = numbers.map(|x| x - 0.5);
        match self.outline {
            Outline::Disc { radius } => {
                let at = 2.0 * radius * (x * a + y * b);
                (at.length() <= radius).then_some(self.centre + at)
            }
            Outline::Rectangle { size } => Some(self.centre + x * size[0] * a + y * size[1] * b),
        }
    }

    /// Distance of a point from the wall that its outline would draw going straight on, positive within, and the normal of this wall, inwards.
    pub fn rim(&self, p: DVec3) -> (f64, DVec3) {
        let way = (p - self.centre).reject_from_normalized(self.direction);
        match self.outline {
            Outline::Disc { radius } => {
                let normal = (-way).try_normalize().unwrap_or(self.sides()[0]);
                (radius - way.length(), normal)
            }
            Outline::Rectangle { size } => {
                let [a, b] = self.sides();
                let side = |side: DVec3, length: f64| {
                    let at = way.dot(side);
                    (0.5 * length - at.abs(), -at.signum() * side)
                };
                let (one, two) = (side(a, size[0]), side(b, size[1]));
                if one.0 < two.0 { one } else { two }
            }
        }
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
        Body::Difference(Box::new([behind(self.centre, self.direction), Body::Union(Union::new(cut))]))
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

    /// Its outline as a polygon; a circle as one of many corners.
    fn corners(&self) -> Vec<DVec3> {
        const ROUND: usize = 128;
        let [a, b] = self.sides();
        let at = |x: f64, y: f64| self.centre + x * a + y * b;
        match self.outline {
            Outline::Disc { radius } => (0..ROUND)
                .map(|n| TAU * (n as f64 + 0.5) / ROUND as f64)
                .map(|angle| at(radius * angle.cos(), radius * angle.sin()))
                .collect(),
            Outline::Rectangle { size } => {
                let [x, y] = size.map(|length| 0.5 * length);
                vec![at(x, y), at(-x, y), at(-x, -y), at(x, -y)]
            }
        }
    }

    /// Share of its area that lies in the axis-parallel box between two corners (its polygon cut off at one side of the box
    /// after the other: Sutherland and Hodgman 1974).
    pub fn share_within(&self, min: DVec3, max: DVec3) -> f64 {
        let whole = self.corners();
        let mut polygon = whole.clone();
        for (axis, sign) in (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
            let limit = if sign > 0.0 { max[axis] } else { min[axis] };
            let within = |p: &DVec3| sign * (limit - p[axis]);
            let next = |n: usize| polygon[(n + 1) % polygon.len()];
            let mut cut = Vec::with_capacity(polygon.len() + 1);
            for (n, p) in polygon.iter().enumerate() {
                let (here, there) = (within(p), within(&next(n)));
                if here >= 0.0 {
                    cut.push(*p);
                }
                if here * there < 0.0 {
                    cut.push(p.lerp(next(n), here / (here - there)));
                }
            }
            polygon = cut;
        }
        area(&polygon) / area(&whole)
    }
}

/// Area of a plane polygon.
fn area(corners: &[DVec3]) -> f64 {
    let Some(first) = corners.first() else { return 0.0 };
    let triangles = corners.windows(2).map(|ends| (ends[0] - first).cross(ends[1] - first));
    0.5 * triangles.sum::<DVec3>().length()
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
            for p in face.corners() {
                let p = face.centre.lerp(p, 0.99);
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
    fn its_points_lie_within_its_rim() {
        let slanted = Face {
            direction: DVec3::new(0.6, 0.0, -0.8),
            outline: Outline::Rectangle { size: [0.1, 0.06] },
            ..DISC
        };
        for (face, share) in [(DISC, PI / 4.0), (slanted, 1.0)] {
            let numbers = (0..10_000).map(|n| [n % 100, n / 100].map(|x| (f64::from(x) + 0.5) / 100.0));
            let points: Vec<DVec3> = numbers.filter_map(|numbers| face.point(numbers)).collect();
            assert!((points.len() as f64 / 10_000.0 - share).abs() < 1e-3);
            let plate = face.plate(0.02);
            for p in points {
                // As far from the rim as it is within the plate, near enough to its edge.
                let (distance, normal) = face.rim(p + 0.3 * face.direction);
                let within = -plate.signed_distance(p - 0.01 * face.direction);
                assert!((distance.min(0.01) - within).abs() < 1e-12, "{distance} {within}");
                assert!(normal.dot(face.direction).abs() < 1e-12);
                assert!(face.rim(p - (distance + 0.001) * normal).0 < 0.0);
            }
        }
    }

    #[test]
    fn a_box_cuts_off_its_share() {
        let (low, high) = (DVec3::ZERO, DVec3::ONE);
        assert!((DISC.share_within(low, high) - 1.0).abs() < 1e-12);
        // Half beyond a side, a quarter in a corner, none outside; a face in a side belongs to the box.
        let centred = |x: f64, y: f64, z: f64| Face { centre: DVec3::new(x, y, z), ..DISC };
        assert!((centred(0.0, 0.2, 0.3).share_within(low, high) - 0.5).abs() < 1e-12);
        assert!((centred(1.0, 0.0, 1.0).share_within(low, high) - 0.25).abs() < 1e-12);
        assert_eq!(centred(0.5, 0.5, 1.1).share_within(low, high), 0.0);
        let wide = Face { outline: Outline::Rectangle { size: [3.0, 0.1] }, ..centred(0.2, 0.5, 0.5) };
        assert!((wide.share_within(low, high) - 1.0 / 3.0).abs() < 1e-12);
    }
}
