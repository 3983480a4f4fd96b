//! Operators and systems over clouds of scattered nodes, against fields and solutions that are known.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tremie_cloud::{
    Dimension, Failure, Gradients, Kernel, Matrix, Method, Multigrid, Neighbours, Settings, Smoothing, solve,
};
use tremie_numerics::{DMat3, DVec3};

const BOTH: [Dimension; 2] = [Dimension::Two, Dimension::Three];

/// Nodes of a square or a cube of 1 m, so many to an edge and one more; those inside are up to a share of their spacing off the corners of the grid.
struct Cloud {
    nodes: Vec<DVec3>,
    spacing: f64,
    dimension: Dimension,
}

impl Cloud {
    fn new(dimension: Dimension, edge: i32, jitter: f64) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(11);
        let spacing = 1.0 / f64::from(edge);
        let layers = || if dimension == Dimension::Two { 0..=0 } else { 0..=edge };
        let mut nodes = Vec::new();
        for k in 0..=edge {
            for j in layers() {
                for i in 0..=edge {
                    let corner = spacing * DVec3::new(f64::from(i), f64::from(j), f64::from(k));
                    let mut off = || jitter * spacing * random.random_range(-1.0..1.0);
                    let [x, z, y] = [off(), off(), off()];
                    let off = DVec3::new(x, y, z);
                    let flat = if dimension == Dimension::Two { off.with_y(0.0) } else { off };
                    let cloud = Self { nodes: Vec::new(), spacing, dimension };
                    nodes.push(if cloud.edge(corner) { corner } else { corner + flat });
                }
            }
        }
        Self { nodes, spacing, dimension }
    }

    /// Whether a place is on the edge.
    fn edge(&self, at: DVec3) -> bool {
        let on = |x: f64| x < 0.5 * self.spacing || x > 1.0 - 0.5 * self.spacing;
        on(at.x) || on(at.z) || (self.dimension == Dimension::Three && on(at.y))
    }

    /// The kernel of Lagrangian differencing dynamics.
    fn kernel(&self) -> Smoothing {
        self.reaching(1.6)
    }

    /// The same over so many spacings.
    fn reaching(&self, spacings: f64) -> Smoothing {
        Smoothing::new(Kernel::Cubic, self.dimension, spacings * self.spacing)
    }

    fn neighbours(&self) -> Neighbours {
        Neighbours::within(&self.nodes, self.kernel().support())
    }
}

/// A row each for the weights of Lagrangian differencing dynamics and of smoothed particle hydrodynamics.
fn weighted<'a>(cloud: &'a Cloud, neighbours: &'a Neighbours, particles: bool) -> Gradients<'a> {
    let kernel = cloud.kernel();
    let volume = cloud.spacing.powi(cloud.dimension.number() as i32);
    let weight = move |_: usize, _: usize, r: f64| match particles {
        true => -volume * kernel.slope(r) / r,
        false => kernel.weight(r),
    };
    Gradients::new(&cloud.nodes, neighbours, cloud.dimension, weight)
}

#[test]
fn derivatives_of_linear_fields_are_exact_up_to_the_edge() {
    for dimension in BOTH {
        let cloud = Cloud::new(dimension, 8, 0.2);
        let neighbours = cloud.neighbours();
        let flat = if dimension == Dimension::Two { 0.0 } else { 1.0 };
        let slope = DVec3::new(1.3, 0.4 * flat, -0.7);
        let l = DMat3::from_cols_array(&[0.3, 2.0 * flat, -0.5, 0.9, 0.4, 0.8, 0.7, -1.1 * flat, 0.2])
            * DMat3::from_diagonal(DVec3::new(1.0, flat, 1.0));
        let f: Vec<f64> = cloud.nodes.iter().map(|at| 5.0 + slope.dot(*at)).collect();
        let u: Vec<DVec3> = cloud.nodes.iter().map(|at| l * *at).collect();
        for particles in [false, true] {
            let gradients = weighted(&cloud, &neighbours, particles);
            for n in 0..cloud.nodes.len() {
                assert!(gradients.tells(n));
                assert!((gradients.gradient(n, &f) - slope).length() < 1e-11);
                let off = (gradients.velocity_gradient(n, &u) - l).to_cols_array();
                assert!(off.iter().all(|x| x.abs() < 1e-11), "{off:?}");
                if cloud.edge(cloud.nodes[n]) {
                    continue;
                }
                let c = gradients.laplacian(n).unwrap();
                let others = neighbours.of(n).iter().zip(c);
                let laplacian: f64 = others.map(|(j, c)| c * (f[*j as usize] - f[n])).sum();
                assert!(laplacian.abs() < 1e-9, "{laplacian}");
            }
        }
    }
}

