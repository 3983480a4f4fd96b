//! The pressure that keeps the volume: at the places x* at the end of the step,
//!
//! ```text
//!     lap p' = div(rho u*/dt + grad p) - (rho |u*|/h) (n/n0 - 1) / dt,    p' = 0 at the free surface,    d p'/dn = rho g . n at walls
//! ```
//!
//! with n the share of the volume around that particles stand for and n0 that of a lattice (Asai et al. 2012): particles that have come too near to each other are driven apart, or a fluid that has splashed
//! would take less room than before, and drawn together deep inside where they stand too loosely; only where it flows, so that what is at rest stays there.
//!
//! All of it is found anew, not only its change: what the Laplacian sees of a pressure and the divergence of its gradient does not would add up from step to step.
//!
//! The Laplacian of Wu (2016, Eq. 20) is wrong for linear fields where part of the kernel is empty, which is two rows of particles below a surface, and wrong everywhere on disordered particles; so
//! the weights of its pairs are corrected as those of Lagrangian differencing dynamics are (`tremie_cloud::Gradients::laplacian`), and a hydrostatic pressure is exact on any cloud.
//!
//! Such operators are not each other's adjoints as those of the paper are, which alone keeps energy from growing; where neighbours are on one side only a pressure would even drive apart what
//! it should hold together. So whoever has neighbours on one side only is at the surface.

use rayon::prelude::*;
use tremie_cloud::{Failure, Gradients, Matrix, Method, Multigrid, Settings, solve};
use tremie_numerics::DVec3;

use crate::Fluid;
use crate::surroundings::{Source, Surroundings};

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-7, iterations: 500 };

/// Share of what particles stand too near to each other or too far apart that is taken back while one goes a smoothing length.
const RELAXES: f64 = 0.5;

/// Finds `values` whose Laplacian is `source`, zero at the surface; those of images are those of their particles and `beyond`. Gives the iterations that it took.
fn poisson(
    around: &Surroundings,
    gradients: &Gradients,
    surface: &[bool],
    source: impl Fn(usize) -> f64 + Sync,
    beyond: impl Fn(&Source) -> f64 + Sync,
    values: &mut [f64],
) -> Result<usize, Failure> {
    // Without a surface they are known but for a constant.
    let pinned = !surface.contains(&true);
    let row = |a: usize| {
        let weights = if surface[a] || (pinned && a == 0) { None } else { gradients.laplacian(a) };
        let Some(weights) = weights else { return (1.0, Vec::new(), 0.0) };
        let (mut own, mut others, mut right) = (0.0, Vec::<(u32, f64)>::new(), -source(a));
        for ((_, _, source), c) in around.around(a).zip(weights) {
            right += c * beyond(source);
            if source.of != a {
                own += c;
                others.push((source.of as u32, -c));
            }
        }
        // In the order of particles, and of the images of each.
        others.sort_by_key(|(of, _)| *of);
        others.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            kept.1 += if same { next.1 } else { 0.0 };
            same
        });
        (own, others, right)
    };
    let rows = around.each(row);
    let right: Vec<f64> = rows.iter().map(|(_, _, right)| *right).collect();
    let matrix = Matrix::from_rows(rows.into_iter().map(|(own, others, _)| (own, others)));
    let multigrid = Multigrid::new(&matrix, &around.positions[..around.number], around.spacing);
    Ok(solve(&matrix, Some(&multigrid), &right, values, &SETTINGS)?.iterations)
}

/// What an image's pressure in Pa is more than that of its particle: the weight of the fluid between them.
fn weight(fluid: &Fluid, source: &Source) -> f64 {
    fluid.density * fluid.gravity.dot(source.off)
}

/// The pressures in Pa under which fluid that is about to fall is held by walls.
pub(crate) fn at_rest(around: &Surroundings, fluid: &Fluid) -> Result<Vec<f64>, Failure> {
    let mut pressures = vec![0.0; around.number];
    let gradients = around.gradients();
    let beyond = |source: &Source| weight(fluid, source);
    poisson(around, &gradients, &around.surface(), |_| 0.0, beyond, &mut pressures)?;
    Ok(pressures)
}

/// Gradients of pressures, in Pa/m.
pub(crate) fn gradients(around: &Surroundings, fluid: &Fluid, pressures: &[f64]) -> Vec<DVec3> {
    let gradients = around.gradients();
    let all = around.mirrored(|source| pressures[source.of] + weight(fluid, source));
    around.each(|a| gradients.gradient(a, &all))
}

/// Takes off velocities in m/s, which `pushed` in Pa/m, the gradients of the `pressures` in Pa before, have changed in a step of `step` in s, what is not free of
/// divergence, and finds the pressures that this takes. Gives the iterations.
pub(crate) fn project(
    around: &Surroundings,
    fluid: &Fluid,
    pushed: &[DVec3],
    pressures: &mut [f64],
    velocities: &mut [DVec3],
    step: f64,
) -> Result<usize, Failure> {
    let (gradients, surface) = (around.gradients(), around.surface());
    let all = around.velocities(velocities);
    let weight_of = fluid.density * fluid.gravity;
    let pushes = around.mirrored(|source| weight_of + source.mirror * (pushed[source.of] - weight_of));
    // Share of the volume that kernels tell of, over that of a lattice. What differs from one particle to the next is disorder, and would brake the flow.
    let length = 0.5 * around.kernel.support();
    let whole = around.on_lattice(|r| around.kernel.weight(r));
    let crowding = |a: usize| {
        let deep = !surface[a] && around.around(a).all(|(_, _, source)| !surface[source.of]);
        (around.crowd(a) / whole - 1.0).max(if deep { f64::MIN } else { 0.0 })
    };
    let mut each = around.each(crowding);
    // Without a surface the volume cannot change.
    if !surface.contains(&true) {
        let mean = each.iter().sum::<f64>() / each.len() as f64;
        each.iter_mut().for_each(|crowding| *crowding -= mean);
    }
    let crowding = |a: usize| {
        let own = (around.kernel.weight(0.0), around.kernel.weight(0.0) * each[a]);
        let (weight, sum) = around.around(a).fold(own, |(weight, sum), (_, x, source)| {
            let w = around.kernel.weight(x.length());
            (weight + w, sum + w * each[source.of])
        });
        sum / weight
    };
    let source = |a: usize| {
        let l = fluid.density / step * gradients.velocity_gradient(a, &all)
            + gradients.velocity_gradient(a, &pushes);
        let back = RELAXES * velocities[a].length() / length * fluid.density * crowding(a) / step;
        l.x_axis.x + l.y_axis.y + l.z_axis.z - back
    };
    let beyond = |source: &Source| weight(fluid, source);
    let iterations = poisson(around, &gradients, &surface, source, beyond, pressures)?;
    let all = around.mirrored(|source| pressures[source.of] + weight(fluid, source));
    velocities.par_iter_mut().enumerate().with_min_len(64).for_each(|(a, u)| {
        *u -= step / fluid.density * (gradients.gradient(a, &all) - pushed[a]);
    });
    Ok(iterations)
}
