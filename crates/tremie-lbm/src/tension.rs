//! Surface tension: what the curved surface presses on the fluid.
//!
//! The air has density 1 in lattice units, and fluid behind a surface of mean curvature kappa/2 (kappa = 2/R of a sphere, positive where fluid bulges) and tension sigma bears sigma kappa more than the air does. So
//! populations that come from the air are those of a gas of density
//!
//! ```text
//!     rho = 1 + 3 sigma kappa
//! ```
//!
//! (Svec 2013, Eq. 2.16 has 1; Koerner et al. 2005, Eq. 15). The curvature is that of the paraboloid through the planes of the interface cells around (Lehmann 2021): in coordinates s, t along the cell's own plane and z from it out of
//! the fluid,
//!
//! ```text
//!     z = A s^2 + B t^2 + C s t + H s + I t,    kappa = -2 (A (1 + I^2) + B (1 + H^2) - C H I) / (1 + H^2 + I^2)^(3/2)
//! ```
//!
//! by least squares, with all planes as steep as the cell's own. Planes that lie more out of that than aside belong to another surface, and count for nothing. Beyond walls the surface goes on mirrored: it meets them at a right angle.
//!
//! Cells that become liquid or air leave the surface rough by a hundredth of a cell, and in cells that are all but full or empty a paraboloid is wrong by up to a fifth of 2/R of a drop of ten cells. So what presses is the mean of the
//! cell's own curvature, which counts [`OWN`] times, and of those around, by fill (1 - fill). In a drop of 12 cells that lies still the fastest fluid is then slower fiftyfold in stiff fluid and ninefold in thin. The mean of all alike does
//! not see a surface that goes up and down from cell to cell, or sees it the wrong way round: a drop of thin fluid shook itself to pieces. So it did by curvatures of heights over an axis (Cummins, Francois and Kothe 2005), which are more exact
//! for smooth surfaces, but see what is rough several times over.

use rayon::prelude::*;
use tremie_case::Case;
use tremie_numerics::{DVec3, definite};

use crate::grid::{AT_ONCE, Fill, Grid};
use crate::lanes::{LANES, Lanes};
use crate::plane::{around, depth, normal};
use crate::real::{Number, Real, larger};
use crate::rows::{Rows, SurfaceRow};
use crate::scaling::Scaling;
use crate::source::Fills;

/// Largest curvature 2/R, in 1/cells: no drop is smaller than a cell.
const LARGEST: f64 = 2.0;
/// How many times a cell's own curvature counts, and the least of a plane that it counts for.
const OWN: f64 = 12.0;
const LEAST: f64 = 1e-4;
/// Share of a coefficient that must be independent of the others.
const SINGULAR: f64 = 1e-6;

/// The tension of a surface, and what it presses on the fluid behind it.
pub(crate) struct Tension<T> {
    /// In N/m.
    of: f64,
    /// In lattice units.
    strength: f64,
    /// Curvature of the surface in interface cells, by slot.
    bends: Vec<Box<Fill<T>>>,
    /// By how much the density of the air is more than 1 there.
    excess: Vec<Box<Fill<T>>>,
}

impl<T: Real> Tension<T> {
    /// That of a case, if it has any.
    pub(crate) fn new(case: &Case, scaling: &Scaling) -> Option<Self> {
        let of = case.material.surface_tension;
        (of > 0.0).then(|| Self { of, strength: scaling.tension(of), bends: Vec::new(), excess: Vec::new() })
    }

    /// Goes on with another time step.
    pub(crate) fn rescale(&mut self, scaling: &Scaling) {
        self.strength = scaling.tension(self.of);
    }

    /// Without any blocks.
    pub(crate) fn emptied(&self) -> Self {
        Self { bends: Vec::new(), excess: Vec::new(), ..*self }
    }

    /// By how much the density of the air is more than 1 in the interface cells of a block.
    pub(crate) fn excess(&self, slot: usize) -> Option<&Fill<T>> {
        self.excess.get(slot).map(|excess| &**excess)
    }

    pub(crate) fn bytes(&self) -> usize {
        (self.bends.len() + self.excess.len()) * size_of::<Fill<T>>()
    }
}

