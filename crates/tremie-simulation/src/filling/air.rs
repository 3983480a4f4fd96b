//! Air that is caught: cells less than half full from which no way through such cells, face to face, leads to where air leaves, upwards out of the domain,
//! through open sides or by outlets. (Air is not computed: a pocket keeps neither its volume nor a pressure, but it tells where one would be.)

use tremie_numerics::DVec3;
use tremie_numerics::sum::ordered_sum;

use super::{FILLED, Filling, Window};

/// Air that is caught.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pocket {
    /// Volume in m3, with mirror images.
    pub volume: f64,
    /// Its middle in m.
    pub centre: DVec3,
}

/// Number of each cell's pocket, from 1, and 255 for all from there on; and the pockets, the largest first.
pub(super) fn pockets(filling: &Filling, window: &Window) -> (Vec<u8>, Vec<Pocket>) {
    let grid = &filling.grid;
    let air: Vec<f64> = (0..grid.cells())
        .map(|n| match window.cell(grid.place(n)) {
            Some(n) if window.cells.solid[n] != 0 || window.cells.fill[n] >= FILLED => 0.0,
            Some(n) => 1.0 - window.cells.fill[n],
            None => 1.0,
        })
        .collect();
    let leaves = |n: usize| {
        let place = grid.place(n);
        let at_side =
            |side: usize| place[side / 2] == if side % 2 == 0 { 0 } else { grid.count[side / 2] - 1 };
        let centre = grid.centre(n);
        let within = |min: DVec3, max: DVec3| centre.cmpgt(min).all() && centre.cmplt(max).all();
        (0..6).any(|side| filling.open[side] && at_side(side))
            || filling.outlets.iter().any(|outlet| within(outlet.min, outlet.max))
    };
    let mut seen = vec![false; air.len()];
    // All cells of air that can be reached from a cell.
    let mut reach = |from: usize| -> Vec<usize> {
        let mut found = Vec::new();
        if air[from] == 0.0 || std::mem::replace(&mut seen[from], true) {
            return found;
        }
        found.push(from);
        let mut next = 0;
        while let Some(n) = found.get(next).copied() {
            next += 1;
            for face in 0..6 {
                let mut at = grid.place(n).map(|i| i as isize);
                at[face / 2] += if face % 2 == 0 { -1 } else { 1 };
                match grid.cell(at) {
                    Some(beside) if air[beside] > 0.0 && !seen[beside] => {
                        seen[beside] = true;
                        found.push(beside);
                    }
                    _ => {}
                }
            }
        }
        found
    };
    for n in (0..air.len()).filter(|n| leaves(*n)) {
        reach(n);
    }
    let mut caught: Vec<(Pocket, Vec<usize>)> = Vec::new();
    for n in 0..air.len() {
        let cells = reach(n);
        if cells.is_empty() {
            continue;
        }
        let whole = ordered_sum(&cells, |n| air[*n]);
        let along = |a: usize| ordered_sum(&cells, |n| air[*n] * grid.centre(*n)[a]) / whole;
        let volume = whole * grid.size.powi(3) * grid.copies;
        caught.push((Pocket { volume, centre: DVec3::new(along(0), along(1), along(2)) }, cells));
    }
    caught.sort_by(|a, b| b.0.volume.total_cmp(&a.0.volume).then(a.1[0].cmp(&b.1[0])));
    let mut numbers = vec![0; air.len()];
    for (number, (_, cells)) in caught.iter().enumerate() {
        for n in cells {
            numbers[*n] = (number + 1).min(255) as u8;
        }
    }
    (numbers, caught.into_iter().map(|(pocket, _)| pocket).collect())
}
