//! Weights of neighbours in derivatives at a moment.

use tremie_cloud::stiffness::{self, raise, raised};
use tremie_cloud::{Dimension, Gradients, Kernel, Neighbours, Smoothing, Surroundings, sharpened};
use tremie_numerics::{DMat3, DVec3};

use crate::nodes::Operators;

/// Reach of kernels in spacings: so far exact Laplacians need neighbours; and that of the paper.
const REACH: f64 = 2.1;
const PAPER: f64 = 1.6;

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
    operators: Operators,
    /// Who is near enough for derivatives, and the weights W.
    pub(crate) near: Neighbours,
    pub(crate) weights: Vec<f64>,
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
    /// By how much more than along it forces across the surface count at nodes there (`tremie_cloud::stiffness`).
    pub(crate) raised: Vec<DVec3>,
}

impl<'a> Stencils<'a> {
    pub(crate) fn new(around: &'a Surroundings, wide: &Gradients, operators: Operators) -> Self {
        let reach = match operators {
            Operators::Exact => REACH,
            Operators::Paper => PAPER,
        } * around.spacing;
        let kernel = Smoothing::new(Kernel::Cubic, around.dimension, reach);
        let near = around.near.nearer(&around.positions, reach);
        let weight = |_, _, distance: f64| kernel.weight(distance);
        let gradients = Gradients::new(&around.positions, &near, around.dimension, weight);
        let (told, slopes) = near.told(|a, to: &mut [DVec3]| {
            let Some(slopes) = gradients.slopes(a) else { return (true, false) };
            let (mut pushed, mut squares) = (DVec3::ZERO, 0.0);
            for (to, g) in to.iter_mut().zip(slopes) {
                *to = g;
                pushed += g;
                squares += g.length_squared();
            }
            (false, operators == Operators::Exact && pushed.length_squared() > AGAINST * squares)
        });
        let (loose, mute): (Vec<bool>, Vec<bool>) = told.into_iter().unzip();
        let leans = around.surface(wide);
        let outer = |a: usize| leans[a] || loose[a];
        let alone = |a: usize| {
            let (mut inner, mut all) = (0.0, 0.0);
            for (n, _, share) in gradients.around(a) {
                if around.image(n).is_none_or(|image| image.wall.is_none()) {
                    let of = around.of(n);
                    inner += if outer(of) || mute[of] { 0.0 } else { share };
                    all += share;
                }
            }
            inner < INNER * all
        };
        let surface = around.each(|a| outer(a) || alone(a));
        let whole = around.on_lattice(|r| kernel.weight(r) * r * r) / around.volume;
        let natural = 2.0 * around.dimension.number() as f64 / whole;
        let (_, laplacians) = near.told(|a, to: &mut [f64]| {
            // Whether few enough of the weights are negative, but for those of its own images, which tell nothing of a pressure.
            let good = |to: &[f64]| gradients.mostly_positive(a, to, |n| around.of(n) != a);
            let exact = !surface[a] && operators == Operators::Exact;
            if let Some(weights) = exact.then(|| gradients.exact_laplacian(a)).flatten() {
                to.iter_mut().zip(weights).for_each(|(to, c)| *to = c);
                if good(to) {
                    return;
                }
            }
            if let Some(weights) = (!surface[a]).then(|| gradients.laplacian(a)).flatten() {
                to.iter_mut().zip(weights).for_each(|(to, c)| *to = c);
                if good(to) {
                    return;
                }
            }
            // At the surface neighbours that are not there are without stress: those that are weigh as in the lattice.
            to.iter_mut().zip(gradients.around(a)).for_each(|(to, (_, _, w))| *to = natural * w);
        });
        let outward = around.each(|a| match surface[a].then(|| gradients.leaning(a)).flatten() {
            Some(b) => -b.normalize_or_zero(),
            None => DVec3::ZERO,
        });
        let weights = gradients.into_weights();
        let raise = around.each(|a| {
            let range = near.range(a);
            let sums = |(open, slope): (DVec3, DVec3), (n, (c, g)): (&u32, (&f64, &DVec3))| {
                (open + *c * (around.positions[*n as usize] - around.positions[a]), slope + *g)
            };
            let pairs = near.of(a).iter().zip(laplacians[range.clone()].iter().zip(&slopes[range]));
            let (open, slope) = pairs.fold((DVec3::ZERO, DVec3::ZERO), sums);
            raised(outward[a], open, slope)
        });
        Self {
            around,
            operators,
            near,
            weights,
            slopes,
            laplacians,
            surface,
            mute,
            loose,
            outward,
            raised: raise,
        }
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

    /// By what an even stress pushes a node at the surface, in 1/m; zero for others.
    pub(crate) fn open(&self, node: usize) -> DVec3 {
        if !self.surface[node] || self.loose[node] {
            return DVec3::ZERO;
        }
        let at = self.around.positions[node];
        let open: DVec3 = self.pairs(node).map(|(n, _, c)| c * (self.around.positions[n] - at)).sum();
        raise(self.raised[node]) * open
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

    /// Shear rates sqrt(2 E:E) in 1/s of velocities in m/s of nodes, told sharply (`tremie_cloud::sharpened`) but with the operators of the paper; of loose ones the mean of how fast they go past others, over the distance.
    pub(crate) fn shear_rates(&self, velocities: &[DVec3]) -> Vec<f64> {
        let all = self.around.velocities(velocities);
        let past = |a: usize| {
            let weights = self.near.of(a).iter().zip(&self.weights[self.near.range(a)]);
            let sums = weights.fold((0.0, 0.0), |sum, (n, share)| {
                let (n, at) = (*n as usize, self.around.positions[a]);
                let rate = all[a].distance(all[n]) / at.distance(self.around.positions[n]);
                (sum.0 + share, sum.1 + share * rate)
            });
            if sums.0 > 0.0 { sums.1 / sums.0 } else { 0.0 }
        };
        let found = self.around.each(|a| self.velocity_gradient(a, &all));
        let extents = |a: usize| {
            let at = self.around.positions[a];
            let pairs = self.near.of(a).iter().zip(&self.weights[self.near.range(a)]);
            pairs
                .map(move |(n, w)| (*n as usize, w * at.distance_squared(self.around.positions[*n as usize])))
        };
        let seen = |_, n: usize| self.around.gradient(n, &found);
        let gradients = match self.operators {
            Operators::Exact => sharpened(self.around, &self.surface, &found, extents, seen),
            Operators::Paper => found.clone(),
        };
        self.around.each(|a| {
            if self.loose[a] {
                return past(a);
            }
            let e = 0.5 * (gradients[a] + gradients[a].transpose());
            (2.0 * e.to_cols_array().into_iter().map(|x| x * x).sum::<f64>()).sqrt()
        })
    }

    /// Viscosities in Pa s that nodes feel.
    pub(crate) fn felt(&self, viscosity: &[f64]) -> Vec<f64> {
        self.around.each(|a| {
            let weights = &self.weights[self.near.range(a)];
            let others = self.near.of(a).iter().map(|n| viscosity[self.around.of(*n as usize)]);
            stiffness::felt(viscosity[a], weights.iter().copied().zip(others))
        })
    }

    /// Whether the nodes are in a plane.
    pub(crate) fn flat(&self) -> bool {
        self.around.dimension == Dimension::Two
    }
}
