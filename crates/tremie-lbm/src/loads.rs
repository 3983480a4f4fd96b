//! What walls bear: solids, walls along the sides of the domain, and planes of symmetry.
//!
//! The force on a wall is the momentum that its links exchange (Galilean invariant: Wen, Zhang, Tu, Wang and Fang 2014), u_s being the
//! wall's velocity:
//!
//! ```text
//!     F = sum over links of (c_out - u_s) f_out - (c_in - u_s) f_in
//! ```
//!
//! of what has come in from the wall and what goes out to it at the same time, before and after a collision: the mean of two steps. (In a step alone it is off by what lattices keep for ever,
//! the momentum of every other layer of cells at every other step, whose sign changes: after a plate has started at once, by a half of the force.)
//! With f less the weights, pressure counts from that of the air. All that flows past has its share in it, and the forces on all walls together
//! are what the cells lose in momentum. A plane of symmetry bears in the same way what the mirror image
//! pushes back across it.
//!
//! At the uniform pressure p a link bears `2 w rho c = 6 w c p`. So the links of a cell stand for the area `sum 6 w c` of wall, a whole face
//! of the cell where the wall lies along the lattice, and force over area is the normal stress on the wall: at rest that of the cell's centre
//! beside an upright wall, and that of the bottom on a bottom.
//!
//! A link into the edge between two walls, or a wall and a plane of symmetry, is shared: each bears what is across it. Along a wall a part of it may thereby bear a sixth of a
//! cell's body force too little or too much, which the links at the wall's edges make up for: forces along a wall are
//! exact on the whole of it.

use tremie_numerics::DVec3;
use tremie_simulation::Wall;

use crate::lanes::{LANES, Lanes};
use crate::lattice::{C, Q, W, opposite, vector};
use crate::real::Real;
use crate::rows::SurfaceRow;
use crate::solids::{Contacts, Touching};
use crate::source::Source;
use crate::topology::Boundary;

/// Area of wall beside a cell, in faces of a cell, from which on a force over it is a stress.
const LEAST_AREA: f64 = 0.05;

/// What walls bear, in lattice units.
#[derive(Debug, Clone, Default)]
pub(crate) struct Loads {
    /// Force and moment about the origin of coordinates on each side of the domain.
    pub(crate) sides: [[DVec3; 2]; 6],
    /// The same on each solid.
    pub(crate) solids: Vec<[DVec3; 2]>,
    /// The same on the bars of each cage.
    pub(crate) cages: Vec<[DVec3; 2]>,
    /// Pieces of wall.
    pub(crate) faces: Vec<Face>,
}

/// The wall beside one cell.
#[derive(Debug, Clone)]
pub(crate) struct Face {
    pub(crate) wall: Wall,
    /// Centre of the cell.
    pub(crate) at: DVec3,
    /// Unit normal, into the fluid.
    pub(crate) normal: DVec3,
    /// Area, in faces of a cell.
    pub(crate) area: f64,
    /// Force that presses on it.
    pub(crate) force: f64,
}

impl Loads {
    pub(crate) fn new(solids: usize, cages: usize) -> Self {
        let none = |n: usize| vec![[DVec3::ZERO; 2]; n];
        Self { solids: none(solids), cages: none(cages), ..Self::default() }
    }

    /// Adds what a cage bears at a place.
    pub(crate) fn bear_cage(&mut self, cage: usize, force: DVec3, at: DVec3) {
        push(&mut self.cages[cage], force, at);
    }

    /// Adds those of another part of the grid.
    pub(crate) fn add(&mut self, other: Self) {
        let sides = self.sides.iter_mut().zip(other.sides);
        let solids = self.solids.iter_mut().zip(other.solids);
        let pairs = sides.chain(solids).chain(self.cages.iter_mut().zip(other.cages));
        for (load, more) in pairs {
            load[0] += more[0];
            load[1] += more[1];
        }
        self.faces.extend(other.faces);
    }
}

/// Adds a force and its moment about the origin.
fn push([force, moment]: &mut [DVec3; 2], more: DVec3, at: DVec3) {
    *force += more;
    *moment += at.cross(more);
}

