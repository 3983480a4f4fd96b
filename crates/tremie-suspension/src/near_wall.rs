//! Where a body is near walls.
//!
//! Planes are nearest to the ends of a fibre, and to the point of an ellipsoid furthest against their normal. Other walls are known by their signed distance only. The distance changes by no more than the way walked, so that along a fibre's segment it is safe to step by how far away the wall is
//! (sphere tracing, Hart 1996): no bar is missed, however long the fibre. What counts are the ends, and points between them
//! where the distance has a minimum. Where several walls meet, the nearest hides the others; therefore a body that has found one is moved
//! off it, asks again, and takes what it finds as a plane.

use tremie_numerics::DVec3;

use crate::distance::Outline;
use crate::{Wall, Walls};

/// A point of a body near a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Touch {
    /// Distance in m between surfaces, negative where they overlap.
    pub(crate) distance: f64,
    /// Unit normal out of the wall.
    pub(crate) normal: DVec3,
    /// Point halfway between the surfaces, from the body's centre.
    pub(crate) at: DVec3,
    /// Velocity in m/s of the wall there.
    pub(crate) velocity: DVec3,
}

/// Walls whose normals have a larger cosine between them are the same wall.
const SAME: f64 = 0.9;

/// All points of a body that are within `margin` of walls, wall by wall.
pub(crate) fn near_walls(body: &Outline, walls: &impl Walls, margin: f64, touches: &mut Vec<Touch>) {
    touches.clear();
    for flat in walls.flat() {
        let middle = flat.distance(body.centre);
        if middle - body.extent(flat.normal) > margin {
            continue;
        }
        let mut keep = |offset: DVec3, radius: f64| {
            let distance = middle + offset.dot(flat.normal) - radius;
            if distance <= margin {
                let at = offset - (radius + 0.5 * distance) * flat.normal;
                touches.push(Touch { distance, normal: flat.normal, at, velocity: flat.velocity });
            }
        };
        if body.ellipsoid.is_some() {
            keep(body.furthest(-flat.normal), 0.0);
        } else {
            keep(-body.half, body.radius);
            if body.half != DVec3::ZERO {
                keep(body.half, body.radius);
            }
        }
    }
    let planes = touches.len();
    let half = body.half.length();
    // Most bodies are far from all walls.
    let reach = if body.ellipsoid.is_some() { body.reach() } else { half + body.radius };
    if walls.nearest(body.centre, reach + margin).is_none() {
        return;
    }
    let mut off = DVec3::ZERO;
    for _ in 0..4 {
        let known = touches.len();
        let mut keep = |offset: DVec3, radius: f64, wall: Wall| {
            let distance = wall.distance - off.dot(wall.normal) - radius;
            let at = offset - (radius + 0.5 * distance) * wall.normal;
            let same = |touch: &Touch| {
                touch.normal.dot(wall.normal) > SAME && (touch.at - at).length() < body.thickness
            };
            if distance <= margin && !touches[planes..known].iter().any(same) {
                touches.push(Touch { distance, normal: wall.normal, at, velocity: wall.velocity });
            }
        };
        if body.ellipsoid.is_some() {
            if let Some((offset, wall)) = nearest_of_ellipsoid(body, off, walls, reach + margin) {
                keep(offset, 0.0, wall);
            }
        } else {
            let within = body.radius + margin + off.length();
            along(body.centre + off, body.half, 2.0 * body.radius, within, walls, |way, wall| {
                keep(way, body.radius, wall);
            });
        }
        if touches.len() == known {
            return;
        }
        for new in known..touches.len() {
            let Touch { normal, distance, .. } = touches[new];
            // Far enough that a wall at 60 degrees or more to this one is nearer now, if it is within the margin at all.
            if !touches[planes..new].iter().any(|touch| touch.normal.dot(normal) > SAME) {
                off += 2.0 * (margin - distance) * normal;
            }
        }
    }
}

/// Ends and minima of the distance along a segment, as far as they are nearer than `within`: each by its way from the centre.
fn along(
    centre: DVec3,
    half: DVec3,
    thickness: f64,
    within: f64,
    walls: &impl Walls,
    mut found: impl FnMut(DVec3, Wall),
) {
    let length = 2.0 * half.length();
    if length == 0.0 {
        if let Some(wall) = walls.nearest(centre, within) {
            found(DVec3::ZERO, wall);
        }
        return;
    }
    let along = 2.0 * half / length;
    let way = |s: f64| (s - 0.5 * length) * along;
    // A bar that reaches deeper than a hundredth of a thickness is wider than this, if its radius is more than four.
    let fine = thickness.max(length / 64.0);
    let mut s = 0.0;
    let mut before: Option<(f64, Wall)> = None;
    loop {
        // Nothing further away matters before the end.
        let Some(wall) = walls.nearest(centre + way(s), within + length) else { return };
        if let Some((last, past)) = before
            && past.normal.dot(along) < 0.0
            && wall.normal.dot(along) > 0.0
            && past.distance.min(wall.distance) <= within + fine
        {
            let (mut low, mut high, mut least) = (last, s, past);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                let Some(there) = walls.nearest(centre + way(middle), within + length) else { break };
                least = there;
                if there.normal.dot(along) < 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
                if high - low < 1e-9 * length {
                    break;
                }
            }
            if least.distance <= within {
                found(way(0.5 * (low + high)), least);
            }
        }
        if (s == 0.0 || s == length) && wall.distance <= within {
            found(way(s), wall);
        }
        if s == length {
            return;
        }
        before = Some((s, wall));
        s = (s + (wall.distance - within).max(fine)).min(length);
    }
}