/// -div(k grad f) = s with f given on the edge.
struct Poisson {
    matrix: Matrix,
    multigrid: Multigrid<1, 1>,
    right: Vec<f64>,
    exact: Vec<f64>,
}

/// f = sin(2 x) cos(3 z) exp(y/2), with k = 1, or 1 + x + z^2; y = 0 in a plane; by Laplacians that are exact for quadratic fields or not.
fn poisson_by(cloud: &Cloud, varies: bool, by: bool) -> Poisson {
    let exact = |at: DVec3| (2.0 * at.x).sin() * (3.0 * at.z).cos() * (0.5 * at.y).exp();
    let k = |at: DVec3| if varies { 1.0 + at.x + at.z * at.z } else { 1.0 };
    let source = |at: DVec3| {
        let high = if cloud.dimension == Dimension::Two { 0.0 } else { 0.25 };
        let slope_x = 2.0 * (2.0 * at.x).cos() * (3.0 * at.z).cos() * (0.5 * at.y).exp();
        let slope_z = -3.0 * (2.0 * at.x).sin() * (3.0 * at.z).sin() * (0.5 * at.y).exp();
        let of_k = if varies { slope_x + 2.0 * at.z * slope_z } else { 0.0 };
        -k(at) * (high - 13.0) * exact(at) - of_k
    };
    let kernel = if by { cloud.reaching(2.1) } else { cloud.kernel() };
    let neighbours = Neighbours::within(&cloud.nodes, kernel.support());
    let gradients = Gradients::new(&cloud.nodes, &neighbours, cloud.dimension, |_, _, r| kernel.weight(r));
    let coefficients: Vec<f64> = cloud.nodes.iter().map(|at| k(*at)).collect();
    let given = |n: usize| cloud.edge(cloud.nodes[n]);
    let matrix = gradients.diffusion(&coefficients, given, by);
    let right = cloud.nodes.iter().map(|at| if cloud.edge(*at) { exact(*at) } else { source(*at) }).collect();
    let multigrid = Multigrid::new(&matrix, &cloud.nodes, cloud.spacing);
    Poisson { matrix, multigrid, right, exact: cloud.nodes.iter().map(|at| exact(*at)).collect() }
}

/// The same by the Laplacian of the paper.
fn poisson(cloud: &Cloud, varies: bool) -> Poisson {
    poisson_by(cloud, varies, false)
}

const SETTINGS: Settings = Settings { method: Method::BiCgStab, tolerance: 1e-9, iterations: 1000 };

/// Root of the mean square of the error.
fn error(problem: &Poisson) -> f64 {
    let mut x = vec![0.0; problem.right.len()];
    let solved = solve(&problem.matrix, Some(&problem.multigrid), &problem.right, &mut x, &SETTINGS);
    assert!(solved.is_ok(), "{solved:?}");
    let squares = x.iter().zip(&problem.exact).map(|(x, exact)| (x - exact).powi(2));
    (squares.sum::<f64>() / x.len() as f64).sqrt()
}

/// By the second order on a lattice. Where nodes are scattered at random, what the Laplacian is wrong by is random, too, and of no smaller size on finer clouds: its mean over
/// D^-d nodes falls as D^(d/2), and the error with it.
#[test]
fn solutions_of_poisson_converge() {
    let order = |dimension, edges: [i32; 2], jitter, varies| {
        let errors = edges.map(|edge| error(&poisson(&Cloud::new(dimension, edge, jitter), varies)));
        (errors[0] / errors[1]).ln() / (f64::from(edges[1]) / f64::from(edges[0])).ln()
    };
    for varies in [false, true] {
        for (dimension, edges) in [(Dimension::Two, [20, 80]), (Dimension::Three, [12, 36])] {
            let order = order(dimension, edges, 0.0, varies);
            assert!(order > 1.9, "lattice, {dimension:?}, {varies}: order {order}");
        }
        for (dimension, edges) in [(Dimension::Two, [10, 160]), (Dimension::Three, [6, 36])] {
            let order = order(dimension, edges, 0.1, varies);
            assert!(order > 0.5 * dimension.number() as f64, "{dimension:?}, {varies}: order {order}");
        }
    }
}

