//! Steady laminar flow of a Bingham fluid that a pressure drives through a pipe or between parallel walls.
//!
//! With a pressure gradient G, the stress at the wall is `G R / 2` in a pipe of radius R and `G b` between walls 2 b
//! apart; phi, the yield stress over it, is the share of the section that the plug takes. The flow rates are
//!
//! ```text
//!     Q = pi R^4 G / (8 mu) (1 - 4 phi / 3 + phi^4 / 3)          pipe: E. Buckingham 1921, M. Reiner 1926
//!     Q = 2 w b^3 G / (3 mu) (1 - 3 phi / 2 + phi^3 / 2)         walls of width w: Bird, Dai and Yarusso 1983
//! ```

use std::f64::consts::PI;

use clap::Args;
use tremie_numerics::root::turning_point;

use super::answer::{
    Answer, KG_PER_M3, KPA, M, M_PER_S, M3_PER_H, MM, ONE, PA, PA_S, Quantity, quantity, warnings,
};
use crate::numbers::significant;
use crate::quantities::{density, flow_rate, length, stress, stress_or_none, viscosity};

/// Reynolds number above which a Newtonian flow may be turbulent; a Bingham fluid stays laminar for longer.
const TURBULENT: f64 = 2100.0;

/// A Bingham fluid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bingham {
    /// In Pa.
    pub(crate) yield_stress: f64,
    /// In Pa s.
    pub(crate) viscosity: f64,
}

/// Volume in m3/s that a pressure gradient in Pa/m drives through a pipe of `radius` m.
pub(super) fn pipe_flow_rate(fluid: Bingham, radius: f64, gradient: f64) -> f64 {
    let phi = (2.0 * fluid.yield_stress / (gradient * radius)).min(1.0);
    // 1 - 4 phi / 3 + phi^4 / 3, without cancellation near phi = 1.
    let share = (1.0 - phi) * (1.0 - phi) * (3.0 + 2.0 * phi + phi * phi) / 3.0;
    PI * radius.powi(4) * gradient / (8.0 * fluid.viscosity) * share
}

/// Mean velocity in m/s to which a pressure gradient in Pa/m drives a fluid between walls `gap` m apart.
pub(super) fn channel_velocity(fluid: Bingham, gap: f64, gradient: f64) -> f64 {
    let half = 0.5 * gap;
    let phi = (fluid.yield_stress / (gradient * half)).min(1.0);
    // 1 - 3 phi / 2 + phi^3 / 2.
    let share = (1.0 - phi) * (1.0 - phi) * (2.0 + phi) / 2.0;
    half * half * gradient / (3.0 * fluid.viscosity) * share
}

/// Pressure gradient in Pa/m at which `flow` of it reaches `wanted`; both grow together.
pub(super) fn gradient(wanted: f64, flow: impl Fn(f64) -> f64) -> f64 {
    turning_point(f64::MAX, |gradient| flow(gradient) < wanted)
}

