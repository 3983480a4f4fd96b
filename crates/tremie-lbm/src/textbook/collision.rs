//! The collisions of the textbooks: one relaxation time, two, and regularised.
//!
//! With the equilibrium `f_eq = w (rho + rho (3 c.u + 9/2 (c.u)^2 - 3/2 u.u))`, the force of Guo, Zheng and Shi (2002),
//! `F_i = w (3 (c - u) + 9 (c.u) c).F`, and the rate omega that the flow curve gives for the stress (module `relaxation`):
//!
//! ```text
//!     BGK           f - omega (f - f_eq) + (1 - omega/2) F_i
//!     TRT           the same for the even and the odd part alone, the odd one with the rate that belongs to omega by the
//!                   magic number 3/16 (Ginzburg, Verhaeghe and d'Humieres 2008)
//!     regularised   f_eq + 9/2 w (c c - I/3) : ((1 - omega) P + (u F + F u)/2) + 3/2 w c.F, all but the stress forgotten
//!                   (Latt and Chopard 2006)
//! ```

use tremie_case::Collision;

use super::Law;
use super::lattices::Velocities;

/// What drives and resists, in lattice units.
pub(super) struct Rules {
    pub(super) collision: Collision,
    pub(super) law: Law,
    pub(super) gravity: [f64; 3],
    /// Relaxation times between which those of the flow curve are held.
    pub(super) relaxation_times: Option<[f64; 2]>,
}

/// What was found in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Seen {
    pub(super) density: f64,
    pub(super) velocity: [f64; 3],
    pub(super) shear_rate: f64,
    /// Kinematic shear stress.
    pub(super) stress: f64,
}

/// Product of the relaxation times, less a half each.
const MAGIC: f64 = 3.0 / 16.0;

/// Order of the components of a symmetric tensor, with how often each counts.
const COMPONENTS: [(usize, usize, f64); 6] =
    [(0, 0, 1.0), (1, 1, 1.0), (2, 2, 1.0), (0, 1, 2.0), (0, 2, 2.0), (1, 2, 2.0)];

/// Equilibrium.
pub(super) fn equilibrium<const Q: usize>(lattice: &Velocities<Q>, density: f64, u: [f64; 3]) -> [f64; Q] {
    let square: f64 = u.iter().map(|u| u * u).sum();
    std::array::from_fn(|i| {
        let along = lattice.along(i, u);
        lattice.w[i] * density * (1.0 + 3.0 * along + 4.5 * along * along - 1.5 * square)
    })
}

/// Populations after a collision, and what was found.
pub(super) fn collide<const Q: usize>(
    lattice: &Velocities<Q>,
    rules: &Rules,
    f: &[f64; Q],
) -> ([f64; Q], Seen) {
    let density: f64 = f.iter().sum();
    let force = rules.gravity.map(|g| density * g);
    let momentum: [f64; 3] =
        std::array::from_fn(|a| (0..Q).map(|i| f64::from(lattice.c[i][a]) * f[i]).sum::<f64>());
    let u: [f64; 3] = std::array::from_fn(|a| (momentum[a] + 0.5 * force[a]) / density);
    let eq = equilibrium(lattice, density, u);

    let mut stress = COMPONENTS.map(|(a, b, _)| {
        let product = |i: usize| f64::from(lattice.c[i][a] * lattice.c[i][b]) * (f[i] - eq[i]);
        (0..Q).map(product).sum::<f64>() + 0.5 * (u[a] * force[b] + u[b] * force[a])
    });
    let mean = (stress[0] + stress[1] + stress[2]) / 3.0;
    for normal in &mut stress[..3] {
        *normal -= mean;
    }
    let square: f64 = COMPONENTS.iter().zip(&stress).map(|((.., times), p)| times * p * p).sum();
    let q = 1.5 / density * (2.0 * square).sqrt();
    let mut omega = rules.law.omega(q);
    if let Some([least, largest]) = rules.relaxation_times {
        omega = omega.clamp(1.0 / largest, 1.0 / least);
    }
    let shear_rate = omega * q;
    let seen = Seen { density, velocity: u, shear_rate, stress: (q - 0.5 * shear_rate) / 3.0 };

    let pushed: f64 = (0..3).map(|a| u[a] * force[a]).sum();
    let push: [f64; Q] = std::array::from_fn(|i| {
        let (along, pull) = (lattice.along(i, u), lattice.along(i, force));
        lattice.w[i] * (3.0 * (pull - pushed) + 9.0 * along * pull)
    });
    let post = match rules.collision {
        Collision::Bgk => {
            std::array::from_fn(|i| f[i] - omega * (f[i] - eq[i]) + (1.0 - 0.5 * omega) * push[i])
        }
        Collision::Trt => {
            let odd = 2.0 * (2.0 - omega) / (2.0 - omega + 4.0 * MAGIC * omega);
            std::array::from_fn(|i| {
                let o = lattice.opposite(i);
                let part = |values: &[f64; Q], sign: f64| 0.5 * (values[i] + sign * values[o]);
                let relaxed = |rate: f64, sign: f64| {
                    (1.0 - 0.5 * rate) * part(&push, sign) - rate * (part(f, sign) - part(&eq, sign))
                };
                f[i] + relaxed(omega, 1.0) + relaxed(odd, -1.0)
            })
        }
        // (The program's own collision is not of these.)
        Collision::Regularised | Collision::Mtrt => std::array::from_fn(|i| {
            let c = lattice.c[i].map(f64::from);
            let kept: f64 = COMPONENTS
                .iter()
                .zip(&stress)
                .map(|((a, b, times), p)| {
                    let tensor = (1.0 - omega) * p + 0.5 * (u[*a] * force[*b] + u[*b] * force[*a]);
                    times * (c[*a] * c[*b] - if a == b { 1.0 / 3.0 } else { 0.0 }) * tensor
                })
                .sum();
            eq[i] + lattice.w[i] * (4.5 * kept + 1.5 * lattice.along(i, force))
        }),
    };
    (post, seen)
}
