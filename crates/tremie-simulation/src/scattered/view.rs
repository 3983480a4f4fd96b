//! The state of nodes as gauges and writers see it: on cells as wide as the particles are apart.
//!
//! With the kernel W over three spacings, `c = sum V W` over particles and their images is 1 inside of the fluid, 0 outside, and a half at a flat surface, where it changes by `s` over a
//! cell: a cell is filled to `1/2 + (c - 1/2)/s`, between 0 and 1. So the surface of a fluid that fills half of space lies where it does, to a small part of a cell, and the sum of fills
//! tells the volume that particles enclose, not how many there are. What else is known of a cell is the mean over particles and images with the weights V W.
//!
//! Particles at the surface have no pressure, but are half a spacing below it: as much fluid weighs on all of them, which is added to what is shown.

use rayon::prelude::*;
use tremie_case::{Case, Side};
use tremie_cloud::{Dimension, Kernel, Seen, Smoothing, Space, Standing};
use tremie_numerics::DVec3;

use crate::{Cells, Fluid, Snapshot, SolidLoad, Wall, WallFace, WallLoads};

/// Smoothing length in spacings.
const LENGTH: f64 = 1.5;
/// Share of a cell by which it counts as one that holds fluid.
const WET: f64 = 1e-3;

/// Change of c over a cell at a flat surface: the kernel's integral over a plane through its middle, times the spacing.
fn slope(kernel: &Smoothing, dimension: Dimension, spacing: f64) -> f64 {
    const STEPS: usize = 200;
    let width = kernel.support() / STEPS as f64;
    let at = |n: usize| {
        let r = (n as f64 + 0.5) * width;
        let around = if dimension == Dimension::Two { 2.0 } else { std::f64::consts::TAU * r };
        around * kernel.weight(r) * width
    };
    spacing * (0..STEPS).map(at).sum::<f64>()
}

/// Sums over particles and their images in a cell.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    share: f64,
    pressure: f64,
    velocity: DVec3,
    shear_rate: f64,
    stress: f64,
}

/// A force on a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pull {
    /// The wall, by its number in the space of the nodes.
    pub wall: usize,
    /// Where it acts, in m.
    pub at: DVec3,
    /// The force in N, of a slice as deep as nodes are apart where they are in a plane.
    pub force: DVec3,
}

/// Nodes of a fluid at a moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scattered<'a> {
    /// The case.
    pub case: &'a Case,
    /// Where nodes are, and its walls.
    pub space: &'a Space,
    /// Whose walls these are.
    pub whose: &'a [Wall],
    /// Time in s.
    pub time: f64,
    /// Length of a step in s.
    pub step: f64,
    /// Places in m.
    pub positions: &'a [DVec3],
    /// Velocities in m/s.
    pub velocities: &'a [DVec3],
    /// Pressures in Pa.
    pub pressures: &'a [f64],
    /// Shear rates in 1/s.
    pub shear_rates: &'a [f64],
    /// Apparent viscosities in Pa s.
    pub viscosities: &'a [f64],
    /// Nodes that have left.
    pub left: u64,
}

