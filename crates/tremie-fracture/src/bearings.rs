//! Where a beam is held and loaded, as linear functionals of its displacements.

use crate::lattice::{Lattice, combined};
use crate::mesh::{Facet, Mesh};
use crate::setup::{Loading, TrialError};
use crate::sparse::Functional;
use tremie_numerics::DVec3;

/// Width in m over which a support or a load bears at least.
const BEARING: f64 = 0.01;

/// A line across a side of the beam, at `at` along x, as the mean displacement there along a direction: a platen without friction that tilts freely.
///
/// The facets near it have weights such that sum w = 1 and their first moments about the line's middle vanish: the load has no eccentricity.
pub(crate) fn line(
    lattice: &Lattice,
    mesh: &Mesh,
    side: usize,
    direction: DVec3,
    at: f64,
    coarsest: f64,
    place: &'static str,
) -> Result<Functional, TrialError> {
    let reach = f64::max(1.2 * coarsest, 0.05 * mesh.size.x);
    let near: Vec<&Facet> =
        mesh.sides[side].iter().filter(|facet| (facet.centroid.x - at).abs() < reach).collect();
    let size = (near.iter().map(|facet| facet.area).sum::<f64>() / near.len().max(1) as f64).sqrt();
    // As wide as it must be to hold a facet for every two along the line; next to the crack plane the nearest are half a distance away.
    let mut width = f64::max(BEARING, 0.8 * size);
    let facets: Vec<&&Facet> = loop {
        let facets: Vec<_> =
            near.iter().filter(|facet| (facet.centroid.x - at).abs() < 0.5 * width).collect();
        if facets.len() as f64 >= f64::max(4.0, 0.5 * mesh.size.y / size) {
            break facets;
        }
        if near.is_empty() || width > 4.0 * size {
            return Err(TrialError::Coarse { place });
        }
        width *= 1.25;
    };
    let area: f64 = facets.iter().map(|facet| facet.area).sum();
    let middle = 0.5 * mesh.size.y;
    // a (l0 + l1 x + l2 y), by Cramer's rule on the moments of the areas.
    let terms =
        |facet: &Facet| DVec3::new(1.0, (facet.centroid.x - at) / width, (facet.centroid.y - middle) / width);
    let mut moments = tremie_numerics::DMat3::ZERO;
    for facet in &facets {
        let t = terms(facet);
        moments += tremie_numerics::DMat3::from_cols(t * t.x, t * t.y, t * t.z) * (facet.area / area);
    }
    if moments.determinant().abs() < 1e-12 {
        return Err(TrialError::Coarse { place });
    }
    let lambda = moments.inverse() * DVec3::X / area;
    Ok(facets
        .iter()
        .map(|facet| {
            let weight = facet.area * lambda.dot(terms(facet));
            (facet.cell, lattice.displacement(facet.cell, facet.centroid, weight * direction))
        })
        .collect())
}

/// Where supports and loads are.
fn places(mesh: &Mesh, loading: Loading) -> ([f64; 2], Vec<f64>) {
    let middle = 0.5 * mesh.size.x;
    match loading {
        Loading::FourPoint { span, inner } => {
            ([middle - 0.5 * span, middle + 0.5 * span], vec![middle - 0.5 * inner, middle + 0.5 * inner])
        }
        Loading::ThreePoint { span } => ([middle - 0.5 * span, middle + 0.5 * span], vec![middle]),
        Loading::Tension => ([0.0, mesh.size.x], Vec::new()),
    }
}

/// The deflection of the loads against the supports; as a load, both of them.
pub(crate) fn bend(
    lattice: &Lattice,
    mesh: &Mesh,
    loading: Loading,
    coarsest: f64,
) -> Result<Functional, TrialError> {
    let (supports, loads) = places(mesh, loading);
    let mut parts = Vec::new();
    for at in supports {
        parts.push((0.5, line(lattice, mesh, 4, DVec3::Z, at, coarsest, "a support")?));
    }
    for at in &loads {
        parts.push((-1.0 / loads.len() as f64, line(lattice, mesh, 5, DVec3::Z, *at, coarsest, "a load")?));
    }
    Ok(combined(&parts.iter().map(|(factor, part)| (*factor, part)).collect::<Vec<_>>()))
}

/// The deflection in the middle at half the height, against half the height over the supports.
pub(crate) fn sag(lattice: &Lattice, mesh: &Mesh, loading: Loading) -> Result<Functional, TrialError> {
    let level = |at: f64| {
        // Of the cells there, as many on both sides of the middle of the span.
        let mut cells: Vec<(f64, usize)> = (0..mesh.nodes.len())
            .map(|n| ((mesh.nodes[n].x - at).hypot(mesh.nodes[n].z - 0.5 * mesh.size.z), n))
            .collect();
        cells.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        cells.truncate(12);
        let weight = 1.0 / cells.len() as f64;
        let point = |n: usize| DVec3::new(at, mesh.nodes[n].y, 0.5 * mesh.size.z);
        cells
            .into_iter()
            .map(|(_, n)| (n, lattice.displacement(n, point(n), weight * DVec3::Z)))
            .collect::<Functional>()
    };
    let (supports, _) = places(mesh, loading);
    let [left, right] = supports.map(level);
    Ok(combined(&[(0.5, &left), (0.5, &right), (-1.0, &level(0.5 * mesh.size.x))]))
}
