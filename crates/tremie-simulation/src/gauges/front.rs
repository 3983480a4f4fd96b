//! How far the fluid has come along an axis: the furthest point of its surface, with that of its mirror images.
//!
//! In a row of cells the surface is where the fill, interpolated between centres of cells, is one half: at a steep front that is the front
//! itself, within a tenth of a cell, and a film thinner than half a cell is not yet there. A front that stands
//! against a wall of the domain is at the wall.

use tremie_case::FrontGauge;

use super::HALF_FULL;
use crate::Cells;

/// Way in m by which the fluid has come beyond the plane of a gauge; before it, or without fluid from the domain's far side on,
/// negative.
pub(super) fn measure(cells: &Cells, gauge: &FrontGauge) -> f64 {
    let FrontGauge { axis, forwards, at, .. } = *gauge;
    let sign = if forwards { 1.0 } else { -1.0 };
    let mut front = furthest(cells, axis, forwards);
    for side in (0..2).filter(|side| cells.symmetry[axis][*side]) {
        // The image goes the other way.
        let image = 2.0 * cells.domain[side][axis] - furthest(cells, axis, !forwards);
        front = if forwards { front.max(image) } else { front.min(image) };
    }
    sign * (front - at)
}

/// Coordinate in m of the outermost point of the surface along an axis, forwards or backwards; the domain's far side without fluid.
fn furthest(cells: &Cells, axis: usize, forwards: bool) -> f64 {
    let count = cells.count;
    let stride = [1, count[0], count[0] * count[1]][axis];
    let others: usize = (0..3).filter(|a| *a != axis).map(|a| count[a]).product();
    let length = count[axis];
    // Rows that begin at consecutive cells, but for the cells of the row itself.
    let first = |row: usize| row % stride + row / stride * stride * length;
    let fill = |row: usize, n: usize| {
        let along = if forwards { n } else { length - 1 - n };
        cells.fill[first(row) + stride * along]
    };
    // In cells, from where the row begins.
    let reach = |row: usize| {
        let last = (0..length).rev().find(|n| fill(row, *n) >= HALF_FULL)?;
        let (inside, outside) = (fill(row, last), if last + 1 < length { fill(row, last + 1) } else { 0.0 });
        Some(last as f64 + 0.5 + (inside - HALF_FULL) / (inside - outside))
    };
    let most = (0..others).filter_map(reach).reduce(f64::max);
    let side = usize::from(!forwards);
    match most {
        Some(reach) if forwards => cells.origin[axis] + cells.size * reach,
        Some(reach) => cells.origin[axis] + cells.size * (length as f64 - reach),
        None => cells.domain[side][axis],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::DVec3;

    /// A block of fluid from (0.2, 0.1, 0) to (0.53, 0.3, 0.17) m, in cells of 0.1 m.
    fn block() -> Cells {
        let count = [8, 4, 3];
        let mut cells = Cells {
            size: 0.1,
            count,
            fill: vec![0.0; 96],
            domain: [DVec3::ZERO, DVec3::new(0.8, 0.4, 0.3)],
            ..Cells::default()
        };
        let share = |i: usize, low: f64, high: f64| {
            let at = 0.1 * i as f64;
            ((high.min(at + 0.1) - low.max(at)) / 0.1).max(0.0)
        };
        for k in 0..3 {
            for j in 0..4 {
                for i in 0..8 {
                    let n = cells.index(i, j, k);
                    cells.fill[n] = share(i, 0.2, 0.53) * share(j, 0.1, 0.3) * share(k, 0.0, 0.17);
                }
            }
        }
        cells
    }

    fn gauge(axis: usize, forwards: bool, at: f64) -> FrontGauge {
        FrontGauge { name: "T".into(), axis, forwards, at }
    }

    #[test]
    fn fronts_are_found_along_all_axes() {
        let cells = block();
        for (axis, forwards, at, way) in [
            (0, true, 0.5, 0.03),
            (0, false, 0.25, 0.05),
            (1, true, 0.4, -0.1),
            (1, false, 0.0, -0.1),
            (2, true, 0.1, 0.07),
            (2, false, 0.0, 0.0),
        ] {
            let found = measure(&cells, &gauge(axis, forwards, at));
            assert!((found - way).abs() < 0.011, "{axis} {forwards}: {found} {way}");
        }
        // Upright to the axis, where cells are whole, exactly.
        assert!((measure(&cells, &gauge(1, true, 0.25)) - 0.05).abs() < 1e-12);
    }

    #[test]
    fn the_image_beyond_a_symmetry_plane_comes_from_the_other_side() {
        let cells = Cells { symmetry: [[true, false], [false; 2], [false; 2]], ..block() };
        assert!((measure(&cells, &gauge(0, false, -0.5)) - 0.03).abs() < 0.011);
        assert!((measure(&cells, &gauge(0, true, 0.5)) - 0.03).abs() < 0.011);
    }

    #[test]
    fn no_fluid_has_come_nowhere() {
        let cells = Cells { size: 0.1, domain: [DVec3::ZERO, DVec3::ONE], ..Cells::default() };
        assert_eq!(measure(&cells, &gauge(0, true, 0.3)), -0.3);
        assert_eq!(measure(&cells, &gauge(0, false, 0.3)), -0.7);
    }
}
