//! Weights of neighbours in derivatives at a moment.

use tremie_cloud::{Dimension, Gradients, Kernel, Neighbours, Smoothing, Source, Surroundings};
use tremie_numerics::{DMat3, DVec3};

use crate::nodes::Operators;

/// Reach of kernels in spacings: so far exact Laplacians need neighbours; and that of the paper.
const REACH: f64 = 2.1;
const PAPER: f64 = 1.6;
/// Share of the negative weights of a Laplacian in all of them from which on the paper's is taken.
const NEGATIVE: f64 = 0.2;

/// Share of what a pressure drives apart around a node up to which the node itself may be pushed into its neighbours; at 1 it does nothing. The paper knows no such rule.
const AGAINST: f64 = 0.5;
/// Share of neighbours, by weight, that must not be at the surface for a node that is not: in a sheet of two layers on a wall it is a half.
const INNER: f64 = 0.3;

/// Derivatives over the surroundings of nodes.
///
/// Gradients told from one side only are not the adjoints of divergences. A pressure p at a node alone changes its own divergence by dt/rho p (sum |g|^2 - |sum g|^2), g being the weights of its gradient:
/// its neighbours are driven apart, but it is pushed into them itself, which makes momentum of nothing. Where the second is as good as the first, in thin sheets and spray, a pressure that answers to the node's own
/// divergence would drive it on and on; so it is mute: its pressure is told by those around it. Who sees hardly anybody but such and the surface is at the surface itself.
pub(crate) struct Stencils<'a> {
    pub(crate) around: &'a Surroundings,
    /// Who is near enough for derivatives, and the weights W.
    near: Neighbours,
    pub(crate) kernel: Smoothing,
    /// Weights of gradients and of the Laplacian, of all pairs: in 1/m, and in 1/m2.
    slopes: Vec<DVec3>,
    laplacians: Vec<f64>,
    /// Which nodes are at the free surface.
    pub(crate) surface: Vec<bool>,
    /// Which nodes have pressures that do not answer to their own divergence.
    pub(crate) mute: Vec<bool>,
    /// Which of those have too few neighbours to tell gradients: nothing presses on them, and they are taken along by others only.
    pub(crate) loose: Vec<bool>,
    /// The way out of the fluid of those at the surface that are not loose; zero for others.
    pub(crate) outward: Vec<DVec3>,
}

/// The neighbours of a node: number, way to it in m, and its source.
fn others<'a>(
    around: &'a Surroundings,
    near: &'a Neighbours,
    node: usize,
) -> impl Iterator<Item = (usize, DVec3, &'a Source)> {
    let at = around.positions[node];
    near.of(node).iter().map(move |n| {
        let n = *n as usize;
        (n, around.positions[n] - at, &around.sources[n])
    })
}

impl<'a> Stencils<'a> {
    pub(crate) fn new(around: &'a Surroundings, wide: &Gradients, operators: Operators) -> Self {
        let reach = match operators {
            Operators::Exact => REACH,
            Operators::Paper => PAPER,
        } * around.spacing;
        let kernel = Smoothing::new(Kernel::Cubic, around.dimension, reach);
        let near = around.near.only(|a, b| around.positions[a].distance(around.positions[b]) < reach);
        let weight = |_, _, distance: f64| kernel.weight(distance);
        let gradients = Gradients::new(&around.positions, &near, around.dimension, weight);
        let slopes = around.each(|a| gradients.slopes(a));
        let mute = around.each(|a| {
            let Some(slopes) = &slopes[a] else { return false };
            let squares: f64 = slopes.iter().map(|g| g.length_squared()).sum();
            let pushed = slopes.iter().sum::<DVec3>().length_squared();
            operators == Operators::Exact && pushed > AGAINST * squares
        });
        let leans = around.surface(wide);
        let outer = around.each(|a| leans[a] || slopes[a].is_none());
        let alone = |a: usize| {
            let others = others(around, &near, a).filter(|(.., source)| source.wall.is_none());
            let (inner, all) = others.fold((0.0, 0.0), |(inner, all), (_, x, source)| {
                let share = kernel.weight(x.length());
                (inner + if outer[source.of] || mute[source.of] { 0.0 } else { share }, all + share)
            });
            inner < INNER * all
        };
        let surface = around.each(|a| outer[a] || alone(a));
        let d = around.dimension.number() as f64;
        let whole = around.on_lattice(|r| kernel.weight(r) * r * r) / around.volume;
        let laplacian = |a: usize| {
            // At the surface neighbours that are not there are without stress: those that are weigh as in the lattice.
            let natural =
                || others(around, &near, a).map(|(_, x, _)| 2.0 * d / whole * kernel.weight(x.length()));
            if surface[a] {
                return natural().collect();
            }
            let good = |weights: &Vec<f64>| !mixed(others(around, &near, a), a, weights);
            let exact = match operators {
                Operators::Exact => gradients.exact_laplacian(a).filter(good),
                Operators::Paper => None,
            };
            exact
                .or_else(|| gradients.laplacian(a).filter(good))
                .unwrap_or_else(|| natural().collect::<Vec<f64>>())
        };
        let laplacians = around.each(laplacian).concat();
        let outward = around.each(|a| match gradients.leaning(a) {
            Some(b) if surface[a] => -b.normalize_or_zero(),
            _ => DVec3::ZERO,
        });
        let loose = slopes.iter().map(|slopes| slopes.is_none()).collect();
        let mut all = Vec::with_capacity(near.pairs());
        for (node, slopes) in slopes.into_iter().enumerate() {
            all.extend(slopes.unwrap_or_else(|| vec![DVec3::ZERO; near.of(node).len()]));
        }
        Self { around, near, kernel, slopes: all, laplacians, surface, mute, loose, outward }
    }

    /// Numbers of a node's neighbours, their weights in its gradients, and in its Laplacian.
    pub(crate) fn pairs(&self, node: usize) -> impl Iterator<Item = (usize, DVec3, f64)> {
        let range = self.near.range(node);
        let near = self.near.of(node).iter().map(|n| *n as usize);
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
                let share = self.kernel.weight(x.length());
                (share, share * all[a].distance(all[n]) / x.length())
            };
            let sums = others(self.around, &self.near, a)
                .map(of)
                .fold((0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
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
fn mixed<'a>(others: impl Iterator<Item = (usize, DVec3, &'a Source)>, node: usize, weights: &[f64]) -> bool {
    let others = others.zip(weights).filter(|((.., source), _)| source.of != node);
    let (all, negative) =
        others.fold((0.0, 0.0), |(all, negative), (_, c)| (all + c.abs(), negative - c.min(0.0)));
    negative > NEGATIVE * all
}
