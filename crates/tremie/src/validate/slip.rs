//! Channels between walls along which the fluid slides, against what their surfaces say and closed forms.

use anyhow::bail;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use tremie_case::{Case, Side, Surface};
use tremie_numerics::{DMat3, DVec3};
use tremie_rheology::FlowCurve;

use super::benchmark::{Check, Context, shown};
use super::channel::{
    CELLS, Level, NEARLY_STEADY, Poiseuille, column, diffusion_time, gap, l2_error, set_cells,
};
use super::flow::{Flow, lattice};

/// Channels that are drawn, and the seed.
const DRAWS: usize = 200;
const SEED: u64 = 2013;

/// Largest speed, in lattice units, that a channel would reach.
const SPEED: f64 = 0.03;

/// Looks at a fluid that sticks.
const SAMPLES: u32 = 500;

/// A channel in lattice units.
#[derive(Debug, Clone, Copy)]
struct Channel {
    slip_length: f64,
    viscosity: f64,
    cells: usize,
    wall_speed: f64,
    /// Share of the gap that the plug takes.
    plug: f64,
}

impl Channel {
    /// With walls at rest and a plug of up to `most_plug` if that is above zero, without a plug between moving walls otherwise.
    fn draw(random: &mut impl Rng, most_plug: f64) -> Self {
        let bingham = most_plug > 0.0;
        Self {
            slip_length: 0.1 * 1000f64.powf(random.random::<f64>()),
            viscosity: random.random_range(0.005..0.2),
            cells: random.random_range(30..=60),
            wall_speed: if bingham { 0.0 } else { random.random_range(-SPEED..SPEED) },
            plug: if bingham { random.random_range(0.0..most_plug) } else { 0.0 },
        }
    }

    /// Shear rate at the walls at which the speed in the middle becomes [`SPEED`].
    fn wall_rate(&self) -> f64 {
        SPEED / (self.slip_length + 0.25 * self.cells as f64 * (1.0 - self.plug))
    }

    /// The case for it; it starts at the speed at which the fluid will slide.
    fn case(&self, case: &Case) -> Case {
        let mut case = case.clone();
        let size = lattice(&mut case).cell_size;
        set_cells(&mut case, size, self.cells);
        let step = lattice(&mut case).time_step.unwrap_or(1e-3);
        let plastic_viscosity = self.viscosity * case.material.density * size * size / step;
        let stress = plastic_viscosity * self.wall_rate() / step / (1.0 - self.plug);
        case.material.curve = match self.plug {
            0.0 => FlowCurve::Newtonian { viscosity: plastic_viscosity },
            plug => FlowCurve::Bingham { yield_stress: plug * stress, plastic_viscosity },
        };
        case.domain.gravity = DVec3::X * 2.0 * stress / (case.material.density * gap(&case));
        let velocity = DVec3::X * self.wall_speed * size / step;
        let surface = Surface::Navier { slip_length: self.slip_length * size };
        case.domain.sides[4] = Side::Wall { velocity, surface };
        case.domain.sides[5] = Side::Wall { velocity, surface };
        case.fluid[0].velocity = velocity + DVec3::X * self.slip_length * self.wall_rate() * size / step;
        case
    }

    /// Slip length over what it should be, less one, at the wall where that is further off.
    fn error(&self, case: &Case) -> anyhow::Result<f64> {
        let case = self.case(case);
        let mut flow = Flow::new(case.clone());
        flow.until(0.5 * diffusion_time(&case, gap(&case)))?;
        let column = column(&flow.cells());
        let Side::Wall { velocity, .. } = case.domain.sides[4] else {
            bail!("the lower side must be a wall")
        };
        let size = gap(&case) / self.cells as f64;
        let off = |levels: [&Level; 3]| {
            let [a, b, c] = levels.map(|level| level.u - velocity.x);
            // The parabola through three cells, and its slope, at the wall.
            let (slip, slope) = ((15.0 * a - 10.0 * b + 3.0 * c) / 8.0, (3.0 * b - 2.0 * a - c) / size);
            slip / slope / (self.slip_length * size) - 1.0
        };
        let last = column.len() - 1;
        let low = off([&column[0], &column[1], &column[2]]);
        let high = off([&column[last], &column[last - 1], &column[last - 2]]);
        Ok(if low.abs() > high.abs() { low } else { high })
    }
}

