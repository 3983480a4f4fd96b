//! Weights of neighbours in derivatives at a moment.

use tremie_cloud::{Dimension, Gradients, Kernel, Smoothing, Space, Surroundings, at_surface};
use tremie_numerics::{DMat3, DVec3};

use crate::nodes::Operators;

/// Reach of kernels in spacings: so far nodes are neighbours, as exact Laplacians need it; and that of the paper.
const REACH: f64 = 2.1;
const PAPER: f64 = 1.6;
/// Share of the negative weights of a Laplacian in all of them from which on the paper's is taken.
const NEGATIVE: f64 = 0.2;

/// The kernel of nodes.
pub(crate) fn kernel(space: &Space) -> Smoothing {
    Smoothing::new(Kernel::Cubic, space.dimension, REACH * space.spacing)
}

/// Derivatives over the surroundings of nodes.
pub(crate) struct Stencils<'a> {
    pub(crate) around: &'a Surroundings,
    /// Weights of gradients and of the Laplacian, of all pairs: in 1/m, and in 1/m2.
    slopes: Vec<DVec3>,
    laplacians: Vec<f64>,
    /// Which nodes are at the free surface.
    pub(crate) surface: Vec<bool>,
    /// The way out of the fluid of those; zero for others.
    pub(crate) outward: Vec<DVec3>,
}

impl<'a> Stencils<'a> {
    pub(crate) fn new(around: &'a Surroundings, operators: Operators) -> Self {
        let with = |kernel: Smoothing| {
            let weight = move |_, _, distance: f64| kernel.weight(distance);
            Gradients::new(&around.positions, &around.near, around.dimension, weight)
        };
        let wide = with(around.kernel);
        let surface = at_surface(&wide, around.kernel.support());
        let (gradients, kernel) = match operators {
            Operators::Exact => (wide, around.kernel),
            Operators::Paper => {
                let kernel = Smoothing::new(Kernel::Cubic, around.dimension, PAPER * around.spacing);
                (with(kernel), kernel)
            }
        };
        let d = around.dimension.number() as f64;
        let whole = around.on_lattice(|r| kernel.weight(r) * r * r) / around.volume;
        let of = |a: usize| {
            let number = around.near.of(a).len();
            let slopes = gradients.slopes(a).unwrap_or_else(|| vec![DVec3::ZERO; number]);
            // At the surface neighbours that are not there are without stress: those that are weigh as in the lattice.
            let natural =
                || around.around(a).map(|(_, x, _)| 2.0 * d / whole * kernel.weight(x.length())).collect();
            let laplacian = if surface[a] {
                natural()
            } else {
                let exact = match operators {
                    Operators::Exact => gradients.exact_laplacian(a).filter(|weights| !leans(weights)),
                    Operators::Paper => None,
                };
                exact
                    .or_else(|| gradients.laplacian(a).filter(|weights| !leans(weights)))
                    .unwrap_or_else(natural)
            };
            let outward = match gradients.leaning(a) {
                Some(b) if surface[a] => -b.normalize_or_zero(),
                _ => DVec3::ZERO,
            };
            (slopes, laplacian, outward)
        };
        let rows = around.each(of);
        let (mut slopes, mut laplacians, mut outward) = (Vec::new(), Vec::new(), Vec::new());
        slopes.reserve(around.near.pairs());
        laplacians.reserve(around.near.pairs());
        for (of, laplacian, out) in rows {
            slopes.extend(of);
            laplacians.extend(laplacian);
            outward.push(out);
        }
        Self { around, slopes, laplacians, surface, outward }
    }

    /// Numbers of a node's neighbours, their weights in its gradients, and in its Laplacian.
    pub(crate) fn pairs(&self, node: usize) -> impl Iterator<Item = (usize, DVec3, f64)> {
        let range = self.around.near.range(node);
        let near = self.around.near.of(node).iter().map(|n| *n as usize);
        near.zip(&self.slopes[range.clone()]).zip(&self.laplacians[range]).map(|((n, g), c)| (n, *g, *c))
    }

    /// grad f at a node, of values of nodes and images.
    pub(crate) fn gradient(&self, node: usize, f: &[f64]) -> DVec3 {
        self.pairs(node).map(|(n, g, _)| (f[n] - f[node]) * g).sum()
    }

    /// du_i/dx_j at a node, j counting columns.
    pub(crate) fn velocity_gradient(&self, node: usize, u: &[DVec3]) -> DMat3 {
        self.pairs(node).fold(DMat3::ZERO, |sum, (n, g, _)| {
            let u = u[n] - u[node];
            sum + DMat3::from_cols(g.x * u, g.y * u, g.z * u)
        })
    }

    /// div u at a node.
    pub(crate) fn divergence(&self, node: usize, u: &[DVec3]) -> f64 {
        self.pairs(node).map(|(n, g, _)| (u[n] - u[node]).dot(g)).sum()
    }

    /// Shear rates sqrt(2 E:E) in 1/s of velocities in m/s of nodes.
    pub(crate) fn shear_rates(&self, velocities: &[DVec3]) -> Vec<f64> {
        let all = self.around.velocities(velocities);
        self.around.each(|a| {
            let l = self.velocity_gradient(a, &all);
            let e = 0.5 * (l + l.transpose());
            (2.0 * e.to_cols_array().into_iter().map(|x| x * x).sum::<f64>()).sqrt()
        })
    }

    /// Whether the nodes are in a plane.
    pub(crate) fn flat(&self) -> bool {
        self.around.dimension == Dimension::Two
    }
}

/// Whether too many of a Laplacian's weights are negative.
fn leans(weights: &[f64]) -> bool {
    let (all, negative) =
        weights.iter().fold((0.0, 0.0), |(all, negative), c| (all + c.abs(), negative - c.min(0.0)));
    negative > NEGATIVE * all
}
