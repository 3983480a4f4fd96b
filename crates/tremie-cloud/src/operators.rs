//! Derivatives of what is known at scattered nodes.
//!
//! With weights g_ij of the pairs and x_ij = x_j - x_i,
//!
//! ```text
//!     grad f_i = B_i sum g_ij (f_j - f_i) x_ij,      B_i = (sum g_ij x_ij x_ij^T)^-1
//! ```
//!
//! is exact for linear fields on any cloud. g = W is Lagrangian differencing dynamics (Basic 2021, Eq. 14); g = -V_j W'(r)/r is smoothed particle hydrodynamics with the
//! corrected gradient of the kernel (Bonet and Lok 1999). With the first, the Laplacian
//!
//! ```text
//!     lap f_i = sum c_ij (f_j - f_i),   c_ij = 2 d g_ij (1 - x_ij . b_i) / sum_k g_ik r_ik^2 (1 - x_ik . b_i),   b_i = B_i sum g_ij x_ij
//! ```
//!
//! (Basic 2021, Eq. 15; d: dimensions) is exact for linear fields, too, and for others wrong by O(1) on disordered nodes, however fine. Solutions of problems of
//! Poisson converge all the same: with the second order on ordered nodes, while what random disorder adds falls as the spacing to d/2.
//!
//! It is right for all quadratic fields, too, with
//!
//! ```text
//!     c_ij = g_ij (l . x_ij + x_ij . L x_ij),   sum c_ij x_ij = 0,   sum c_ij x_ij x_ij^T = 2 I
//! ```
//!
//! l and L being what meets the sums. That takes neighbours enough, within 2.1 spacings instead of 1.6 (Basic et al. 2018 have such, too); hardly any weight is negative on nodes off a lattice by up to a fifth of
//! its spacing, and solutions converge with the second order on them.

use tremie_numerics::{DMat3, DVec3, definite};

use crate::{Dimension, Matrix, Neighbours};

/// Least share of the smallest over the largest extent of the neighbours, by second moments, with which gradients are told.
const LEAST: f64 = 0.1;
/// Share of the negative weights of a Laplacian in all of them from which on it is no longer one of a maximum principle, even roughly.
const NEGATIVE: f64 = 0.2;
/// Share of a moment of neighbours that must be independent of the others for a Laplacian that is exact for quadratic fields.
const SINGULAR: f64 = 1e-3;

/// What derivatives are formed with.
#[derive(Debug, Clone)]
pub struct Gradients<'a> {
    positions: &'a [DVec3],
    neighbours: &'a Neighbours,
    dimension: Dimension,
    /// g of all pairs.
    weights: Vec<f64>,
    /// B in 1/(unit of g m2); none where neighbours are too few or lie along a line or in a plane.
    inverses: Vec<Option<DMat3>>,
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The inverse of sums of x x^T, which in a plane have nothing along y; none if they are as good as singular.
fn inverse(mut moment: DMat3, dimension: Dimension) -> Option<DMat3> {
    let mean = (moment.x_axis.x + moment.y_axis.y + moment.z_axis.z) / dimension.number() as f64;
    if dimension == Dimension::Two {
        moment.y_axis.y = mean;
    }
    // The determinant over that of as much in all directions bounds the smallest extent.
    let share = moment.determinant() / mean.powi(3);
    (share > LEAST && share.is_finite()).then(|| moment.inverse())
}

impl<'a> Gradients<'a> {
    /// For nodes and their neighbours, by the weight of the pair of `i` and `j` at a distance in m.
    pub fn new(
        positions: &'a [DVec3],
        neighbours: &'a Neighbours,
        dimension: Dimension,
        weight: impl Fn(usize, usize, f64) -> f64 + Sync,
    ) -> Self {
        let (inverses, weights) = neighbours.told(|i, weights: &mut [f64]| {
            let mut moment = DMat3::ZERO;
            for (j, to) in neighbours.of(i).iter().zip(weights) {
                let x = positions[*j as usize] - positions[i];
                *to = weight(i, *j as usize, x.length());
                moment += outer(*to * x, x);
            }
            inverse(moment, dimension)
        });
        Self { positions, neighbours, dimension, weights, inverses }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.inverses.len()
    }