impl<T: Real> Source<'_, T> {
    /// The side of the domain that a link along `c` into the cell `at` has come through along an axis, if it has through one.
    fn crossed(&self, at: [usize; 3], c: [i32; 3], axis: usize) -> Option<usize> {
        let (last, place) = (self.topology.cells[axis] - 1, at[axis]);
        match c[axis] {
            1 if place == 0 => Some(2 * axis),
            -1 if place == last => Some(2 * axis + 1),
            _ => None,
        }
    }

    /// Adds up what the walls bear around the cells of a row that hold fluid (`wet`), into which `f` arrive and of which `leaving` tells what the
    /// collision makes; `around` is what lies beside a surface row.
    pub(crate) fn bear(
        &self,
        first: usize,
        wet: u8,
        around: Option<(&SurfaceRow, &Contacts)>,
        f: &[Lanes<T>; Q],
        leaving: impl Fn(usize) -> [T; Q],
        loads: &mut Loads,
    ) {
        for k in (0..LANES).filter(|k| wet >> k & 1 == 1) {
            let cell = self.links.coordinates(first + k);
            let inside = (0..3).all(|a| (1..self.topology.cells[a] - 1).contains(&cell[a]));
            if inside && around.is_none_or(|(row, _)| row.any_immersed >> k & 1 == 0) {
                continue;
            }
            let leave = leaving(k);
            let at = DVec3::from(cell.map(|n| n as f64)) + 0.5;
            let touching: Touching = around.map_or([None; 3], |(_, contacts)| contacts[k]);
            // Area and force across each side, and across each solid surface.
            let (mut sides, mut solid) = ([[0.0; 2]; 6], [[0.0; 2]; 3]);
            for i in 1..Q {
                let (arriving, leaving) = (f[i].0[k].to_f64(), leave[opposite(i)].to_f64());
                let is = |bits: u8| bits >> k & 1 == 1;
                let (c, middle) = (vector(i), at - 0.5 * vector(i));
                let side = |a: usize| self.crossed(cell, C[i], a);
                let kind = |side: usize| self.topology.sides[side / 2][side % 2];
                let Some((row, _)) = around.filter(|(row, _)| is(row.solid[i])) else {
                    // Fluid or air: across a plane of symmetry its mirror image.
                    for side in (0..3).filter_map(side).filter(|side| kind(*side) == Boundary::Symmetry) {
                        let across = DVec3::AXES[side / 2] * c[side / 2];
                        push(&mut loads.sides[side], -across * (leaving + arriving), middle);
                        sides[side][0] += 6.0 * W[i];
                        sides[side][1] += leaving + arriving;
                    }
                    continue;
                };
                // Which components of what is exchanged solids bear: into the edge between one and a side, those across it.
                let mut by_solid = DVec3::ZERO;
                for (contact, solid) in touching.iter().zip(&mut solid) {
                    let Some(contact) = contact else { continue };
                    let velocity = contact.velocity;
                    let (mut bears, mut force) = (DVec3::ZERO, DVec3::ZERO);
                    if contact.has(i) {
                        bears = DVec3::ONE;
                        force = (-c - velocity) * leaving - (c - velocity) * arriving;
                    } else if !is(row.immersed[i]) {
                        let borne = |a: usize| {
                            let axis = (1..=6).find(|j| C[*j][a] != 0 && C[*j][a] == C[i][a]);
                            f64::from(u8::from(axis.is_some_and(|j| contact.has(j))))
                        };
                        bears = DVec3::new(borne(0), borne(1), borne(2));
                        force = -c * bears * (leaving + arriving);
                    }
                    by_solid += bears;
                    push(&mut loads.solids[contact.solid], force, middle);
                    solid[0] += 6.0 * W[i] * (bears * c).dot(contact.normal);
                    solid[1] -= force.dot(contact.normal);
                }
                let bears = |side: &usize| matches!(kind(*side), Boundary::Wall(_) | Boundary::Symmetry);
                let there = || (0..3).filter_map(side).filter(bears);
                let alone = there().count() == 1;
                for side in there() {
                    let axis = side / 2;
                    let across = if alone { DVec3::ONE } else { DVec3::AXES[axis] };
                    let borne = across * (DVec3::ONE - by_solid);
                    push(&mut loads.sides[side], -c * borne * (leaving + arriving), middle);
                    sides[side][0] += 6.0 * W[i] * borne[axis];
                    sides[side][1] += borne[axis] * (leaving + arriving);
                }
            }
            let mut note = |wall: Wall, normal: DVec3, [area, force]: [f64; 2]| {
                if area > LEAST_AREA {
                    loads.faces.push(Face { wall, at, normal, area, force });
                }
            };
            for (side, sums) in sides.into_iter().enumerate() {
                let inwards = DVec3::AXES[side / 2] * if side % 2 == 0 { 1.0 } else { -1.0 };
                note(Wall::Side(side), inwards, sums);
            }
            for (contact, sums) in touching.iter().flatten().zip(solid) {
                note(Wall::Solid(contact.solid), contact.normal, sums);
            }
        }
    }
}