/// An inclined channel in lattice units.
#[derive(Debug, Clone, Copy)]
struct Inclined {
    slip_length: f64,
    viscosity: f64,
    /// Way of the lattice along x and z, in cells.
    shift: [f64; 2],
}

impl Inclined {
    /// Distance between the walls in cells.
    const WIDTH: f64 = 25.0;
    /// A point of a lower wall in m.
    const WALL: DVec3 = DVec3::new(0.0, 0.0, 0.0535936);

    /// Unit vectors along the channel and across it.
    fn axes() -> [DVec3; 2] {
        let across = DVec3::new(-4.0, 0.0, 11.0).normalize();
        [DVec3::new(across.z, 0.0, -across.x), across]
    }

    fn draw(random: &mut impl Rng) -> Self {
        Self {
            slip_length: 0.1 * 1000f64.powf(random.random::<f64>()),
            viscosity: random.random_range(0.005..0.2),
            shift: [random.random(), random.random()],
        }
    }

    /// The case for it; it starts at the speed at which the fluid will slide.
    fn case(&self, case: &Case) -> Case {
        let mut case = case.clone();
        let size = lattice(&mut case).cell_size;
        let step = lattice(&mut case).time_step.unwrap_or(1e-3);
        let [along, _] = Self::axes();
        let shift = size * DVec3::new(self.shift[0], 0.0, self.shift[1]);
        case.domain.min += shift;
        case.domain.max += shift;
        let viscosity = self.viscosity * case.material.density * size * size / step;
        case.material.curve = FlowCurve::Newtonian { viscosity };
        let rate = SPEED / (self.slip_length + 0.25 * Self::WIDTH) / step;
        case.domain.gravity = along * 2.0 * viscosity * rate / (case.material.density * Self::WIDTH * size);
        for solid in &mut case.solids {
            solid.surface = Surface::Navier { slip_length: self.slip_length * size };
        }
        case.fluid[0].velocity = along * self.slip_length * size * rate;
        case
    }

    /// Slip length over what it should be, less one, at the wall where that is further off.
    fn error(&self, case: &Case) -> anyhow::Result<f64> {
        let mut case = self.case(case);
        let size = lattice(&mut case).cell_size;
        let mut flow = Flow::new(case.clone());
        flow.until(0.5 * diffusion_time(&case, Self::WIDTH * size))?;
        let cells = flow.cells();
        let [along, across] = Self::axes();
        // The walls repeat from channel to channel.
        let apart = across.z * 40.0;
        let mut sums = [(DMat3::ZERO, DVec3::ZERO); 2];
        for k in 0..cells.count[2] {
            for i in 0..cells.count[0] {
                let d = ((cells.centre(i, 0, k) - Self::WALL).dot(across) / size).rem_euclid(apart);
                let speed = cells.velocity[cells.index(i, 0, k)].dot(along);
                for (d, (matrix, right)) in [d, Self::WIDTH - d].into_iter().zip(&mut sums) {
                    if (1.0..6.0).contains(&d) {
                        let powers = DVec3::new(1.0, d, d * d);
                        *matrix += DMat3::from_cols(powers, powers * d, powers * d * d);
                        *right += powers * speed;
                    }
                }
            }
        }
        let off = sums.map(|(matrix, right)| {
            let parabola = matrix.inverse() * right;
            parabola.x / parabola.y / self.slip_length - 1.0
        });
        Ok(if off[0].abs() > off[1].abs() { off[0] } else { off[1] })
    }
}

/// Newtonian channels inclined to the lattice.
pub(super) fn slip_inclined(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let mut random = Pcg64Mcg::seed_from_u64(SEED);
    let channels: Vec<Inclined> = (0..DRAWS).map(|_| Inclined::draw(&mut random)).collect();
    let errors = channels.par_iter().map(|channel| channel.error(&case)).collect::<Result<Vec<_>, _>>()?;
    let drawn: Vec<_> = errors.iter().zip(&channels).collect();
    let worst = |seen: fn(&Inclined) -> bool| {
        let seen = drawn.iter().filter(|(_, channel)| seen(channel));
        seen.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs())).copied()
    };
    // Below that viscosity the solver gives up exact walls for stability.
    let exact = |channel: &Inclined| channel.viscosity > 1.0 / 64.0;
    let (Some((error, channel)), Some((thicker, _))) = (worst(|_| true), worst(exact)) else {
        bail!("no channel was drawn")
    };
    let Inclined { slip_length, viscosity, .. } = channel;
    let name = format!("largest error of the slip length ({slip_length:.3} cells, viscosity {viscosity:.4})");
    let mean = errors.iter().map(|error| error.abs()).sum::<f64>() / DRAWS as f64;
    Ok(vec![
        context.zero("slip length", name, "", *error)?,
        shown("largest error for viscosities above 1/64", thicker.abs()),
        shown("mean error of the slip length", mean),
    ])
}

