//! Level of the fluid: the height of its surface over a rectangle, as a ruler finds it from above. It is the median over the columns of cells, by their area: the mean of a plane surface, whether it
//! slopes or not, of which films that hang high on the walls of a box are no part. (In an L-box of 100 mm they may take a fourth of the columns, and would add half to the level.)
//!
//! In a column of cells the surface is that of the highest body of fluid with a cell at least half full: from the lowest of its cells the
//! sum of the fill upwards, so that the level keeps the volume. Thinner films, on the walls say, count for nothing. Where there is
//! no such cell the level is that of the floor: the domain's, or the top of the solid that stands on it. Columns that
//! are solid from bottom to top, such as those of upright bars, do not belong to the rectangle.

use tremie_case::LevelGauge;

use super::HALF_FULL;
use crate::Cells;
use crate::plan::Axis;

/// Median height in m of the surface over the rectangle of a gauge, as a coordinate; 0 if all of it is solid.
pub(super) fn measure(cells: &Cells, gauge: &LevelGauge) -> f64 {
    let axes = [Axis::new(cells, 0), Axis::new(cells, 1)];
    let [is, js] = [0, 1].map(|a| shares(&axes[a], gauge.min[a], gauge.max[a]));
    let mut columns: Vec<(f64, f64)> = Vec::new();
    for (j, depth) in &js {
        for (i, width) in &is {
            let level = match (axes[0].cell(*i), axes[1].cell(*j)) {
                (Some(i), Some(j)) => surface(cells, i, j),
                _ => Some(cells.domain[0].z),
            };
            columns.extend(level.map(|level| (level, width * depth)));
        }
    }
    median(columns)
}

/// The median of values with weights, straight from one to the next between their middles; 0 of none.
fn median(mut of: Vec<(f64, f64)>) -> f64 {
    of.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * of.iter().map(|(_, weight)| weight).sum::<f64>();
    let (mut below, mut last) = (0.0, None);
    for (value, weight) in of {
        let middle = below + 0.5 * weight;
        if middle >= half {
            let (from, start) = last.unwrap_or((value, middle));
            let share = if middle > start { (half - start) / (middle - start) } else { 0.0 };
            return from + share * (value - from);
        }
        below += weight;
        last = Some((value, middle));
    }
    last.map_or(0.0, |(value, _)| value)
}

/// The places of cells between two coordinates in m, each with its share of a cell; between equal ones the one place in which they lie.
fn shares(axis: &Axis, low: f64, high: f64) -> Vec<(isize, f64)> {
    let size = axis.coordinate(1) - axis.coordinate(0);
    let inside = |i: isize| {
        let overlap = high.min(axis.coordinate(i + 1)) - low.max(axis.coordinate(i));
        // Sides between cells are meant to be there: rounding must not leave a sliver.
        (1e9 * overlap / size).round() / 1e9
    };
    let all = (axis.place(low)..=axis.place(high)).map(|i| (i, inside(i)));
    let found: Vec<_> = all.filter(|(_, share)| *share > 0.0).collect();
    if found.is_empty() { vec![(axis.place(0.5 * (low + high)), 1.0)] } else { found }
}

