//! Spread of a cake of fluid on the floor, as in EN 12350-8, in m.
//!
//! The front along a ray from the spread axis is found from the outermost point where the cover of the columns is one half. At a
//! steep front that is the front itself, within a tenth of a cell. (Taken from the column heights instead,
//! a steep front would lie half a cell too far out, since a sliver of a tall column holds as much as a film.)
//!
//! Where the body thins out, the film is still half a cell thick there, and a grid cannot tell a thinner one from nothing. A
//! yield-stress fluid at rest thins out as the root of the distance s to its front, `h^2 = 2 tau_y s / (rho g)`
//! (Liu and Mei 1989; Roussel and Coussot 2005), whatever its yield stress; so the front lies a third of the distance between the heights
//! of one and one half cell further out. Without this a sheet of 20 Pa in cells of 5 mm reads 1 % too small.
//! At a steep front the height of one cell is no further in, and nothing is added.
//!
//! A front that stands against a wall of the domain is at the wall.

use std::f64::consts::TAU;

use rayon::prelude::*;
use tremie_numerics::DVec2;

use crate::Cells;
use crate::plan::Plan;

/// Rays over the full circle; a multiple of eight, so that the diameters at 45 and 90 degrees are among them.
const RAYS: usize = 72;

/// Spread and height around a vertical axis, all in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Mean diameter over all directions.
    pub mean: f64,
    /// Diameter along x.
    pub x: f64,
    /// Diameter along y.
    pub y: f64,
    /// Mean of the two diameters at 45 degrees between x and y.
    pub diagonal: f64,
    /// Twice the largest radius.
    pub max: f64,
    /// Height of the fluid on the axis.
    pub height: f64,
}

impl Spread {
    /// Measures the spread around the vertical axis through `centre` (x, y in m).
    pub(super) fn measure(cells: &Cells, height: &Plan, centre: DVec2) -> Self {
        let cover = Plan::cover(cells);
        let radius =
            |n: usize| front(&cover, height, centre, DVec2::from_angle(TAU * n as f64 / RAYS as f64));
        let radii: Vec<f64> = (0..RAYS).into_par_iter().map(radius).collect();
        let diameter = |n: usize| radii[n] + radii[n + RAYS / 2];
        Self {
            mean: 2.0 * radii.iter().sum::<f64>() / RAYS as f64,
            x: diameter(0),
            y: diameter(RAYS / 4),
            diagonal: 0.5 * (diameter(RAYS / 8) + diameter(3 * RAYS / 8)),
            max: 2.0 * radii.iter().copied().fold(0.0, f64::max),
            height: height.at(centre),
        }
    }
}

/// Radius and height in m, from the vertical axis through `centre` to beyond the front: the mean height over all
/// directions, at steps of half a cell.
pub fn profile(cells: &Cells, centre: DVec2) -> Vec<[f64; 2]> {
    let plan = Plan::height(cells);
    let height = |r: f64| {
        let around = (0..RAYS).map(|n| plan.at(centre + r * DVec2::from_angle(TAU * n as f64 / RAYS as f64)));
        around.sum::<f64>() / RAYS as f64
    };
    let [low, high] = plan.extent();
    let furthest = (low - centre).abs().max((high - centre).abs()).length();
    let mut points: Vec<[f64; 2]> = Vec::new();
    for n in 0..=(furthest / (0.5 * cells.size)).ceil() as usize {
        let r = 0.5 * cells.size * n as f64;
        points.push([r, height(r)]);
    }
    let wet = points.iter().rposition(|[_, h]| *h > 0.0).map_or(0, |last| last + 2);
    points.truncate(wet);
    points
}

/// Distance in m from `centre` to the front along `direction` (of unit length); 0 if the ray meets no fluid.
fn front(cover: &Plan, height: &Plan, centre: DVec2, direction: DVec2) -> f64 {
    let reach = reach(cover.extent(), centre, direction);
    let half = outermost(cover, 0.5, centre, direction, reach);
    let whole = outermost(height, height.size(), centre, direction, reach);
    // A body that is nowhere as high as a cell tells nothing about its toe.
    let toe = if whole > 0.0 { (half - whole).max(0.0) / 3.0 } else { 0.0 };
    (half + toe).min(reach)
}