/// Slip lengths that the flow shows, over those that the walls have.
fn slip(context: &Context, most_plug: f64) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let mut random = Pcg64Mcg::seed_from_u64(SEED);
    let channels: Vec<Channel> = (0..DRAWS).map(|_| Channel::draw(&mut random, most_plug)).collect();
    let errors = channels.par_iter().map(|channel| channel.error(&case)).collect::<Result<Vec<_>, _>>()?;
    let mean = errors.iter().map(|error| error.abs()).sum::<f64>() / DRAWS as f64;
    let worst = errors.iter().zip(&channels).max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    let Some((error, channel)) = worst else { bail!("no channel was drawn") };
    let Channel { slip_length, viscosity, cells, plug, .. } = channel;
    let name = format!(
        "largest error of the slip length ({slip_length:.3} cells, viscosity {viscosity:.4}, {cells} across, plug {plug:.2})"
    );
    Ok(vec![context.zero("slip length", name, "", *error)?, shown("mean error of the slip length", mean)])
}

/// Newtonian channels between moving walls.
pub(super) fn slip_newtonian(context: &Context) -> anyhow::Result<Vec<Check>> {
    slip(context, 0.0)
}

/// Bingham channels.
pub(super) fn slip_bingham(context: &Context) -> anyhow::Result<Vec<Check>> {
    slip(context, 0.7)
}

/// Bingham channels between films.
pub(super) fn wall_law(context: &Context) -> anyhow::Result<Vec<Check>> {
    let case = context.case("case.toml")?;
    let Side::Wall { surface: Surface::Film { yield_stress, viscosity }, .. } = case.domain.sides[4] else {
        bail!("the lower side must be a film");
    };
    let fluid = case.material.curve.yield_stress();
    let mut checks = Vec::new();
    for wall_stress in [0.8 * yield_stress, 1.5 * yield_stress, 1.5 * fluid, 3.0 * fluid] {
        for cells in CELLS {
            let mut case = case.clone();
            let gap = gap(&case);
            set_cells(&mut case, gap / cells as f64, cells);
            case.domain.gravity = DVec3::X * 2.0 * wall_stress / (case.material.density * gap);
            let sheared = Poiseuille::of(&case);
            let slides = (wall_stress - yield_stress).max(0.0) / viscosity;
            let mut flow = Flow::new(case.clone());
            let name = format!("{wall_stress:.1} Pa at the wall, {cells} cells");
            if slides == 0.0 {
                // A rigid fluid that is let go all at once rings for ever; it must not get anywhere.
                let mut mean = 0.0;
                for sample in 1..=SAMPLES {
                    flow.until(f64::from(sample) * diffusion_time(&case, gap) / f64::from(SAMPLES))?;
                    mean += column(&flow.cells())[cells / 2].u / f64::from(SAMPLES);
                }
                let share = mean / (wall_stress / viscosity);
                checks.push(context.zero(
                    "stuck",
                    format!("mean speed over that of a film without yield stress, {name}"),
                    "",
                    share,
                )?);
                continue;
            }
            // As long as it takes the film to slow the whole fluid, or the fluid itself.
            let film_time = case.material.density * gap / (2.0 * viscosity);
            let steady = flow.until_steady(film_time.max(diffusion_time(&case, 0.5 * gap)), NEARLY_STEADY)?;
            let exact = |z: f64| slides + if sheared.plug() < 1.0 { sheared.at(z) } else { 0.0 };
            let error = l2_error(&column(&steady), exact);
            let quantity = format!("velocity, {name} (L2)");
            checks.push(if cells == 32 {
                context.zero("velocity", quantity, "", error)?
            } else {
                shown(quantity, error)
            });
        }
    }
    Ok(checks)
}