/// Height in m of the surface in a column of cells, as a coordinate; none if the column is solid.
pub(super) fn surface(cells: &Cells, i: usize, j: usize) -> Option<f64> {
    let nz = cells.count[2];
    let fill = |k: usize| cells.fill[cells.index(i, j, k)];
    let height = |k: usize| cells.origin.z + k as f64 * cells.size;
    if let Some(top) = (0..nz).rev().find(|k| fill(*k) >= HALF_FULL) {
        let bottom = (0..top).rev().take_while(|k| fill(*k) > 0.0).last().unwrap_or(top);
        let column: f64 = (bottom..nz).map(fill).take_while(|fill| *fill > 0.0).sum();
        return Some(height(bottom) + cells.size * column);
    }
    let solid = (0..nz).take_while(|k| cells.solid[cells.index(i, j, *k)] != 0).count();
    let on_floor = cells.origin.z < cells.domain[0].z + 0.5 * cells.size;
    match solid {
        _ if solid == nz && nz > 0 => None,
        _ if on_floor => Some(height(solid)),
        _ => Some(cells.domain[0].z),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::{DVec2, DVec3};

    fn gauge(min: [f64; 2], max: [f64; 2]) -> LevelGauge {
        LevelGauge { name: "H".into(), min: DVec2::from(min), max: DVec2::from(max) }
    }

    /// Columns of 4 cells of 0.1 m in a row along x, in a domain of 6 x 1 x 4 cells that goes on mirrored below x = 0.
    fn row(columns: &[[f64; 4]], solid: &[[u8; 4]]) -> Cells {
        let n = columns.len();
        let mut cells = Cells {
            size: 0.1,
            count: [n, 1, 4],
            fill: vec![0.0; 4 * n],
            solid: vec![0; 4 * n],
            cage: None,
            domain: [DVec3::ZERO, DVec3::new(0.6, 0.1, 0.4)],
            symmetry: [[true, false], [false; 2], [false; 2]],
            ..Cells::default()
        };
        for i in 0..n {
            for k in 0..4 {
                let cell = cells.index(i, 0, k);
                cells.fill[cell] = columns[i][k];
                cells.solid[cell] = solid.get(i).map_or(0, |column| column[k]);
            }
        }
        cells
    }

    fn level(cells: &Cells, low: f64, high: f64) -> f64 {
        measure(cells, &gauge([low, 0.0], [high, 0.1]))
    }

    #[test]
    fn columns_count_by_the_area_that_the_rectangle_has_of_each() {
        let cells = row(&[[1.0, 1.0, 0.5, 0.0], [1.0, 0.7, 0.0, 0.0]], &[]);
        assert!((level(&cells, 0.0, 0.1) - 0.25).abs() < 1e-12);
        assert!((level(&cells, 0.0, 0.2) - 0.21).abs() < 1e-12);
        assert!((level(&cells, 0.05, 0.2) - (0.5 * 0.25 + 0.17) / 1.5).abs() < 1e-12);
        // A line of columns, and one beyond the symmetry plane.
        assert!((level(&cells, 0.15, 0.15) - 0.17).abs() < 1e-12);
        assert!((level(&cells, -0.15, -0.15) - 0.17).abs() < 1e-12);
        assert!((level(&cells, -0.1, 0.1) - 0.25).abs() < 1e-12);
        // Half of it has no fluid yet: dry floor counts.
        assert!((level(&cells, 0.0, 0.4) - 0.085).abs() < 1e-12);
    }

    #[test]
    fn films_that_hang_on_walls_are_not_the_level() {
        // A slope between two of them.
        let film = [1.0; 4];
        let cells = row(&[film, [1.0, 0.8, 0.0, 0.0], [1.0, 0.7, 0.0, 0.0], [1.0, 0.6, 0.0, 0.0], film], &[]);
        assert!((level(&cells, 0.1, 0.4) - 0.17).abs() < 1e-12);
        assert!((level(&cells, 0.0, 0.5) - 0.18).abs() < 1e-12);
    }

    #[test]
    fn the_surface_is_the_highest_that_is_no_film() {
        // Fluid over a gap, as above a bar; a drop; a film on a wall, joined to the fluid below or not.
        let over_bar = row(&[[1.0, 0.0, 1.0, 0.2]], &[[0, 1, 0, 0]]);
        assert!((level(&over_bar, 0.0, 0.1) - 0.32).abs() < 1e-12);
        let film = row(&[[1.0, 0.6, 0.1, 0.1], [1.0, 0.6, 0.0, 0.3]], &[]);
        assert!((level(&film, 0.0, 0.1) - 0.18).abs() < 1e-12);
        assert!((level(&film, 0.1, 0.2) - 0.16).abs() < 1e-12);
    }

    #[test]
    fn upright_bars_do_not_count_and_solids_below_are_the_floor() {
        let cells = row(
            &[[1.0, 0.5, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0, 1.0, 0.5, 0.0]],
            &[[0; 4], [1; 4], [1, 1, 0, 0], [1, 0, 0, 1]],
        );
        assert!((level(&cells, 0.0, 0.2) - 0.15).abs() < 1e-12);
        assert!((level(&cells, 0.2, 0.3) - 0.2).abs() < 1e-12);
        assert!((level(&cells, 0.3, 0.4) - 0.25).abs() < 1e-12);
        assert_eq!(level(&cells, 0.1, 0.2), 0.0);
        assert_eq!(level(&Cells { size: 0.1, ..Cells::default() }, 0.0, 0.2), 0.0);
    }
}
