//! Air that is caught: cells less than half full from which no way through such cells, face to face, leads to where air leaves, upwards out of the domain,
//! through open sides or by outlets.
//!
//! Air is not computed: it has no pressure, and the fluid closes a pocket that would have stayed. So every place is kept in which air has been caught
//! at any reading, with as much of it as there was at most.

use tremie_numerics::DVec3;
use tremie_numerics::sum::ordered_sum;

use super::{FILLED, Filling, Grid, Window};

/// Air that is caught.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pocket {
    /// Volume in m3, with mirror images.
    pub volume: f64,
    /// Its middle in m.
    pub centre: DVec3,
}

/// The cells that can be reached from one, face to face through cells in which there is some of `what`; none that have been seen.
fn reach(grid: &Grid, what: &[f32], seen: &mut [bool], from: usize) -> Vec<usize> {
    let mut found = Vec::new();
    if what[from] == 0.0 || std::mem::replace(&mut seen[from], true) {
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
                Some(beside) if what[beside] > 0.0 && !seen[beside] => {
                    seen[beside] = true;
                    found.push(beside);
                }
                _ => {}
            }
        }
    }
    found
}

/// Share of each cell that is caught air.
pub(super) fn caught(filling: &Filling, window: &Window) -> Vec<f32> {
    let grid = &filling.grid;
    let mut air: Vec<f32> = (0..grid.cells())
        .map(|n| match window.cell(grid.place(n)) {
            Some(n) if window.cells.solid[n] != 0 || window.cells.fill[n] >= FILLED => 0.0,
            Some(n) => (1.0 - window.cells.fill[n]) as f32,
            None => 1.0,
        })
        .collect();
    let leaves = |n: usize| {
        let place = grid.place(n);
        let at_side = |side: usize| {
            place[side / 2] == if side.is_multiple_of(2) { 0 } else { grid.count[side / 2] - 1 }
        };
        let centre = grid.centre(n);
        let within = |min: DVec3, max: DVec3| centre.cmpgt(min).all() && centre.cmplt(max).all();
        (0..6).any(|side| filling.open[side] && at_side(side))
            || filling.outlets.iter().any(|outlet| within(outlet.min, outlet.max))
    };
    let mut seen = vec![false; air.len()];
    for n in (0..air.len()).filter(|n| leaves(*n)) {
        reach(grid, &air, &mut seen, n);
    }
    for (air, _) in air.iter_mut().zip(&seen).filter(|(_, free)| **free) {
        *air = 0.0;
    }
    air
}

/// Number of each cell's pocket, from 1, and 255 for all from there on; and the pockets, the largest first.
pub(super) fn pockets(grid: &Grid, caught: &[f32]) -> (Vec<u8>, Vec<Pocket>) {
    let mut seen = vec![false; caught.len()];
    let mut pockets: Vec<(Pocket, Vec<usize>)> = Vec::new();
    for n in 0..caught.len() {
        let cells = reach(grid, caught, &mut seen, n);
        if cells.is_empty() {
            continue;
        }
        let air = |n: usize| f64::from(caught[n]);
        let whole = ordered_sum(&cells, |n| air(*n));
        let along = |a: usize| ordered_sum(&cells, |n| air(*n) * grid.centre(*n)[a]) / whole;
        let volume = whole * grid.size.powi(3) * grid.copies;
        pockets.push((Pocket { volume, centre: DVec3::new(along(0), along(1), along(2)) }, cells));
    }
    pockets.sort_by(|a, b| b.0.volume.total_cmp(&a.0.volume).then(a.1[0].cmp(&b.1[0])));
    let mut numbers = vec![0; caught.len()];
    for (number, (_, cells)) in pockets.iter().enumerate() {
        for n in cells {
            numbers[*n] = (number + 1).min(255) as u8;
        }
    }
    (numbers, pockets.into_iter().map(|(pocket, _)| pocket).collect())
}