    /// Whether there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.inverses.is_empty()
    }

    /// Whether a node has neighbours enough on all sides to tell a gradient.
    pub fn tells(&self, node: usize) -> bool {
        self.inverses[node].is_some()
    }

    /// Neighbours of a node, the way to each, and its weight.
    pub fn around(&self, node: usize) -> impl Iterator<Item = (usize, DVec3, f64)> {
        let weights = &self.weights[self.neighbours.range(node)];
        let others = self.neighbours.of(node).iter().map(|j| *j as usize);
        others.zip(weights).map(move |(j, g)| (j, self.positions[j] - self.positions[node], *g))
    }

    /// Neighbours of a node and the weights g r^2 with which gradients around make up its own.
    pub fn extents(&self, node: usize) -> impl Iterator<Item = (usize, f64)> {
        self.around(node).map(|(j, x, g)| (j, g * x.length_squared()))
    }

    /// grad f at a node; zero where it cannot be told.
    pub fn gradient(&self, node: usize, f: &[f64]) -> DVec3 {
        let Some(b) = self.inverses[node] else { return DVec3::ZERO };
        b * self.around(node).map(|(j, x, g)| g * (f[j] - f[node]) * x).sum::<DVec3>()
    }

    /// du_i/dx_j at a node, j counting columns; zero where it cannot be told.
    pub fn velocity_gradient(&self, node: usize, u: &[DVec3]) -> DMat3 {
        self.velocity_gradient_of(node, |j| u[j])
    }

    /// The same of velocities as this node sees them, its own among them.
    pub fn velocity_gradient_of(&self, node: usize, u: impl Fn(usize) -> DVec3) -> DMat3 {
        let Some(b) = self.inverses[node] else { return DMat3::ZERO };
        let own = u(node);
        let sum = self.around(node).fold(DMat3::ZERO, |sum, (j, x, g)| sum + outer(g * (u(j) - own), x));
        // B is symmetric.
        sum * b
    }

    /// How one-sided the neighbours of a node are: b in 1/m, about one over their reach where half of them are missing; none where gradients cannot be told.
    pub fn leaning(&self, node: usize) -> Option<DVec3> {
        Some(self.inverses[node]? * self.around(node).map(|(_, x, g)| g * x).sum::<DVec3>())
    }

    /// Weights of all pairs.
    pub fn into_weights(self) -> Vec<f64> {
        self.weights
    }

    /// Weights c of the Laplacian at a node, in the order of its neighbours, in 1/m2; none where it cannot be told.
    pub fn laplacian(&self, node: usize) -> Option<impl Iterator<Item = f64>> {
        let b = self.leaning(node)?;
        let share = |x: DVec3, g: f64| g * (1.0 - x.dot(b));
        let all: f64 = self.around(node).map(|(_, x, g)| share(x, g) * x.length_squared()).sum();
        let scale = 2.0 * self.dimension.number() as f64 / all;
        (all > 0.0).then(|| self.around(node).map(move |(_, x, g)| scale * g * (1.0 - x.dot(b))))
    }

    /// Weights of the gradient at a node, in the order of its neighbours, in 1/m; none where it cannot be told.
    pub fn slopes(&self, node: usize) -> Option<impl Iterator<Item = DVec3>> {
        let b = self.inverses[node]?;
        Some(self.around(node).map(move |(_, x, g)| b * (g * x)))
    }

    /// Weights of the Laplacian that is exact for quadratic fields, in the order of the neighbours, in 1/m2; none where there are too few of them.
    pub fn exact_laplacian(&self, node: usize) -> Option<impl Iterator<Item = f64>> {
        self.inverses[node]?;
        let (l, square) = match self.dimension {
            Dimension::Two => {
                let of = |x: DVec3| [x.x, x.z, x.x * x.x, x.z * x.z, x.x * x.z];
                let [x, z, xx, zz, xz] = self.exact(node, of, [2, 3])?;
                let (first, last) = (DVec3::new(xx, 0.0, xz), DVec3::new(0.0, 0.0, zz));
                (DVec3::new(x, 0.0, z), DMat3::from_cols(first, DVec3::ZERO, last))
            }
            Dimension::Three => {
                let of = |x: DVec3| {
                    let square = x * x;
                    [x.x, x.y, x.z, square.x, square.y, square.z, x.x * x.y, x.y * x.z, x.z * x.x]
                };
                let [x, y, z, xx, yy, zz, xy, yz, zx] = self.exact(node, of, [3, 4, 5])?;
                let columns = [DVec3::new(xx, xy, 0.0), DVec3::new(0.0, yy, yz), DVec3::new(zx, 0.0, zz)];
                (DVec3::new(x, y, z), DMat3::from_cols(columns[0], columns[1], columns[2]))
            }
        };
        Some(self.around(node).map(move |(_, x, g)| g * x.dot(l + square * x)))
    }

    /// Whether few enough of the weights of a Laplacian at a node, in the order of its neighbours, are negative, of those neighbours that count.
    pub fn mostly_positive(&self, node: usize, weights: &[f64], counts: impl Fn(usize) -> bool) -> bool {
        let pairs = self.neighbours.of(node).iter().zip(weights).filter(|(j, _)| counts(**j as usize));
        let (all, negative) =
            pairs.fold((0.0, 0.0), |(all, negative), (_, c)| (all + c.abs(), negative - c.min(0.0)));
        negative <= NEGATIVE * all
    }

    /// The factors of these powers of x in c/g, if some of the powers are the squares.
    fn exact<const N: usize, const D: usize>(
        &self,
        node: usize,
        powers: impl Fn(DVec3) -> [f64; N],
        squares: [usize; D],
    ) -> Option<[f64; N]> {
        // In units of the neighbours' mean distance.
        let (sum, whole) = self
            .around(node)
            .fold((0.0, 0.0), |(sum, whole), (_, x, g)| (sum + g * x.length_squared(), whole + g));
        let unit = (whole / sum).sqrt();
        let mut moments = [[0.0; N]; N];
        for (_, x, g) in self.around(node) {
            let of = powers(unit * x);
            for i in 0..N {
                let scaled = g / whole * of[i];
                for j in 0..=i {
                    moments[i][j] += scaled * of[j];
                }
            }
        }
        let mut met = [0.0; N];
        squares.iter().for_each(|k| met[*k] = 2.0 * unit * unit / whole);
        let (factors, units) = (definite::solve(moments, met, SINGULAR)?, powers(DVec3::splat(unit)));
        Some(std::array::from_fn(|k| factors[k] * units[k]))
    }

    /// The matrix of -div(k grad f) with k at the nodes, between two nodes their harmonic mean, by Laplacians that are `exact` for quadratic fields or not; identity in the rows that are `given` or cannot be told.
    pub fn diffusion(&self, k: &[f64], given: impl Fn(usize) -> bool + Sync, exact: bool) -> Matrix {
        let laplacian = |i: usize| -> Option<Vec<f64>> {
            Some(if exact { self.exact_laplacian(i)?.collect() } else { self.laplacian(i)?.collect() })
        };
        Matrix::build(self.neighbours.len(), |i, others| {
            let Some(c) = (!given(i)).then(|| laplacian(i)).flatten() else { return [[1.0]] };
            let between = |j: usize| 2.0 * k[i] * k[j] / (k[i] + k[j]);
            let of = |(j, c): (&u32, f64)| (*j, [[-c * between(*j as usize)]]);
            others.extend(self.neighbours.of(i).iter().zip(c).map(of));
            [[-others.iter().map(|(_, [[value]])| value).sum::<f64>()]]
        })
    }
}