/// The point of an ellipsoid's surface nearest to a wall, from its centre: down the gradient of the distance to the furthest point
/// (Frank and Wolfe 1956), as far as the distance falls.
fn nearest_of_ellipsoid(
    body: &Outline,
    off: DVec3,
    walls: &impl Walls,
    within: f64,
) -> Option<(DVec3, Wall)> {
    let ask = |at: DVec3| walls.nearest(body.centre + off + at, within + off.length());
    let mut at = DVec3::ZERO;
    let mut wall = ask(at)?;
    for _ in 0..40 {
        let goal = body.furthest(-wall.normal);
        let way = goal - at;
        let (mut low, mut high) = (0.0, 1.0);
        let there = ask(goal)?;
        if there.normal.dot(way) > 0.0 {
            // The distance rises again before the goal.
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if ask(at + middle * way)?.normal.dot(way) > 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
        } else {
            low = 1.0;
        }
        let gain = -wall.normal.dot(way);
        at += low * way;
        wall = ask(at)?;
        if gain < 1e-9 * within {
            break;
        }
    }
    Some((at, wall))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Flat, Form};
    use tremie_numerics::DQuat;

    /// A floor and a side, as planes or by the distance from the nearer.
    struct Corner {
        planes: [Flat; 2],
        flat: bool,
    }

    impl Walls for Corner {
        fn flat(&self) -> &[Flat] {
            if self.flat { &self.planes } else { &[] }
        }

        fn nearest(&self, at: DVec3, within: f64) -> Option<Wall> {
            let wall = |flat: &Flat| Wall {
                distance: flat.distance(at),
                normal: flat.normal,
                velocity: flat.velocity,
            };
            let nearest = self.planes.iter().map(wall).min_by(|a, b| a.distance.total_cmp(&b.distance));
            nearest.filter(|wall| !self.flat && wall.distance < within)
        }
    }

    #[test]
    fn planes_are_touched_where_walls_by_their_distance_are() {
        let plane = |normal, place| Flat { normal, place, velocity: DVec3::X };
        let corner = |flat| Corner { planes: [plane(DVec3::Z, 0.1), plane(DVec3::NEG_Y, -0.3)], flat };
        let forms = [
            Form::Sphere { diameter: 0.02 },
            Form::Fibre { length: 0.06, diameter: 0.002 },
            Form::Ellipsoid { half_axes: DVec3::new(0.004, 0.006, 0.01) },
        ];
        let mut touched = 0;
        for n in 0..400 {
            let share = |root: f64| (f64::from(n) * root).fract();
            let centre = DVec3::new(0.0, 0.3 - 0.035 * share(2f64.sqrt()), 0.1 + 0.035 * share(3f64.sqrt()));
            let turn = DQuat::from_rotation_arc(
                DVec3::Z,
                DVec3::new(share(5f64.sqrt()) - 0.5, share(7f64.sqrt()) - 0.5, 0.3).normalize(),
            );
            let outline = Outline::new(&forms[n as usize % 3], centre, turn);
            let [planes, others] = [true, false].map(|flat| {
                let mut touches = Vec::new();
                near_walls(&outline, &corner(flat), 0.003, &mut touches);
                touches.sort_by(|a, b| (a.normal.z, a.at.x).partial_cmp(&(b.normal.z, b.at.x)).unwrap());
                touches
            });
            touched += planes.len();
            // Frank and Wolfe's way down the distance from an ellipsoid ends within a share of this.
            let off = if outline.ellipsoid.is_some() { 1e-4 } else { 1e-12 };
            for other in &others {
                let found = planes.iter().any(|own| {
                    (own.distance - other.distance).abs() < off && (own.at - other.at).length() < 10.0 * off
                });
                assert!(found, "{n}: {other:?} in {planes:?}");
            }
            for own in planes.iter().filter(|own| own.distance < 0.003 - off) {
                let found = others.iter().any(|other| own.normal.dot(other.normal) > 0.99);
                assert!(found, "{n}: {own:?} in {others:?}");
            }
        }
        assert!(touched > 100, "{touched}");
    }
}