#[derive(Debug, Args)]
struct Fluid {
    /// Yield stress; may be zero
    #[arg(long, value_name = "STRESS", value_parser = stress_or_none)]
    yield_stress: f64,
    /// Plastic viscosity
    #[arg(long, value_name = "VISCOSITY", value_parser = viscosity)]
    viscosity: f64,
    /// Density, to tell whether the flow is laminar
    #[arg(long, value_name = "DENSITY", default_value = "2300kg/m3", value_parser = density)]
    density: f64,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct Drive {
    /// Volume that flows per time
    #[arg(long, value_name = "FLOW", value_parser = flow_rate)]
    flow_rate: Option<f64>,
    /// Pressure that drives it, over the length
    #[arg(long, value_name = "PRESSURE", value_parser = stress)]
    pressure: Option<f64>,
}

impl Drive {
    /// Pressure gradient in Pa/m over a length, and flow rate in m3/s.
    fn gradient_and_flow(&self, length: f64, flow_rate: impl Fn(f64) -> f64) -> (f64, f64) {
        match (self.flow_rate, self.pressure) {
            (Some(flow), _) => (gradient(flow, flow_rate), flow),
            (None, pressure) => {
                let gradient = pressure.unwrap_or(0.0) / length;
                (gradient, flow_rate(gradient))
            }
        }
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc pipe --diameter 125mm --length 100m --flow-rate 30m3/h --yield-stress 100Pa --viscosity 30Pa.s
  tremie calc pipe --diameter 100mm --length 1m --pressure 20kPa --yield-stress 50Pa --viscosity 20Pa.s")]
pub(super) struct PipeArguments {
    /// Inner diameter of the pipe
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    diameter: f64,
    /// Its length
    #[arg(long, value_name = "LENGTH", default_value = "1m", value_parser = length)]
    length: f64,
    #[command(flatten)]
    fluid: Fluid,
    #[command(flatten)]
    drive: Drive,
}

/// Flow through a pipe.
pub(super) fn pipe(arguments: &PipeArguments) -> Answer {
    let PipeArguments { diameter, length, fluid, drive } = arguments;
    let radius = 0.5 * diameter;
    let bingham = Bingham { yield_stress: fluid.yield_stress, viscosity: fluid.viscosity };
    let (gradient, flow) = drive.gradient_and_flow(*length, |g| pipe_flow_rate(bingham, radius, g));
    let duct =
        Duct { stress: 0.5 * gradient * radius, velocity: flow / (PI * radius * radius), across: *diameter };
    Answer {
        title: "Flow through a pipe",
        inputs: [vec![quantity("diameter", "diameter_m", *diameter, MM)], fluid.inputs(*length)].concat_all(),
        results: duct.results(fluid, gradient * length, flow),
        equation: &[
            "Q = pi R^4 G / (8 mu) (1 - 4/3 phi + 1/3 phi^4)",
            "phi = 2 tau0 / (G R); Q flow rate, R radius, G pressure per length, mu plastic viscosity",
        ],
        source: "E. Buckingham, Proc. ASTM 21 (1921), 1154; M. Reiner, Kolloid-Zeitschrift 39 (1926), 80",
        validity: &[
            "steady laminar flow without slip. Pumped concrete slips on a layer of fine mortar at the wall: it needs",
            "less pressure than this",
        ],
        warnings: duct.warnings(fluid),
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc channel --gap 75mm --width 1m --flow-rate 20m3/h --yield-stress 50Pa --viscosity 30Pa.s
  tremie calc channel --gap 60mm --width 1m --length 1m --pressure 22kPa --yield-stress 50Pa --viscosity 30Pa.s")]
pub(super) struct ChannelArguments {
    /// Distance between the walls
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    gap: f64,
    /// Width of the walls
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    width: f64,
    /// Their length along the flow
    #[arg(long, value_name = "LENGTH", default_value = "1m", value_parser = length)]
    length: f64,
    #[command(flatten)]
    fluid: Fluid,
    #[command(flatten)]
    drive: Drive,
}

/// Flow between parallel walls.
pub(super) fn channel(arguments: &ChannelArguments) -> Answer {
    let ChannelArguments { gap, width, length, fluid, drive } = arguments;
    let bingham = Bingham { yield_stress: fluid.yield_stress, viscosity: fluid.viscosity };
    let section = gap * width;
    let (gradient, flow) = drive.gradient_and_flow(*length, |g| section * channel_velocity(bingham, *gap, g));
    let duct = Duct { stress: 0.5 * gradient * gap, velocity: flow / section, across: *gap };
    let mut warnings = duct.warnings(fluid);
    if *gap > 0.1 * width {
        warnings.push(
            "the gap is more than a tenth of the width: the side walls, left out here, count".to_owned(),
        );
    }
    Answer {
        title: "Flow between two parallel walls",
        inputs: [
            vec![quantity("gap", "gap_m", *gap, MM), quantity("width", "width_m", *width, MM)],
            fluid.inputs(*length),
        ]
        .concat_all(),
        results: duct.results(fluid, gradient * length, flow),
        equation: &[
            "Q = 2 w b^3 G / (3 mu) (1 - 3/2 phi + 1/2 phi^3)",
            "phi = tau0 / (G b); Q flow rate, w width, 2 b gap, G pressure per length, mu plastic viscosity",
        ],
        source: "R. B. Bird, G. C. Dai, B. J. Yarusso, Reviews in Chemical Engineering 1 (1983), 1-70",
        validity: &["steady laminar flow without slip between walls whose width is ten gaps or more"],
        warnings,
    }
}

/// Joins lists of quantities, which cannot be copied.
trait ConcatAll {
    fn concat_all(self) -> Vec<Quantity>;
}

impl<const N: usize> ConcatAll for [Vec<Quantity>; N] {
    fn concat_all(self) -> Vec<Quantity> {
        self.into_iter().flatten().collect()
    }
}

impl Fluid {
    fn inputs(&self, length: f64) -> Vec<Quantity> {
        vec![
            quantity("length", "length_m", length, M),
            quantity("yield stress", "yield_stress_Pa", self.yield_stress, PA),
            quantity("plastic viscosity", "viscosity_Pa_s", self.viscosity, PA_S),
            quantity("density", "density_kg_m3", self.density, KG_PER_M3),
        ]
    }
}

/// What pipe and channel have in common.
struct Duct {
    /// Stress at the wall in Pa.
    stress: f64,
    /// Mean velocity in m/s.
    velocity: f64,
    /// Diameter or gap in m.
    across: f64,
}

impl Duct {
    fn reynolds(&self, fluid: &Fluid) -> f64 {
        fluid.density * self.velocity * self.across / fluid.viscosity
    }

    fn results(&self, fluid: &Fluid, pressure: f64, flow: f64) -> Vec<Quantity> {
        let rate = (self.stress - fluid.yield_stress).max(0.0) / fluid.viscosity;
        let plug = (fluid.yield_stress / self.stress).min(1.0);
        vec![
            quantity("pressure", "pressure_Pa", pressure, KPA),
            quantity("flow rate", "flow_rate_m3_s", flow, M3_PER_H),
            quantity("mean velocity", "velocity_m_s", self.velocity, M_PER_S),
            quantity("stress at the wall", "wall_stress_Pa", self.stress, PA),
            quantity("shear rate at the wall, 1/s", "wall_shear_rate_1_s", rate, ONE),
            quantity("plug across", "plug_m", plug * self.across, MM),
            quantity("Reynolds number", "reynolds", self.reynolds(fluid), ONE),
        ]
    }

    fn warnings(&self, fluid: &Fluid) -> Vec<String> {
        warnings([
            (
                self.stress <= fluid.yield_stress,
                format!(
                    "it does not flow: the stress at the wall is {} Pa, no more than the yield stress",
                    significant(self.stress)
                ),
            ),
            (
                self.reynolds(fluid) > TURBULENT,
                format!(
                    "the Reynolds number is {}, above 2100: the flow may be turbulent",
                    significant(self.reynolds(fluid))
                ),
            ),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pipes_are_those_of_buckingham_and_reiner() {
        // Plug over radius; Bingham number tau0 R / (mu U) and gradient G R^2 / (mu U), from the polynomial.
        for (phi, bingham, gradient) in [
            (0.1, 0.461521, 9.23041),
            (0.5, 5.64706, 22.5882),
            (0.8, 45.8015, 114.504),
            (0.9, 192.513, 427.807),
        ] {
            let fluid = Bingham { yield_stress: bingham, viscosity: 1.0 };
            let flow = pipe_flow_rate(fluid, 1.0, gradient);
            assert!((flow / PI - 1.0).abs() < 1e-4, "{phi}: {flow}");
            let found = super::gradient(PI, |g| pipe_flow_rate(fluid, 1.0, g));
            assert!((found / gradient - 1.0).abs() < 1e-5, "{phi}: {found}");
        }
    }

    #[test]
    fn channels_are_those_of_bird_and_others() {
        // tau0 b / (mu U) and G b^2 / (mu U) with the half gap b.
        for (bingham, gradient) in [(0.352734, 3.52734), (4.8, 9.6), (42.8571, 53.5714), (186.207, 206.897)] {
            let fluid = Bingham { yield_stress: bingham, viscosity: 1.0 };
            let velocity = channel_velocity(fluid, 2.0, gradient);
            assert!((velocity - 1.0).abs() < 1e-4, "{velocity}");
        }
    }

    #[test]
    fn without_yield_stress_it_is_hagen_and_poiseuille() {
        let fluid = Bingham { yield_stress: 0.0, viscosity: 30.0 };
        let flow = pipe_flow_rate(fluid, 0.05, 1e4);
        assert!((flow / (PI * 0.05f64.powi(4) * 1e4 / 240.0) - 1.0).abs() < 1e-14);
        let velocity = channel_velocity(fluid, 0.1, 1e4);
        assert!((velocity / (0.1 * 0.1 * 1e4 / (12.0 * 30.0)) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn the_flow_rate_is_that_of_the_profile() {
        // Velocity from the flow curve, integrated inwards from the wall over thin rings.
        let (fluid, radius, gradient) = (Bingham { yield_stress: 80.0, viscosity: 25.0 }, 0.05, 6000.0);
        let rings = 20_000;
        let step = radius / f64::from(rings);
        let (mut velocity, mut flow) = (0.0, 0.0);
        for n in (0..rings).rev() {
            let r = (f64::from(n) + 0.5) * step;
            let rate = (0.5 * gradient * r - fluid.yield_stress).max(0.0) / fluid.viscosity;
            flow += 2.0 * PI * r * step * (velocity + 0.5 * step * rate);
            velocity += step * rate;
        }
        assert!((pipe_flow_rate(fluid, radius, gradient) / flow - 1.0).abs() < 1e-6);
    }

    #[test]
    fn below_the_yield_stress_nothing_flows() {
        let fluid = Bingham { yield_stress: 100.0, viscosity: 30.0 };
        assert_eq!(pipe_flow_rate(fluid, 0.05, 3999.0), 0.0);
        assert_eq!(channel_velocity(fluid, 0.1, 1999.0), 0.0);
    }
}