impl<T: Real> Grid<T> {
    /// Finds how the surface is curved, and what that presses, after cells have changed and before the next step.
    pub(crate) fn bend(&mut self, rows: &[Rows]) {
        let Self { tension, fills, links, .. } = self;
        let Some(Tension { strength, bends, excess, .. }) = tension else { return };
        let strength = Lanes::from_f64(3.0 * *strength);
        for values in [&mut *bends, &mut *excess] {
            values.resize_with(fills.len(), bytemuck::allocation::zeroed_box);
        }
        (bends.par_iter_mut(), rows).into_par_iter().enumerate().skip(2).with_max_len(AT_ONCE).for_each(
            |(slot, (bends, rows))| {
                let fills = Fills::new(&links[slot], fills, slot);
                for row in rows.surface.iter().filter(|row| row.kinds.interface != 0) {
                    let around = around(&fills, row);
                    let normals = normal(&around);
                    let mut found = Lanes::ZERO;
                    for k in (0..LANES).filter(|k| row.kinds.interface >> k & 1 == 1) {
                        let normal = DVec3::from(normals.map(|n| n.0[k].to_f64()));
                        let fill = around.map(|fill| fill.0[k].to_f64());
                        found.0[k] = T::from_f64(curvature(normal, &fill));
                    }
                    bends.put(0, usize::from(row.row) * LANES, found);
                }
            },
        );
        let bends = &*bends;
        (excess.par_iter_mut(), rows).into_par_iter().enumerate().skip(2).with_max_len(AT_ONCE).for_each(
            |(slot, (excess, rows))| {
                let (fills, bends) =
                    (Fills::new(&links[slot], fills, slot), Fills::new(&links[slot], bends, slot));
                for row in rows.surface.iter().filter(|row| row.kinds.interface != 0) {
                    excess.put(0, usize::from(row.row) * LANES, strength * smooth(&fills, &bends, row));
                }
            },
        );
    }
}

/// Means of the curvatures in the cells of a row and around, by how much of a plane there is in each, own ones counting [`OWN`] times.
fn smooth<T: Real>(fills: &Fills<'_, T>, bends: &Fills<'_, T>, row: &SurfaceRow) -> Lanes<T> {
    let (own, least) = (Lanes::from_f64(OWN), Lanes::from_f64(LEAST));
    let (mut sum, mut whole) = (Lanes::ZERO, Lanes::ZERO);
    for (n, (fill, bend)) in around(fills, row).into_iter().zip(around(bends, row)).enumerate() {
        let cut = fill * (Lanes::ONE - fill);
        let weight = if n == 13 { own * larger(cut, least) } else { larger(cut, Lanes::ZERO) };
        sum += weight * bend;
        whole += weight;
    }
    sum / whole
}

/// Curvature 2/R in 1/cells of the surface in a cell, by its normal out of the fluid and the fills of the 27 cells around it, x fastest; none where nothing tells it.
fn curvature(normal: DVec3, fill: &[f64; 27]) -> f64 {
    let Some(normal) = normal.try_normalize() else { return 0.0 };
    let (s, t) = normal.any_orthonormal_pair();
    let Some([a, b, c, h, i]) = paraboloid([s, t, normal], fill) else { return 0.0 };
    let slope = 1.0 + h * h + i * i;
    let bend = a * (1.0 + i * i) + b * (1.0 + h * h) - c * h * i;
    (-2.0 * bend / (slope * slope.sqrt())).clamp(-LARGEST, LARGEST)
}

/// A, B, C, H and I of the surface in a cell, by the axes of s, t and z and the fills around it; none where there are too few planes.
fn paraboloid(axes: [DVec3; 3], fill: &[f64; 27]) -> Option<[f64; 5]> {
    let depths = depths(axes[2], fill);
    let (mut moments, mut right) = ([[0.0; 5]; 5], [0.0; 5]);
    let cut = |n: &usize| fill[*n] > 0.0 && fill[*n] < 1.0 && *n != 13;
    for n in (0..27).filter(cut) {
        let way = DVec3::from([n % 3, n / 3 % 3, n / 9].map(|at| at as f64 - 1.0));
        let [s, t, z] = axes.map(|axis| way.dot(axis));
        let z = z + depths[n] - depths[13];
        if z * z > s * s + t * t {
            continue;
        }
        let powers = [s * s, t * t, s * t, s, t];
        for i in 0..5 {
            right[i] += powers[i] * z;
            for j in 0..=i {
                moments[i][j] += powers[i] * powers[j];
            }
        }
    }
    definite::solve(moments, right, SINGULAR)
}