impl Scattered<'_> {
    /// Puts what there is to see, if walls are pulled so by what is viscous in the fluid, in place of what was seen before.
    pub(super) fn show(&self, pulls: &[Pull], snapshot: &mut Snapshot) {
        let cells = self.cells(std::mem::take(&mut snapshot.fluid));
        let faces = self.faces(&cells);
        let (solids, sides) = self.loads(&faces, pulls);
        let walls = WallLoads { sides, inlets: Vec::new(), faces };
        *snapshot = Snapshot {
            time: self.time,
            fluid: Fluid::Cells(cells),
            solids,
            moved: self.moved(),
            walls,
            outflow: self.case.has_outlets().then(|| self.left as f64 * self.space.spacing.powi(3)),
            ..Snapshot::default()
        };
    }

    /// How far in m solids are from where they are drawn.
    fn moved(&self) -> Vec<DVec3> {
        let solids =
            self.space.walls.iter().zip(self.whose).filter(|(_, whose)| matches!(whose, Wall::Solid(_)));
        solids.map(|(wall, _)| wall.motion.offset(self.time)).collect()
    }

    /// Weight in N/m3 but for what drives a flow along periodic axes.
    fn confined(&self) -> DVec3 {
        let free = DVec3::from(self.space.periodic.map(|periodic| if periodic { 0.0 } else { 1.0 }));
        self.case.material.density * free * self.case.domain.gravity
    }

    /// Pressure in Pa of a node's image so far from it in m, with the weight of the half spacing above the surface.
    fn pressure(&self, of: usize, off: DVec3) -> f64 {
        let weight = self.confined();
        self.pressures[of] + weight.dot(off) + 0.5 * self.space.spacing * weight.length()
    }

    /// First cell and number of cells along each axis of a box around nodes and all that see them, and around solids that meet the domain; none without nodes.
    fn window(&self, reach: f64, solids: &[&Standing]) -> [[usize; 3]; 2] {
        let (domain, size) = (&self.case.domain, self.space.spacing);
        let whole = domain.cells(size);
        let around = |(low, high): (DVec3, DVec3), at: DVec3| (low + at, high + at);
        let meets =
            |(low, high): &(DVec3, DVec3)| low.cmplt(domain.max).all() && high.cmpgt(domain.min).all();
        let nodes = self.positions.iter().map(|at| around((DVec3::splat(-reach), DVec3::splat(reach)), *at));
        let solids = solids.iter().map(|solid| around(solid.body.bounds(), solid.offset)).filter(meets);
        let (low, high) = nodes
            .chain(solids)
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (a, b)| (low.min(a), high.max(b)));
        let place = |at: f64, axis: usize| (at - domain.min[axis]) / size;
        let first = [0, 1, 2].map(|axis| (place(low[axis], axis).max(0.0) as usize).min(whole[axis]));
        let end = [0, 1, 2].map(|axis| (place(high[axis], axis).ceil().max(0.0) as usize).min(whole[axis]));
        let count = [0, 1, 2].map(|axis| end[axis].saturating_sub(first[axis]));
        if self.positions.is_empty() || count.contains(&0) { [[0; 3]; 2] } else { [first, count] }
    }

    /// The cells around the fluid, in the memory of cells that are used up.
    fn cells(&self, Fluid::Cells(used): Fluid) -> Cells {
        let (space, domain) = (self.space, &self.case.domain);
        let size = space.spacing;
        let kernel = Smoothing::new(Kernel::Wendland, space.dimension, LENGTH * size);
        let standing = space.standing(self.time);
        let solids: Vec<&Standing> =
            standing.iter().zip(&space.walls).filter(|(_, wall)| wall.hides).map(|(at, _)| at).collect();
        let [first, count] = self.window(kernel.support(), &solids);
        let cells = Cells {
            origin: domain.min + size * DVec3::from(first.map(|n| n as f64)),
            size,
            density: self.case.material.density,
            domain: [domain.min, domain.max],
            symmetry: [0, 1, 2].map(|a| [0, 1].map(|s| domain.sides[2 * a + s] == Side::Symmetry)),
            cage: None,
            batches: Vec::new(),
            structure: None,
            lying: None,
            ..used
        };
        let mut cells = cells.blank(count);
        let slope = slope(&kernel, space.dimension, size);
        let yield_stress = self.case.material.curve.viscoplastic().map_or(0.0, |law| law.yield_stress);
        for (n, sum) in self.sums(&cells, &kernel, &standing, &solids).iter().enumerate() {
            let at = cells.centre(n % count[0], n / count[0] % count[1], n / (count[0] * count[1]));
            if solids.iter().any(|solid| solid.signed_distance(at) < 0.0) {
                cells.solid[n] = 1;
                continue;
            }
            let fill = (0.5 + (sum.share - 0.5) / slope).min(1.0);
            if fill < WET || sum.share == 0.0 {
                continue;
            }
            let mean = 1.0 / sum.share;
            cells.fill[n] = fill;
            cells.pressure[n] = mean * sum.pressure;
            cells.velocity[n] = mean * sum.velocity;
            cells.stress[n] = mean * sum.stress;
            cells.shear_rate[n] = if cells.stress[n] > yield_stress { mean * sum.shear_rate } else { 0.0 };
        }
        cells
    }

    /// Sums over particles, their images and copies in all cells that see them; `solids` are those of the walls, as they are `standing`, that hide what is behind them.
    fn sums(
        &self,
        cells: &Cells,
        kernel: &Smoothing,
        standing: &[Standing],
        solids: &[&Standing],
    ) -> Vec<Sum> {
        let (space, volume) = (self.space, self.space.volume());
        let [nx, ny, nz] = cells.count;
        let mut sums = vec![Sum::default(); nx * ny * nz];
        if sums.is_empty() {
            // Layers of nothing cannot be told apart.
            return sums;
        }
        let (number, reach) = (self.positions.len(), kernel.support());
        let seen = Seen::new(self.positions, space, self.time, self.step, reach);
        // Which cells along an axis see a place.
        let range = |at: DVec3, axis: usize| {
            if space.dimension == Dimension::Two && axis == 1 {
                return 0..1;
            }
            let (place, reach) = ((at[axis] - cells.origin[axis]) / cells.size, reach / cells.size);
            let end = ((place + reach + 0.5).floor().max(0.0) as usize).min(cells.count[axis]);
            ((place - reach - 0.5).ceil().max(0.0) as usize).min(end)..end
        };
        let near = |at: &DVec3| -> Vec<&Standing> {
            solids.iter().copied().filter(|solid| solid.signed_distance(*at) < reach).collect()
        };
        let near: Vec<Vec<&Standing>> = self.positions.par_iter().map(near).collect();
        let mut of_layers: Vec<Vec<usize>> = vec![Vec::new(); nz];
        for (n, at) in seen.positions.iter().enumerate() {
            of_layers[range(*at, 2)].iter_mut().for_each(|layer| layer.push(n));
        }
        sums.par_chunks_mut(nx * ny).zip(&of_layers).enumerate().for_each(|(k, (sums, layer))| {
            for n in layer {
                let (at, source) = (seen.positions[*n], &seen.sources[*n]);
                let of = source.of;
                let image = n.checked_sub(number).and_then(|image| seen.images.get(image));
                let hidden = |centre: DVec3| match image {
                    Some(image) => {
                        let wall = image.wall as usize;
                        space.walls[wall].hides && !image.is_seen_from(centre, &standing[wall])
                    }
                    None => near.get(*n).is_some_and(|near| near.iter().any(|wall| wall.blocks(centre, at))),
                };
                let rate = self.shear_rates[of];
                let (pressure, stress) = (self.pressure(of, source.off), self.viscosities[of] * rate);
                let velocity = source.turn * self.velocities[of] + source.carried;
                for j in range(at, 1) {
                    for i in range(at, 0) {
                        let centre = cells.centre(i, j, k);
                        let weight = volume * kernel.weight(centre.distance(at));
                        if weight > 0.0 && !hidden(centre) {
                            let sum = &mut sums[i + nx * j];
                            sum.share += weight;
                            sum.pressure += weight * pressure;
                            sum.velocity += weight * velocity;
                            sum.shear_rate += weight * rate;
                            sum.stress += weight * stress;
                        }
                    }
                }
            }
        });
        sums
    }

    /// Pieces of wall beside cells that hold fluid, with what presses on them: the pressure in the cell, and the weight of half a cell below it.
    fn faces(&self, cells: &Cells) -> Vec<WallFace> {
        let (domain, size) = (&self.case.domain, cells.size);
        let weight = cells.density * self.case.domain.gravity;
        let [nx, ny, _] = cells.count;
        let whole = domain.cells(size);
        let first = ((cells.origin - domain.min) / size).to_array().map(|n| n.round() as usize);
        let standing: Vec<(usize, Standing)> = {
            let all = self.space.standing(self.time).into_iter().zip(self.whose);
            all.filter_map(|(at, whose)| match whose {
                Wall::Solid(number) => Some((*number, at)),
                Wall::Side(_) => None,
            })
            .collect()
        };
        let mut faces = Vec::new();
        for n in (0..cells.fill.len()).filter(|n| cells.fill[*n] > 0.0) {
            let place = [n % nx, n / nx % ny, n / (nx * ny)];
            let centre = cells.centre(place[0], place[1], place[2]);
            for side in 0..6 {
                let (axis, upper) = (side / 2, side % 2 == 1);
                let out = DVec3::AXES[axis] * if upper { 1.0 } else { -1.0 };
                let edge = if upper { cells.count[axis] - 1 } else { 0 };
                let side_of_domain = if upper { whole[axis] - 1 } else { 0 };
                let wall = if first[axis] + place[axis] == side_of_domain {
                    let bears = matches!(domain.sides[side], Side::Wall { .. } | Side::Symmetry);
                    bears.then_some(Wall::Side(side))
                } else if place[axis] == edge {
                    // Beyond the box there are no solids.
                    None
                } else {
                    let stride = [1, nx, nx * ny][axis];
                    let beyond = if upper { n + stride } else { n - stride };
                    let inside = |(_, at): &&(usize, Standing)| at.signed_distance(centre + size * out) < 0.0;
                    let solid = (cells.solid[beyond] == 1).then(|| standing.iter().find(inside)).flatten();
                    solid.map(|(number, _)| Wall::Solid(*number))
                };
                let Some(wall) = wall else { continue };
                let pressure = cells.pressure[n] + weight.dot(0.5 * size * out);
                let (fill, area) = (cells.fill[n], size * size);
                faces.push(WallFace {
                    wall,
                    cell: centre,
                    normal: -out,
                    fill,
                    area,
                    force: pressure * area * fill,
                });
            }
        }
        faces
    }

    /// Loads on solids, and on the sides of the domain: pressures on their faces, and what the viscous part pulls.
    fn loads(&self, faces: &[WallFace], pulls: &[Pull]) -> (Vec<SolidLoad>, [SolidLoad; 6]) {
        let mut solids = vec![SolidLoad::default(); self.case.solids.len()];
        let mut sides = [SolidLoad::default(); 6];
        let mut add = |wall: Wall, force: DVec3, at: DVec3| {
            let load = match wall {
                Wall::Side(number) => &mut sides[number],
                Wall::Solid(number) => &mut solids[number],
            };
            load.force += force;
            load.moment += at.cross(force);
        };
        for face in faces {
            let at = face.cell - 0.5 * self.space.spacing * face.normal;
            add(face.wall, -face.force * face.normal, at);
        }
        for pull in pulls {
            // On planes of symmetry only what is across them, which is pressure.
            let bears = match self.whose[pull.wall] {
                Wall::Side(number) => matches!(self.case.domain.sides[number], Side::Wall { .. }),
                Wall::Solid(_) => true,
            };
            if bears {
                add(self.whose[pull.wall], pull.force, pull.at);
            }
        }
        (solids, sides)
    }
}