/// Where the Laplacian is exact for quadratic fields, disorder takes nothing from the order.
#[test]
fn solutions_converge_in_disorder_where_laplacians_are_exact_for_quadratic_fields() {
    for (dimension, edges) in [(Dimension::Two, [10, 80]), (Dimension::Three, [8, 24])] {
        for varies in [false, true] {
            let errors =
                edges.map(|edge| error(&poisson_by(&Cloud::new(dimension, edge, 0.2), varies, true)));
            let order = (errors[0] / errors[1]).ln() / (f64::from(edges[1]) / f64::from(edges[0])).ln();
            assert!(order > 1.7, "{dimension:?}, {varies}: order {order}, {errors:?}");
        }
    }
    // x^2 + 2 z^2 + 3 x z
    let cloud = Cloud::new(Dimension::Two, 10, 0.2);
    let neighbours = Neighbours::within(&cloud.nodes, cloud.reaching(2.1).support());
    let gradients =
        Gradients::new(&cloud.nodes, &neighbours, Dimension::Two, |_, _, r| cloud.reaching(2.1).weight(r));
    let f = |at: DVec3| at.x * at.x + 2.0 * at.z * at.z + 3.0 * at.x * at.z;
    for n in (0..cloud.nodes.len()).filter(|n| !cloud.edge(cloud.nodes[*n])) {
        let others = neighbours.of(n).iter().zip(gradients.exact_laplacian(n).unwrap());
        let found: f64 = others.map(|(j, c)| c * (f(cloud.nodes[*j as usize]) - f(cloud.nodes[n]))).sum();
        assert!((found - 6.0).abs() < 1e-9, "{found}");
    }
}

#[test]
fn iterations_hardly_grow_with_the_number_of_nodes() {
    let settings = Settings { tolerance: 1e-6, ..SETTINGS };
    for (dimension, edges) in [(Dimension::Two, [40, 160]), (Dimension::Three, [12, 32])] {
        let [few, many] = edges.map(|edge| {
            let problem = poisson(&Cloud::new(dimension, edge, 0.1), false);
            assert!(problem.multigrid.complexity() < 1.5);
            let mut x = vec![0.0; problem.right.len()];
            let solved = solve(&problem.matrix, Some(&problem.multigrid), &problem.right, &mut x, &settings);
            solved.unwrap().iterations
        });
        assert!(many <= 12 && many <= few + 3, "{dimension:?}: {few}, {many}");
    }
}

/// A thread or a disc in the midst whose coefficient is many times that of what is around: its only hold is what does hardly anything in its own rows.
#[test]
fn stiff_pieces_in_soft_surroundings_hardly_take_longer() {
    let cloud = Cloud::new(Dimension::Two, 60, 0.1);
    let neighbours = cloud.neighbours();
    let gradients =
        Gradients::new(&cloud.nodes, &neighbours, Dimension::Two, |_, _, r| cloud.kernel().weight(r));
    let settings = Settings { tolerance: 1e-6, ..SETTINGS };
    let right = vec![1.0; cloud.nodes.len()];
    let iterations = |stiff: &dyn Fn(DVec3) -> bool| {
        let k: Vec<f64> = cloud.nodes.iter().map(|at| if stiff(*at) { 1e3 } else { 1.0 }).collect();
        let matrix = gradients.diffusion(&k, |n| cloud.edge(cloud.nodes[n]), false);
        let multigrid = Multigrid::<1, 1>::new(&matrix, &cloud.nodes, cloud.spacing);
        let mut x = vec![0.0; right.len()];
        solve(&matrix, Some(&multigrid), &right, &mut x, &settings).unwrap().iterations
    };
    let middle = DVec3::new(0.5, 0.0, 0.5);
    let even = iterations(&|_| false);
    let disc = iterations(&|at| at.distance(middle) < 0.2);
    let thread = iterations(&|at| (at.z - 0.5).abs() < 0.6 * cloud.spacing && (at.x - 0.5).abs() < 0.3);
    assert!(disc <= 2 * even && thread <= 2 * even, "even {even}, disc {disc}, thread {thread}");
}

/// Without a multigrid.
const DIAGONAL: Option<&Multigrid<1, 1>> = None;

/// A symmetric matrix: 2 on the diagonal of what is not given, more at the ends.
fn chain(number: u32) -> Matrix {
    Matrix::from_rows((0..number).map(|n| {
        let before = (n > 0).then(|| (n - 1, -1.0));
        let after = (n + 1 < number).then_some((n + 1, -1.0));
        (2.0, before.into_iter().chain(after).collect::<Vec<_>>())
    }))
}

