//! The order of places along a curve through space (Morton 1966): who is near stands near in memory, and all who share a cell of two, four, eight, ... edges follow each other.

use rayon::prelude::*;
use tremie_numerics::DVec3;

/// Nodes that one thread takes at a time.
const CHUNK: usize = 1024;

/// Places in order: for each its cells' key, of which three bits fewer are the key of the cell twice as large, and its number. `edge` is that of the smallest cells, in m.
pub(crate) fn keys(positions: &[DVec3], numbers: &[u32], edge: f64) -> Vec<(u64, u32)> {
    let place = |n: &u32| positions[*n as usize];
    let low = numbers.iter().map(place).filter(|at| at.is_finite()).fold(DVec3::INFINITY, DVec3::min);
    // Corners of all cells are at whole numbers of edges from zero, so that a place has the same cell whoever else is there.
    let corner = (low / edge).floor();
    let key = |n: &u32| {
        let cell = ((place(n) / edge).floor() - corner).to_array();
        let [x, y, z] = cell.map(|at| spread(at as u64));
        (x | (y << 1) | (z << 2), *n)
    };
    let mut all: Vec<(u64, u32)> = numbers.par_iter().with_min_len(CHUNK).map(key).collect();
    all.par_sort();
    all
}

/// The order in which nodes at positions in m stand along the curve through cells of this `edge` in m.
pub fn along_curve(positions: &[DVec3], edge: f64) -> Vec<u32> {
    let numbers: Vec<u32> = (0..positions.len() as u32).collect();
    keys(positions, &numbers, edge).into_iter().map(|(_, number)| number).collect()
}

/// The lowest 21 bits, two zeros before each.
fn spread(number: u64) -> u64 {
    let mut bits = number & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        bits = (bits | (bits << shift)) & mask;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_shares_a_cell_stands_together() {
        assert_eq!([0, 1, 2, 3, 0x1f_ffff].map(spread), [0, 1, 8, 9, 0x1249_2492_4924_9249]);
        let at = |n: u32| DVec3::new(f64::from(n % 4), f64::from(n / 4 % 4), f64::from(n / 16)) + 0.5;
        let positions: Vec<DVec3> = (0..64).map(at).collect();
        let order = along_curve(&positions, 1.0);
        for cell in order.chunks(8) {
            let of = |n: &u32| (positions[*n as usize] / 2.0).floor();
            assert!(cell.iter().all(|n| of(n) == of(&cell[0])));
        }
    }
}