/// How far in cells planes of a normal lie from the middles of their cells, out of the fluid, by the fills.
fn depths(normal: DVec3, fill: &[f64; 27]) -> [f64; 27] {
    let mut depths = [0.0; 27];
    for (fill, to) in fill.chunks(LANES).zip(depths.chunks_mut(LANES)) {
        let mut lanes = Lanes::ZERO;
        lanes.0[..fill.len()].copy_from_slice(fill);
        to.copy_from_slice(&depth(normal.to_array().map(Lanes::splat), lanes).0[..to.len()]);
    }
    depths
}

#[cfg(test)]
mod tests {
    use tremie_numerics::DVec3;

    use super::*;
    use crate::simulation::FreeSurface;

    /// A case with a fluid, in cells of 1 mm and without gravity.
    fn case(fluid: &str, sides: &str) -> Case {
        let text = format!(
            "title = \"Surface\"\nmethod = \"lbm\"\n\
             [material]\ndensity = \"1000 kg/m3\"\nnewtonian = {{ viscosity = \"20 mPa s\" }}\nsurface_tension = \"0.05 N/m\"\n\
             [domain]\nmin = [\"0 mm\", \"0 mm\", \"0 mm\"]\nmax = [\"30 mm\", \"30 mm\", \"30 mm\"]\n\
             gravity = [\"0 m/s2\", \"0 m/s2\", \"0 m/s2\"]\n{sides}\n\
             [[fluid]]\n{fluid}\n\
             [lbm]\ncell_size = \"1 mm\"\nprecision = \"f64\"\n[gauges]\ninterval = \"1 s\"\n[stop]\ntime = \"1 s\"\n"
        );
        Case::parse("surface.toml", &text).unwrap_or_else(|fault| panic!("{fault}"))
    }

    /// Curvature in 1/cells in all interface cells of a case at its start, with their places in cells.
    fn curvatures(case: &Case) -> Vec<(DVec3, f64)> {
        let fluid = FreeSurface::<f64>::new(case, None);
        let tension = fluid.grid.tension.as_ref().expect("the case has surface tension");
        let cells = fluid.grid.interface_cells();
        let of = |(slot, cell): (usize, usize)| {
            let place = DVec3::from(fluid.grid.links[slot].coordinates(cell).map(|n| n as f64)) + 0.5;
            let excess = tension.excess(slot).expect("all slots have it")[(0, cell)];
            (place, excess / (3.0 * tension.strength))
        };
        cells.map(of).collect()
    }

    #[test]
    fn drops_are_as_curved_as_they_are() {
        let sphere = "sphere = { centre = [\"15.3 mm\", \"14.9 mm\", \"15.2 mm\"], diameter = \"20 mm\" }";
        let found = curvatures(&case(sphere, ""));
        let mean = found.iter().map(|(_, curvature)| curvature).sum::<f64>() / found.len() as f64;
        let worst = found.iter().map(|(_, curvature)| (curvature - 0.2).abs()).fold(0.0, f64::max);
        assert!((mean / 0.2 - 1.0).abs() < 0.02, "mean {mean}");
        // The first fills are counted on 10 x 10 x 10 points.
        assert!(worst < 0.4 * 0.2, "worst {worst}");
    }

    #[test]
    fn a_half_sphere_on_a_mirror_or_a_wall_is_as_curved_as_a_whole_one() {
        let sphere = "sphere = { centre = [\"15.3 mm\", \"14.9 mm\", \"0 mm\"], diameter = \"20 mm\" }";
        let mirror = curvatures(&case(sphere, "[domain.sides]\nz_min = \"symmetry\""));
        let wall = curvatures(&case(sphere, ""));
        let lowest = |found: &[(DVec3, f64)]| -> Vec<f64> {
            found.iter().filter(|(place, _)| place.z < 1.0).map(|(_, curvature)| *curvature).collect()
        };
        assert_eq!(lowest(&mirror), lowest(&wall));
        for curvature in lowest(&mirror) {
            assert!((curvature / 0.2 - 1.0).abs() < 0.4, "{curvature}");
        }
    }

    #[test]
    fn what_is_flat_presses_nothing() {
        let pool =
            "box = { min = [\"0 mm\", \"0 mm\", \"0 mm\"], max = [\"30 mm\", \"30 mm\", \"10.3 mm\"] }";
        for (place, curvature) in curvatures(&case(pool, "")) {
            assert!(curvature.abs() < 1e-9, "{place}: {curvature}");
        }
    }
}