#[test]
fn both_methods_find_what_elimination_finds() {
    let matrix = chain(300);
    let nodes: Vec<DVec3> = (0..300).map(|n| DVec3::new(0.01 * f64::from(n), 0.0, 0.0)).collect();
    let multigrid = Multigrid::new(&matrix, &nodes, 0.01);
    let right: Vec<f64> = (0..300).map(|n| (0.05 * f64::from(n)).sin()).collect();
    // Thomas's algorithm.
    let (mut above, mut exact) = (vec![0.0; 300], right.clone());
    for n in 0..300 {
        let (up, value) = if n > 0 { (above[n - 1], exact[n - 1]) } else { (0.0, 0.0) };
        above[n] = 1.0 / (2.0 - up);
        exact[n] = (exact[n] + value) * above[n];
    }
    for n in (0..299).rev() {
        exact[n] += above[n] * exact[n + 1];
    }
    for method in [Method::ConjugateGradients, Method::BiCgStab] {
        for multigrid in [DIAGONAL, Some(&multigrid)] {
            let settings = Settings { method, tolerance: 1e-12, iterations: 2000 };
            let mut x = vec![0.0; 300];
            let solved = solve(&matrix, multigrid, &right, &mut x, &settings).unwrap();
            assert!(solved.residual <= 1e-12);
            let off = x.iter().zip(&exact).map(|(x, exact)| (x - exact).abs()).fold(0.0, f64::max);
            assert!(off < 1e-7, "{method:?}, multigrid {}: {off:e}", multigrid.is_some());
            // From the solution on nothing is left to do.
            assert_eq!(solve(&matrix, multigrid, &right, &mut x, &settings).unwrap().iterations, 0);
        }
    }
}

/// A chain that hardly anything holds: 3e-8 beside 2, which 32 bits do not tell from nothing.
#[test]
fn what_32_bits_lose_is_found_in_64() {
    let held = |n: u32| {
        let others: Vec<(u32, f64)> =
            [n.checked_sub(1), (n < 299).then_some(n + 1)].into_iter().flatten().map(|m| (m, -1.0)).collect();
        (others.len() as f64 + 3e-8, others)
    };
    let matrix = Matrix::from_rows((0..300).map(held));
    let right: Vec<f64> = (0..300).map(|n| 1.0 + (0.05 * f64::from(n)).sin()).collect();
    for method in [Method::ConjugateGradients, Method::BiCgStab] {
        let settings = Settings { method, tolerance: 1e-6, iterations: 4000 };
        let mut x = vec![0.0; 300];
        solve(&matrix, DIAGONAL, &right, &mut x, &settings).unwrap();
        // What pulls all of it is borne by what holds it.
        let (pulled, held) = (right.iter().sum::<f64>(), 3e-8 * x.iter().sum::<f64>());
        assert!((held / pulled - 1.0).abs() < 1e-5, "{method:?}: {held} {pulled}");
    }
}

#[test]
fn what_cannot_be_solved_is_told() {
    let mut x = vec![0.0; 300];
    let settings = Settings { iterations: 3, ..SETTINGS };
    let slow = solve(&chain(300), DIAGONAL, &[1.0; 300], &mut x, &settings);
    assert!(matches!(slow, Err(Failure::Slow { iterations: 3, .. })), "{slow:?}");
    let broken = solve(&chain(300), DIAGONAL, &[f64::NAN; 300], &mut x, &SETTINGS);
    assert!(matches!(broken, Err(Failure::Breakdown { .. })), "{broken:?}");
    assert_eq!(solve(&chain(300), DIAGONAL, &[0.0; 300], &mut x, &SETTINGS).unwrap().iterations, 0);
    assert_eq!(x, [0.0; 300]);
    // Neighbours along a line tell no gradient across it.
    let line: Vec<DVec3> = (0..5).map(|n| DVec3::new(f64::from(n), 0.0, 0.0)).collect();
    let neighbours = Neighbours::within(&line, 1.5);
    let gradients = Gradients::new(&line, &neighbours, Dimension::Two, |_, _, _| 1.0);
    assert!(!gradients.tells(2) && gradients.laplacian(2).is_none());
    assert_eq!(gradients.gradient(2, &[0.0, 1.0, 2.0, 3.0, 4.0]), DVec3::ZERO);
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let problem = poisson(&Cloud::new(Dimension::Three, 14, 0.2), true);
            let mut x = vec![0.0; problem.right.len()];
            solve(&problem.matrix, Some(&problem.multigrid), &problem.right, &mut x, &SETTINGS).unwrap();
            x
        })
    };
    assert_eq!(with(1), with(3));
}
