//! Weights of neighbours in derivatives at a moment.

use tremie_cloud::{Dimension, Gradients, Kernel, Smoothing, Space, Surroundings, at_surface};
use tremie_numerics::{DMat3, DVec3};

use crate::nodes::Operators;

/// Reach of kernels in spacings: so far nodes are neighbours, as exact Laplacians need it; and that of the paper.
const REACH: f64 = 2.1;
const PAPER: f64 = 1.6;
/// Share of the negative weights of a Laplacian in all of them from which on the paper's is taken.
const NEGATIVE: f64 = 0.2;

/// One-sidedness times the spacing from which on a node is loose: at a flat surface it is 1, and 1.05 at an edge of right angles. What is told from so few neighbours
/// is not to be trusted: nothing presses on such a node, and it is taken along by others only.
const LOOSE: f64 = 1.5;
/// Share of a lattice's neighbours, by distance, below which a node is at the surface, however they stand: at a flat one it is 0.67, and 0.59 in a corner where a node's own images do not count.
const THIN: f64 = 0.55;
/// Share of neighbours, by distance, that must not be at the surface for a node that is not: in a sheet of two layers on a wall it is a half.
const INNER: f64 = 0.3;

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
    /// Which of those have too few neighbours.
    pub(crate) loose: Vec<bool>,
    /// The way out of the fluid of those at the surface that are not loose; zero for others.
    pub(crate) outward: Vec<DVec3>,
}

impl<'a> Stencils<'a> {
    pub(crate) fn new(around: &'a Surroundings, operators: Operators) -> Self {
        let reach = around.kernel.support();
        // Weights with no peak: who is very near shall not count for much more than who is near.
        let share = |distance: f64| (1.0 - (distance / reach).powi(2)).max(0.0).powi(2);
        let even = |_, _, distance: f64| share(distance);
        let evenly = Gradients::new(&around.positions, &around.near, around.dimension, even);
        // In spray that hits a wall images are on one side, and hardly anybody is on the other; that a node sees itself tells nothing.
        let full = around.on_lattice(share) / around.volume - 1.0;
        let thin = |a: usize| {
            let others = around.around(a).filter(|(_, _, source)| source.of != a);
            others.map(|(_, x, _)| share(x.length())).sum::<f64>() < THIN * full
        };
        let leans = at_surface(&evenly, reach);
        let outer = around.each(|a| leans[a] || thin(a));
        // Among nodes at the surface only, one alone would have a pressure that drives it on.
        let alone = |a: usize| {
            let others = around.around(a).filter(|(.., source)| source.wall.is_none());
            let (inner, all) = others.fold((0.0, 0.0), |(inner, all), (_, x, source)| {
                let share = share(x.length());
                (inner + if outer[source.of] { 0.0 } else { share }, all + share)
            });
            inner < INNER * all
        };
        let surface = around.each(|a| outer[a] || alone(a));
        let kernel = match operators {
            Operators::Exact => around.kernel,
            Operators::Paper => Smoothing::new(Kernel::Cubic, around.dimension, PAPER * around.spacing),
        };
        let weight = |_, _, distance: f64| kernel.weight(distance);
        let gradients = Gradients::new(&around.positions, &around.near, around.dimension, weight);
        let d = around.dimension.number() as f64;
        let whole = around.on_lattice(|r| kernel.weight(r) * r * r) / around.volume;
        let of = |a: usize| {
            let number = around.near.of(a).len();
            let far = surface[a] && evenly.leaning(a).is_none_or(|b| b.length() * around.spacing > LOOSE);
            let slopes = if far { None } else { gradients.slopes(a) };
            let loose = slopes.is_none();
            let slopes = slopes.unwrap_or_else(|| vec![DVec3::ZERO; number]);
            // At the surface neighbours that are not there are without stress: those that are weigh as in the lattice.
            let natural =
                || around.around(a).map(|(_, x, _)| 2.0 * d / whole * kernel.weight(x.length())).collect();
            let laplacian = if surface[a] {
                natural()
            } else {
                let exact = match operators {
                    Operators::Exact => {
                        gradients.exact_laplacian(a).filter(|weights| !mixed(around, a, weights))
                    }
                    Operators::Paper => None,
                };
                exact
                    .or_else(|| gradients.laplacian(a).filter(|weights| !mixed(around, a, weights)))
                    .unwrap_or_else(natural)
            };
            let outward = match gradients.leaning(a) {
                Some(b) if surface[a] && !loose => -b.normalize_or_zero(),
                _ => DVec3::ZERO,
            };
            (slopes, laplacian, outward, loose)
        };
        let rows = around.each(of);
        let (mut slopes, mut laplacians) = (Vec::new(), Vec::new());
        let (mut outward, mut loose) = (Vec::new(), Vec::new());
        slopes.reserve(around.near.pairs());
        laplacians.reserve(around.near.pairs());
        for (of, laplacian, out, alone) in rows {
            slopes.extend(of);
            laplacians.extend(laplacian);
            outward.push(out);
            loose.push(alone);
        }
        Self { around, slopes, laplacians, surface, loose, outward }
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

    /// Shear rates sqrt(2 E:E) in 1/s of velocities in m/s of nodes; of loose ones the mean of how fast they go past others, over the distance.
    pub(crate) fn shear_rates(&self, velocities: &[DVec3]) -> Vec<f64> {
        let all = self.around.velocities(velocities);
        let past = |a: usize| {
            let of = |(n, x, _): (usize, DVec3, _)| {
                let share = self.around.kernel.weight(x.length());
                (share, share * all[a].distance(all[n]) / x.length())
            };
            let sums = self.around.around(a).map(of).fold((0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
            if sums.0 > 0.0 { sums.1 / sums.0 } else { 0.0 }
        };
        self.around.each(|a| {
            if self.loose[a] {
                return past(a);
            }
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

/// Whether too many of a Laplacian's weights at a node are negative, but for those of its own images, which tell nothing of a pressure.
fn mixed(around: &Surroundings, node: usize, weights: &[f64]) -> bool {
    let others = around.around(node).zip(weights).filter(|((.., source), _)| source.of != node);
    let (all, negative) =
        others.fold((0.0, 0.0), |(all, negative), (_, c)| (all + c.abs(), negative - c.min(0.0)));
    negative > NEGATIVE * all
}
