//! `tremie calc`: formulae of concrete rheology in closed form, each with its source and the range in which it holds.
//!
//! A module holds a family of formulae: pure functions in SI units with the equation and its source beside them, the
//! arguments that the command line takes for them, and the answer that is made of both.

mod answer;
mod channel_at_rest;
mod duct;
mod fibres;
mod formwork;
mod layers;
mod rheometer;
mod slump;
mod spread;
mod squeeze;
mod stability;
mod suspension;
mod yield_stress;

pub(crate) use channel_at_rest::LcpcBox;
pub(crate) use duct::Bingham;
pub(crate) use squeeze::{
    final_height as squeezed_to_rest, squeeze_force as squeezing_force, squeezed_in_a_plane,
};

use std::process::ExitCode;

use clap::{Args, Subcommand};
use serde_json::{Value, json};

use crate::failure::WrongInput;
use crate::terminal;
use answer::Answer;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tremie calc
  tremie calc yield-stress --slump-flow 600mm
  tremie calc slump-flow --yield-stress 50Pa --density 2300kg/m3
  tremie calc l-box --yield-stress 30Pa --json
  tremie calc pipe --diameter 125mm --length 100m --flow-rate 30m3/h --yield-stress 100Pa --viscosity 30Pa.s

Without a formula it lists them all.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    formula: Option<Formula>,
    /// Print JSON, in SI units
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Formula {
    /// Slump flow from the yield stress (Roussel and Coussot 2005)
    SlumpFlow(spread::Arguments),
    /// Slump from the yield stress (Schowalter and Christensen 1998)
    Slump(slump::Arguments),
    /// Yield stress from a slump flow, a slump, an LCPC box or an L-box
    YieldStress(yield_stress::Arguments),
    /// Spread in the LCPC box from the yield stress (Roussel 2007)
    LcpcBox(channel_at_rest::LcpcArguments),
    /// H2/H1 in the L-box without bars from the yield stress (Nguyen, Roussel and Coussot 2006)
    LBox(channel_at_rest::LBoxArguments),
    /// Flow through a pipe (Buckingham 1921, Reiner 1926)
    Pipe(duct::PipeArguments),
    /// Flow between two parallel walls (Bird, Dai and Yarusso 1983)
    Channel(duct::ChannelArguments),
    /// Yield stress and viscosity from a coaxial rheometer (Reiner and Riwlin 1927)
    Rheometer(rheometer::Arguments),
    /// Force or final height of a sample squeezed between two plates
    Squeeze(squeeze::Arguments),
    /// Pressure on formwork of a concrete that stiffens at rest (Ovarlez and Roussel 2006)
    Formwork(formwork::Arguments),
    /// Longest rest between two layers (Roussel and Cussigh 2008)
    Layers(layers::Arguments),
    /// Largest particle that a yield stress holds (Beris and others 1985, Roussel 2006)
    Stability(stability::Arguments),
    /// Concrete from mortar: viscosity and yield stress with more grains (Krieger and Dougherty 1959)
    Suspension(suspension::Arguments),
    /// Orientation factor of fibres in a section (Dupont and Vandewalle 2005)
    Fibres(fibres::Arguments),
}

impl Formula {
    fn answer(&self) -> Result<Answer, WrongInput> {
        match self {
            Self::SlumpFlow(arguments) => Ok(spread::answer(arguments)),
            Self::Slump(arguments) => Ok(slump::answer(arguments)),
            Self::YieldStress(arguments) => yield_stress::answer(arguments),
            Self::LcpcBox(arguments) => Ok(channel_at_rest::lcpc_box(arguments)),
            Self::LBox(arguments) => Ok(channel_at_rest::l_box(arguments)),
            Self::Pipe(arguments) => Ok(duct::pipe(arguments)),
            Self::Channel(arguments) => Ok(duct::channel(arguments)),
            Self::Rheometer(arguments) => rheometer::answer(arguments),
            Self::Squeeze(arguments) => squeeze::answer(arguments),
            Self::Formwork(arguments) => formwork::answer(arguments),
            Self::Layers(arguments) => Ok(layers::answer(arguments)),
            Self::Stability(arguments) => stability::answer(arguments),
            Self::Suspension(arguments) => suspension::answer(arguments),
            Self::Fibres(arguments) => fibres::answer(arguments),
        }
    }
}

/// Works out a formula, or lists all.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let Some(formula) = &arguments.formula else {
        list(arguments.json);
        return Ok(ExitCode::SUCCESS);
    };
    let answer = formula.answer()?.checked()?;
    if arguments.json {
        terminal::say(&format!("{:#}", answer.json()));
    } else {
        terminal::say(&answer.text());
        for warning in &answer.warnings {
            terminal::warn(warning);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Names all formulae.
fn list(as_json: bool) {
    let command = Formula::augment_subcommands(clap::Command::new("calc"));
    let about = |formula: &clap::Command| formula.get_about().map(ToString::to_string).unwrap_or_default();
    if as_json {
        let formulae: Vec<Value> = command
            .get_subcommands()
            .map(|formula| json!({ "name": formula.get_name(), "about": about(formula) }))
            .collect();
        terminal::say(&format!("{:#}", json!(formulae)));
    } else {
        let rows: Vec<(&str, String)> =
            command.get_subcommands().map(|formula| (formula.get_name(), about(formula))).collect();
        terminal::say(&format!(
            "Formulae, each with its source and the range in which it holds\n{}\n\n`tremie calc FORMULA --help` tells what each takes.",
            terminal::columns(&rows)
        ));
    }
}
