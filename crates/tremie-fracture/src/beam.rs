//! A beam between its bearings: the lattice, what loads it and how it bends.

use std::collections::BTreeMap;

use crate::bearings::{bend, sag};
use crate::lattice::{Lattice, load};
use crate::mesh::Mesh;
use crate::setup::{Loading, Setup, TrialError};
use crate::shear_lag::ShearLag;
use crate::sparse::{Factor, Functional, UNKNOWNS};

/// A beam that is held and loaded, intact.
pub(crate) struct Beam {
    pub(crate) setup: Setup,
    pub(crate) mesh: Mesh,
    pub(crate) lattice: Lattice,
    /// What the load does work on.
    pub(crate) force: Functional,
    /// The deflection in the middle.
    pub(crate) middle: Functional,
    /// Pairs of cells across the crack plane.
    pub(crate) images: BTreeMap<usize, usize>,
    /// The plates of a test in tension, among the cells.
    pub(crate) plates: Vec<usize>,
    /// The elastic action of the fibres.
    pub(crate) lag: Option<ShearLag>,
}

impl Beam {
    /// Makes a lattice of the beam.
    pub(crate) fn new(setup: Setup) -> Result<Self, TrialError> {
        // Without a notch, no plane that a crack anywhere would find smoother than others.
        let even = setup.anywhere && setup.notch == 0.0;
        let mesh = if even {
            Mesh::even(setup.size, setup.grading.finest, setup.seed)
        } else {
            Mesh::new(setup.size, setup.crack, setup.grading, setup.seed)
        };
        if mesh.nodes.is_empty() || (!even && mesh.plane.len() < 4) {
            let place = if even { "the beam" } else { "the crack plane" };
            return Err(TrialError::Coarse { place });
        }
        let facets = mesh.facets.iter().filter(|_| setup.anywhere).chain(&mesh.plane);
        let length = facets.map(|facet| facet.length).fold(0.0, f64::max);
        let most = setup.softening.longest(setup.modulus);
        if length >= most {
            return Err(TrialError::Brittle { length, most });
        }
        let mut lattice = Lattice::of(&mesh, setup.modulus);
        let lag = setup.lag();
        let images = mesh.plane.iter().filter_map(|facet| Some((facet.cell, facet.other?))).collect();
        if let Some(lag) = lag.filter(|_| !setup.anywhere) {
            lag.stiffen(&mut lattice, &setup.fibres, &images);
        }
        let mut plates = Vec::new();
        let (force, middle) = match setup.loading {
            Loading::Tension => {
                let [low, high] = [0, 1].map(|side| lattice.plate(&mesh.sides[side], setup.modulus));
                lattice.fixed[low] = [true; UNKNOWNS];
                lattice.fixed[high] = [false, true, true, true, true, true];
                plates = vec![low, high];
                let pull = vec![(high, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])];
                (pull.clone(), pull)
            }
            bending => {
                let place = 0.25 * setup.size;
                let held = (0..mesh.nodes.len())
                    .min_by(|a, b| mesh.nodes[*a].distance(place).total_cmp(&mesh.nodes[*b].distance(place)));
                lattice.fixed[held.unwrap_or(0)] = [true; UNKNOWNS];
                let coarsest = if even { setup.grading.finest } else { setup.grading.coarsest };
                (bend(&lattice, &mesh, bending, coarsest)?, sag(&lattice, &mesh, bending)?)
            }
        };
        Ok(Self { setup, mesh, lattice, force, middle, images, plates, lag })
    }

    /// The load of 1 N: six numbers for each cell.
    pub(crate) fn load(&self) -> Vec<f64> {
        load(&self.force, self.lattice.nodes.len())
    }

    /// Residual of the intact beam under its load, as a share of the load.
    pub(crate) fn residual(&self, factor: &Factor) -> f64 {
        let load = self.load();
        let forces = self.lattice.forces(&factor.solve(&load));
        let mut worst = 0.0_f64;
        for (k, (found, asked)) in forces.iter().zip(&load).enumerate() {
            if !self.lattice.fixed[k / UNKNOWNS][k % UNKNOWNS] {
                worst = worst.max((found - asked).abs());
            }
        }
        worst / load.iter().fold(0.0_f64, |most, f| most.max(f.abs()))
    }
}