/// Distance in m from `centre` to the outermost point within `reach` along a ray where a quantity has a level; 0 if it has it
/// nowhere.
fn outermost(plan: &Plan, level: f64, centre: DVec2, direction: DVec2, reach: f64) -> f64 {
    let above = |r: f64| plan.at(centre + r * direction) >= level;
    if above(reach) {
        return reach;
    }
    // From outside of the fluid inwards in steps short enough not to miss a column, then by bisection.
    let step = 0.25 * plan.size();
    let mut n = (reach.min(self::reach(plan.seen(), centre, direction)) / step).floor();
    while n >= 0.0 && !above(n * step) {
        n -= 1.0;
    }
    if n < 0.0 {
        return 0.0;
    }
    let (mut inside, mut outside) = (n * step, ((n + 1.0) * step).min(reach));
    loop {
        let middle = 0.5 * (inside + outside);
        if middle <= inside || middle >= outside {
            return inside;
        }
        if above(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
}

/// Distance in m along a ray to the side of a box around its origin.
fn reach([low, high]: [DVec2; 2], centre: DVec2, direction: DVec2) -> f64 {
    let along = |low: f64, high: f64, from: f64, slope: f64| {
        if slope == 0.0 { f64::INFINITY } else { (if slope > 0.0 { high } else { low } - from) / slope }
    };
    let x = along(low.x, high.x, centre.x, direction.x);
    let y = along(low.y, high.y, centre.y, direction.y);
    x.min(y).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::DVec3;

    #[test]
    fn the_profile_of_a_cake_is_its_height() {
        let cake = Cake { power: 0.5, radius: 0.3, top: 0.04, size: 0.005, axis: DVec2::ZERO };
        let cells = cake.cells(DVec2::ZERO, DVec2::splat(0.35), [[true, false]; 2]);
        let points = profile(&cells, cake.axis);
        for [r, height] in points.iter().filter(|[r, _]| *r < 0.28) {
            let exact = cake.height(DVec2::new(*r, 0.0));
            assert!((height - exact).abs() < 0.03 * cake.top, "{r}: {height}, {exact}");
        }
        let [last, height] = points[points.len() - 1];
        assert!((0.3..0.32).contains(&last) && height == 0.0, "{last}");
        assert!(profile(&Cells { size: 0.1, ..Cells::default() }, DVec2::ZERO).is_empty());
    }

    /// A round cake of radius `radius` whose height falls as `top` (1 - r / radius)^`power`, in cells of edge `size`: one half is
    /// that of a yield-stress fluid at rest, nought a cylinder.
    struct Cake {
        power: f64,
        radius: f64,
        top: f64,
        size: f64,
        axis: DVec2,
    }

    impl Cake {
        fn height(&self, point: DVec2) -> f64 {
            let inside = 1.0 - point.distance(self.axis) / self.radius;
            if inside > 0.0 { self.top * inside.powf(self.power) } else { 0.0 }
        }

        /// Fills a domain between two corners (x, y in m).
        fn cells(&self, min: DVec2, max: DVec2, symmetry: [[bool; 2]; 2]) -> Cells {
            let count = |length: f64| (length / self.size).round() as usize;
            let (nx, ny, nz) = (count(max.x - min.x), count(max.y - min.y), count(self.top) + 1);
            let mut cells = Cells {
                origin: min.extend(0.0),
                size: self.size,
                count: [nx, ny, nz],
                fill: vec![0.0; nx * ny * nz],
                domain: [min.extend(0.0), max.extend(nz as f64 * self.size)],
                symmetry: [symmetry[0], symmetry[1], [false; 2]],
                ..Cells::default()
            };
            const SAMPLES: usize = 8;
            for j in 0..ny {
                for i in 0..nx {
                    let corner = min + self.size * DVec2::new(i as f64, j as f64);
                    for n in 0..SAMPLES * SAMPLES {
                        let sample = DVec2::new((n % SAMPLES) as f64, (n / SAMPLES) as f64) + 0.5;
                        let height = self.height(corner + sample * (self.size / SAMPLES as f64));
                        for k in 0..(height / self.size).ceil() as usize {
                            let n = cells.index(i, j, k);
                            let fill = (height / self.size - k as f64).min(1.0);
                            cells.fill[n] += fill / (SAMPLES * SAMPLES) as f64;
                        }
                    }
                }
            }
            cells
        }
    }

    fn measure(cells: &Cells, axis: DVec2) -> Spread {
        Spread::measure(cells, &Plan::height(cells), axis)
    }

    #[test]
    fn spread_of_a_round_cake_at_any_size_and_place() {
        for (power, size) in [(0.5, 0.01), (0.5, 0.005), (0.0, 0.01), (0.0, 0.005)] {
            for offset in [DVec2::ZERO, DVec2::new(0.3, 0.1), DVec2::splat(0.5), DVec2::new(0.77, 0.41)] {
                for (radius, top) in [(0.35, 0.026), (0.3, 0.05), (0.325, 0.08), (0.1537, 0.2)] {
                    let cake = Cake { power, radius, top, size, axis: offset * size };
                    let cells = cake.cells(DVec2::splat(-0.4), DVec2::splat(0.4), [[false; 2]; 2]);
                    let spread = measure(&cells, cake.axis);
                    for (what, value) in [
                        ("mean", spread.mean),
                        ("x", spread.x),
                        ("y", spread.y),
                        ("diagonal", spread.diagonal),
                        ("max", spread.max),
                    ] {
                        let error = (value - 2.0 * cake.radius) / size;
                        assert!(
                            error.abs() < 0.35,
                            "{what} {value} of radius {radius}, top {top}, power {power}, cell {size}, offset {offset}: {error} cells"
                        );
                    }
                    assert!((spread.height - cake.height(cake.axis)).abs() < 0.1 * top);
                }
            }
        }
    }

    #[test]
    fn a_quarter_reads_as_the_whole() {
        let cake = Cake { power: 0.5, radius: 0.31, top: 0.07, size: 0.005, axis: DVec2::ZERO };
        let (corner, middle) = (DVec2::splat(0.4), DVec2::ZERO);
        let whole = measure(&cake.cells(-corner, corner, [[false; 2]; 2]), middle);
        for (min, max, symmetry) in [
            (middle, corner, [[true, false]; 2]),
            (-corner, middle, [[false, true]; 2]),
            (DVec2::new(-0.4, 0.0), corner, [[false; 2], [true, false]]),
        ] {
            let part = measure(&cake.cells(min, max, symmetry), middle);
            for (a, b) in [
                (part.mean, whole.mean),
                (part.x, whole.x),
                (part.y, whole.y),
                (part.diagonal, whole.diagonal),
                (part.max, whole.max),
                (part.height, whole.height),
            ] {
                assert!((a - b).abs() < 1e-12, "{part:?} {whole:?}");
            }
        }
    }

    #[test]
    fn a_box_that_is_cropped_to_the_fluid_reads_the_same() {
        let cake = Cake { power: 0.5, radius: 0.2, top: 0.07, size: 0.01, axis: DVec2::new(0.004, 0.0) };
        let wide = cake.cells(DVec2::splat(-0.4), DVec2::splat(0.4), [[false; 2]; 2]);
        let mut cropped = cake.cells(DVec2::splat(-0.22), DVec2::splat(0.22), [[false; 2]; 2]);
        cropped.domain = wide.domain;
        let (a, b) = (measure(&wide, cake.axis), measure(&cropped, cake.axis));
        assert!((a.mean - b.mean).abs() < 1e-12 && (a.height - b.height).abs() < 1e-12);
    }

    #[test]
    fn turning_the_body_exchanges_x_and_y_only() {
        // An uneven cake: a round one and a lump beside it.
        let (cake, lump) = (
            Cake { power: 0.5, radius: 0.2, top: 0.07, size: 0.01, axis: DVec2::new(0.013, -0.021) },
            Cake { power: 0.5, radius: 0.1, top: 0.05, size: 0.01, axis: DVec2::new(0.19, 0.05) },
        );
        let corner = DVec2::splat(0.4);
        let mut cells = cake.cells(-corner, corner, [[false; 2]; 2]);
        for (fill, more) in cells.fill.iter_mut().zip(&lump.cells(-corner, corner, [[false; 2]; 2]).fill) {
            *fill = fill.max(*more);
        }
        let mut turned = cells.clone();
        let [nx, ny, nz] = cells.count;
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    turned.fill[cells.index(nx - 1 - j, i, k)] = cells.fill[cells.index(i, j, k)];
                }
            }
        }
        let (a, b) = (measure(&cells, DVec2::ZERO), measure(&turned, DVec2::ZERO));
        assert!(a.x > a.y + 0.05, "{a:?}");
        for (a, b) in [
            (a.mean, b.mean),
            (a.x, b.y),
            (a.y, b.x),
            (a.diagonal, b.diagonal),
            (a.max, b.max),
            (a.height, b.height),
        ] {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn a_front_at_a_wall_is_at_the_wall() {
        let cells = Cells {
            size: 0.1,
            count: [4, 4, 1],
            fill: vec![1.0; 16],
            domain: [DVec3::ZERO, DVec3::new(0.4, 0.4, 1.0)],
            symmetry: [[true, false], [true, false], [false; 2]],
            ..Cells::default()
        };
        let spread = measure(&cells, DVec2::ZERO);
        assert!((spread.x - 0.8).abs() < 1e-12 && (spread.y - 0.8).abs() < 1e-12);
        assert!((spread.max - 0.8 * 2f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn no_fluid_has_no_spread() {
        assert_eq!(measure(&Cells { size: 0.1, ..Cells::default() }, DVec2::ZERO).max, 0.0);
    }
}
