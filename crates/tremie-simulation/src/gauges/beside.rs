//! What solids that move leave of the fluid's volume beside its cells: those whose centres they have not covered count as whole, though they are cut, or more is wet. By a plate that closes on fluid the sum of cells would
//! swing by half a row of them.

use rayon::prelude::*;
use tremie_case::Case;
use tremie_geometry::{Body, Motion};
use tremie_numerics::DVec3;

use crate::Cells;

/// A solid that moves.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Moving {
    /// Its number among those of the case.
    solid: usize,
    body: Body,
}

impl Moving {
    /// Those of a case.
    pub(super) fn all(case: &Case) -> Vec<Self> {
        let moves = |solid: &tremie_case::Solid| solid.load.is_some() || solid.motion != Motion::REST;
        let solids = case.solids.iter().enumerate().filter(|(_, solid)| moves(solid));
        solids.map(|(n, solid)| Self { solid: n, body: solid.body.clone() }).collect()
    }
}

/// The volume that they leave in cells, when the solids of the case have moved so far in m.
pub(super) fn left(moving: &[Moving], moved: &[DVec3], cells: &Cells) -> f64 {
    let [nx, ny, nz] = cells.count;
    let placed: Vec<_> = moving
        .iter()
        .map(|one| {
            let way = moved.get(one.solid).copied().unwrap_or_default();
            let (low, high) = one.body.bounds();
            (&one.body, way, low + way - cells.size, high + way + cells.size)
        })
        .collect();
    if placed.is_empty() {
        return 0.0;
    }
    let beside = |at: DVec3| -> f64 {
        let near = placed.iter().filter(|(_, _, low, high)| at.cmpgt(*low).all() && at.cmplt(*high).all());
        let near: Vec<_> =
            near.filter(|(body, way, ..)| body.signed_distance(at - way) < cells.size).collect();
        let ways = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
        let in_column = |way: DVec3| {
            let to_next = cells.size * way;
            let covers = |(body, way, ..): &&&(&Body, DVec3, DVec3, DVec3)| {
                body.signed_distance(at + to_next - *way) < 0.0
            };
            near.iter().find(covers).map_or(0.0, |(body, way, ..)| body.left_in_column(at - *way, to_next))
        };
        ways.map(in_column).sum()
    };
    let layers: Vec<f64> = (0..nz)
        .into_par_iter()
        .map(|k| {
            let columns = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
            let left = |(i, j): (usize, usize)| {
                let n = cells.index(i, j, k);
                match cells.fill[n] > 0.0 && cells.solid[n] == 0 {
                    true => cells.fill[n] * beside(cells.centre(i, j, k)),
                    false => 0.0,
                }
            };
            columns.map(left).sum()
        })
        .collect();
    layers.iter().sum()
}

#[cfg(test)]
mod tests {
    use tremie_geometry::Shape;

    use super::*;

    /// Layers of cells under a plate, wherever it cuts them.
    #[test]
    fn fluid_under_a_plate_fills_all_below_it() {
        let wide = DVec3::new(1.0, 1.0, 1.0);
        let plate = Body::Shape(Shape::Box { min: DVec3::new(-1.0, -1.0, 0.0), max: wide });
        for height in [0.301, 0.325, 0.349, 0.351, 0.375, 0.4] {
            let wet = |k: usize| 0.1 * (k as f64 + 0.5) <= height;
            let count = [2, 3, 5];
            let fill = (0..30).map(|n| f64::from(u8::from(wet(n / 6)))).collect();
            let cells = Cells { size: 0.1, count, fill, solid: vec![0; 30], ..Cells::default() };
            let moving = [Moving { solid: 0, body: plate.clone() }];
            let volume = cells.fill.iter().sum::<f64>() + left(&moving, &[height * DVec3::Z], &cells);
            assert!((volume / (6.0 * height / 0.1) - 1.0).abs() < 1e-9, "{volume} at {height}");
        }
    }
}
