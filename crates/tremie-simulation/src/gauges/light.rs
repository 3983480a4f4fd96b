//! Light seen from above: how clear the view is through a box, such as the outlet of a funnel.
//!
//! Through a column of cells the view is as clear as its fullest cell is empty, and through the box as through its clearest column. Solid
//! cells are as full ones. When light is seen the view is half clear, the cells of the column are less than half full.

use tremie_geometry::Motion;
use tremie_numerics::DVec3;

use crate::Cells;
use crate::plan::Axis;

/// The light gauge of a case.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Light {
    pub(super) name: String,
    /// Corners of the box at the start, in m.
    pub(super) min: DVec3,
    pub(super) max: DVec3,
    /// How it moves.
    pub(super) motion: Motion,
}

impl Light {
    /// How clear the view is, from 0 to 1, at a time in s.
    pub(super) fn measure(&self, cells: &Cells, time: f64) -> f64 {
        let way = self.motion.offset(time);
        let (min, max) = (self.min + way, self.max + way);
        let axes = [0, 1, 2].map(|a| Axis::new(cells, a));
        // Cells whose centres lie in the box.
        let [is, js, ks] = [0, 1, 2]
            .map(|a| axes[a].place(min[a] + 0.5 * cells.size)..axes[a].place(max[a] + 0.5 * cells.size));
        let fullest = |i: isize, j: isize| {
            let (Some(i), Some(j)) = (axes[0].cell(i), axes[1].cell(j)) else { return 0.0 };
            let within = ks.clone().filter(|k| (0..cells.count[2] as isize).contains(k));
            let all = within.map(|k| cells.index(i, j, k as usize));
            all.map(|n| if cells.solid[n] != 0 { 1.0 } else { cells.fill[n] }).fold(0.0, f64::max)
        };
        let columns = js.flat_map(|j| is.clone().map(move |i| (i, j)));
        columns.map(|(i, j)| 1.0 - fullest(i, j)).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_seen_through_the_clearest_column() {
        let mut cells = Cells {
            size: 0.1,
            count: [3, 1, 4],
            fill: vec![0.0; 12],
            solid: vec![0; 12],
            cage: None,
            domain: [DVec3::ZERO, DVec3::new(0.3, 0.1, 0.6)],
            symmetry: [[true, false], [false; 2], [false; 2]],
            ..Cells::default()
        };
        for (i, k, fill) in [(0, 1, 0.8), (1, 1, 0.3), (1, 3, 0.1), (2, 1, 0.6), (0, 0, 1.0), (1, 0, 1.0)] {
            let n = cells.index(i, 0, k);
            cells.fill[n] = fill;
        }
        let solid = cells.index(2, 0, 3);
        cells.solid[solid] = 1;
        let light = |x: f64, z: f64, motion| Light {
            name: "t".into(),
            min: DVec3::new(-x, 0.0, z),
            max: DVec3::new(x, 0.1, 0.6),
            motion,
        };
        // Fluid in the lowest layer lies below the box; above there is but air.
        let clear = |x: f64, z: f64| light(x, z, Motion::REST).measure(&cells, 0.0);
        assert!((clear(0.3, 0.1) - 0.7).abs() < 1e-12);
        assert!((clear(0.1, 0.1) - 0.2).abs() < 1e-12);
        assert_eq!(clear(0.3, 0.0), 0.0);
        assert_eq!(clear(0.1, 0.4), 1.0);
        // Half a second on it lies a cell higher.
        let moving = light(0.3, 0.0, Motion::Uniform(DVec3::new(0.0, 0.0, 0.2)));
        assert!((moving.measure(&cells, 0.5) - 0.7).abs() < 1e-12);
    }
}
