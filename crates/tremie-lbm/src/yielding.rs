//! Cells beside flat walls, whose half-cells yield by their own stress (module `wall`): gathered from a few rows, sixteen at a time.
//!
//! What a wall needs is found in turns that wait for each other, so that sixteen cells take no longer than one. Where a wall stands
//! across rows, it is one cell of each that needs it.

use crate::collision::{COMPONENT, Held, Moments, moments};
use crate::lanes::LANES;
use crate::lattice::opposite;
use crate::processor::for_this_processor;
use crate::real::{Number, Real};
use crate::relaxation::{Law, Relaxation};
use crate::rows::SurfaceRow;
use crate::source::Source;
use crate::together::{Driving, Filling, HOLDS, Own, PAIRS, Pair, Physics, Pushed, Pushes, Weight};
use crate::wall::{FACES, SLANTED, tangents, wall_velocity};

/// Cells that are gathered.
const CELLS: usize = 2 * LANES;

/// Cells gathered from some rows.
struct Gathered<'a, T: Real, R: Law<T>> {
    /// Populations that have arrived.
    f: Pair<T>,
    /// What the cells hold.
    held: Pair<T, HOLDS>,
    /// Momentum that the wall takes along the two tangents.
    taken: Pair<T, 2>,
    /// What their rows have of their own.
    own: [&'a Own<'a, T, R>; CELLS],
    /// The cells' lanes in their rows.
    lanes: [usize; CELLS],
    /// Forces on them, where any push.
    push: Option<[Pushes<T>; 2]>,
}

/// Lets the half-cells at flat walls of up to [`PAIRS`] pairs of rows yield, but for the cells that slide there, `slides` for each row
/// and face. `f` are the populations that have arrived, `held` what the cells hold, `own` what the rows have of their own.
#[inline(always)]
pub(crate) fn yield_at_walls<T: Real, R: Law<T>>(
    source: &Source<'_, T>,
    rows: &[SurfaceRow],
    slides: &[[u8; 6]],
    held: &[Pair<T, HOLDS>],
    own: &[[Own<'_, T, R>; 2]],
    physics: &Physics<T, R>,
    f: &mut [Pair<T>],
) {
    // All rows beside walls, or none.
    let pushed = own.as_flattened().iter().any(|own| own.push.is_some());
    let mut gathered = Gathered {
        f: bytemuck::Zeroable::zeroed(),
        held: bytemuck::Zeroable::zeroed(),
        taken: bytemuck::Zeroable::zeroed(),
        own: [&own[0][0]; CELLS],
        lanes: [0; CELLS],
        push: pushed.then_some([[[T::ZERO; 4]; LANES]; 2]),
    };
    let mut velocity: Pair<T, 2> = bytemuck::Zeroable::zeroed();
    for face in 0..FACES.len() {
        // Row and lane of each cell.
        let (mut cells, mut count) = ([(0, 0); 2 * PAIRS * LANES], 0);
        for (m, row) in rows.iter().enumerate() {
            let mut flat = row.flat[face] & !slides[m][face];
            while flat != 0 {
                cells[count] = (m, flat.trailing_zeros() as usize);
                count += 1;
                flat &= flat - 1;
            }
        }
        let [[a, b], [c, d]] = SLANTED[face];
        for cells in cells[..count].chunks(CELLS) {
            for (n, &(m, lane)) in cells.iter().enumerate() {
                let (k, first) = (m % 2 * LANES + lane, rows[m].first());
                let arrived = f[m / 2].cell(k);
                let takes = |from: usize, to: usize| {
                    let left = |i: usize| source.own[(opposite(i), first + lane)];
                    arrived[to] + left(to) - arrived[from] - left(from)
                };
                gathered.taken.put_cell(n, &[takes(a, b), takes(c, d)]);
                gathered.f.put_cell(n, &arrived);
                gathered.held.put_cell(n, &Pair::cell(&held[m / 2], k));
                gathered.own[n] = &own[m / 2][m % 2];
                gathered.lanes[n] = lane;
                if let (Some(to), Some(push)) = (&mut gathered.push, own[m / 2][m % 2].push) {
                    to.as_flattened_mut()[n] = push[lane];
                }
            }
            wall_velocities_here(&gathered, face, physics, &mut velocity);
            for (n, &(m, lane)) in cells.iter().enumerate() {
                let f = &mut f[m / 2].0;
                let push = velocity.cell(n).map(|v| T::from_f64(1.0 / 6.0) * v);
                for (i, push) in [(a, push[0]), (b, -push[0]), (c, push[1]), (d, -push[1])] {
                    f[i][m % 2][lane] += push;
                }
            }
        }
    }
}

/// Velocities that the walls at a face of some cells need.
#[inline(always)]
fn wall_velocities<T: Real, R: Law<T>>(
    cells: &Gathered<'_, T, R>,
    face: usize,
    physics: &Physics<T, R>,
    to: &mut Pair<T, 2>,
) {
    match &cells.push {
        Some([a, b]) => {
            wall_velocities_driven(cells, face, &Pushed::new(physics.gravity, [a, b]), physics, to);
        }
        None => wall_velocities_driven(cells, face, &Weight(physics.gravity), physics, to),
    }
}

/// The same for cells that are driven so.
#[inline(always)]
fn wall_velocities_driven<T: Real, R: Law<T>, D: Driving<T>>(
    cells: &Gathered<'_, T, R>,
    face: usize,
    driving: &D,
    physics: &Physics<T, R>,
    to: &mut Pair<T, 2>,
) {
    if R::BY_ROW {
        // Rows have nothing of their own then.
        let law = physics.law.row(&cells.own[0].law);
        for half in 0..2 {
            let held: Held<_> = Filling::row(&cells.held, half);
            let m = moments(&cells.f.row(half), held, driving.row(half));
            to.put(half, &velocity_at(face, &m, cells.taken.row(half), &law));
        }
        return;
    }
    // One by one, of which the compiler makes one run over all sixteen.
    for k in 0..CELLS {
        let m = moments(&cells.f.cell(k), Filling::cell(&cells.held, k), driving.cell(k));
        let law = physics.law.cell(&cells.own[k].law, cells.lanes[k]);
        to.put_cell(k, &velocity_at(face, &m, cells.taken.cell(k), &law));
    }
}

/// Velocity along the two tangents that a wall at a face needs.
#[inline(always)]
fn velocity_at<N: Number, L: Relaxation<N>>(face: usize, m: &Moments<N>, taken: [N; 2], law: &L) -> [N; 2] {
    let (axis, normal) = FACES[face];
    let across = |axis: usize| {
        let [t, s] = tangents(axis);
        ([m.stress[COMPONENT[axis][t]], m.stress[COMPONENT[axis][s]]], [m.force[t], m.force[s]])
    };
    // Known numbers, or it would go through memory.
    let (stress, force) = match axis {
        0 => across(0),
        1 => across(1),
        _ => across(2),
    };
    let normal = N::from_f64(-f64::from(normal));
    wall_velocity(m, [normal * stress[0], normal * stress[1]], taken, force, law)
}

for_this_processor! {
    /// [`wall_velocities`] for the processor at hand.
    wall_velocities_here = wall_velocities<T: Real, R: Law<T>>(
        cells: &Gathered<'_, T, R>,
        face: usize,
        physics: &Physics<T, R>,
        to: &mut Pair<T, 2>
    )
}
