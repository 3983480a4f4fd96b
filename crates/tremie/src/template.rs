//! `tremie new`: a commented case file to start from, with the files that it names.
//!
//! The templates are the ready cases in `cases/`, compiled in, so that there is one of each.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{ArgGroup, Args};

use crate::failure::WrongInput;
use crate::run::quoted;
use crate::terminal;

/// A case to start from.
#[derive(Debug, Clone, Copy)]
struct Template {
    name: &'static str,
    about: &'static str,
    text: &'static str,
    /// Whether it is a hardened beam, for `tremie fracture`.
    beam: bool,
    /// Names and contents of the files that the case names; they lie beside it.
    files: &'static [(&'static str, &'static str)],
}

macro_rules! template {
    ($name:literal, $about:literal $(, $file:literal)*) => {
        Template {
            name: $name,
            about: $about,
            text: include_str!(concat!("../../../cases/", $name, "/case.toml")),
            beam: false,
            files: &[$(($file, include_str!(concat!("../../../cases/", $name, "/", $file))),)*],
        }
    };
}

macro_rules! beam {
    ($name:literal, $about:literal) => {
        Template { beam: true, ..template!($name, $about) }
    };
}

const TEMPLATES: [Template; 34] = [
    template!("slump-flow", "a cone of concrete is let go and spreads on a plate (EN 12350-8)"),
    template!("l-box", "concrete flows under a gate and through bars along a channel (EN 12350-10)"),
    template!("planar-collapse", "a wall of concrete collapses when its forms are taken away (dam break)"),
    template!("wu-slump", "a cone in a plane is lifted, by particles (Wu)", "wu-slump-text.toml"),
    template!(
        "wu-l-box",
        "concrete flows from a column into a channel in a plane, by particles (Wu)",
        "wu-l-box-text.toml"
    ),
    template!("squeeze-load", "a plate under a constant load squeezes a block in a plane"),
    template!("squeeze-velocity", "a plate that comes down evenly squeezes a block in a plane"),
    template!("casson-cavity", "a moving lid drags a Casson fluid round, by Lagrangian differencing (Basic)"),
    template!("skewed-cavity", "the same between slanted walls, with a fluid that thickens (Basic)"),
    template!(
        "bingham-dam-break",
        "a long column of mud is let go at one end, by Lagrangian differencing (Basic)"
    ),
    template!("abrams-slump", "a cone of viscous concrete is let go, by Lagrangian differencing (Basic)"),
    template!("channel", "a body force drives concrete between two plates, periodic along the flow"),
    template!("drop", "a ball of concrete falls on the floor"),
    template!("dam-break", "a column of water collapses when its gate vanishes (Martin and Moyce)"),
    template!("cavity", "a moving lid drags the fluid in a square trough round"),
    template!("slab", "a slab is filled from a hose near its corner, in two batches (Svec)"),
    template!("beam", "a beam of RILEM is cast from a hose (Svec)"),
    template!("wall", "a wall with stiffeners is cast from a hose that rises with the concrete (Svec)"),
    template!("fibre-slump", "a cone of concrete with steel fibres is let go and spreads (Svec)"),
    template!(
        "heterogeneous-slump",
        "a cone of concrete with aggregates and steel fibres is let go and spreads (Svec)"
    ),
    template!(
        "fibre-slab",
        "a slab with 41,000 steel fibres is cast from a hose near its corner (Svec)",
        "cuts.toml"
    ),
    template!("fibre-plate", "a larger one with 72,000 (Svec)"),
    template!("fibre-beam", "a beam of RILEM with steel fibres is cast from a hose (Svec)"),
    template!("fibre-wall", "a wall with stiffeners and 42,000 steel fibres is cast from a hose (Svec)"),
    template!("fibre-l-box", "a clear gel with 22,000 fibres flows through the bars of an L-box (Svec)"),
    template!("couette-spheres", "spheres between moving plates: what they add to the viscosity (Svec)"),
    template!("couette-fibres", "fibres between moving plates: what they add to the viscosity (Svec)"),
    template!("l-form", "an L-shaped form from an STL file is filled from a hose", "form.stl"),
    beam!("plain-beam", "a hardened beam of plain concrete with a notch is bent (EN 14651)"),
    beam!("random-fibre-beam", "the same with steel fibres in all directions"),
    beam!("aligned-fibre-beam", "the same with steel fibres along the beam"),
    beam!("thesis-b1", "a beam that was cut from the slab is bent, the weakest (Svec)"),
    beam!("thesis-b2", "another (Svec)"),
    beam!("thesis-b3", "another, the strongest (Svec)"),
];

#[derive(Debug, Args)]
#[command(
    group = ArgGroup::new("what").required(true).args(["experiment", "list"]),
    after_help = "\
Examples:
  tremie new --list
  tremie new slump-flow
  tremie new planar-collapse my-wall.toml

Every key has a comment; edit the values, then `tremie check` and `tremie run` the file (a hardened beam: `tremie fracture`). Files that a case names, such as the STL
file of l-form, are written beside it."
)]
pub(crate) struct Arguments {
    /// The experiment (see --list)
    #[arg(hide_possible_values = true, value_parser = by_name())]
    experiment: Option<Template>,
    /// The file to write [default: EXPERIMENT.toml in the current folder]
    #[arg(requires = "experiment")]
    path: Option<PathBuf>,
    /// Say which experiments there are
    #[arg(long, conflicts_with_all = ["path", "force"])]
    list: bool,
    /// Replace the file if there is one
    #[arg(long)]
    force: bool,
}

fn by_name() -> impl TypedValueParser<Value = Template> {
    let names = PossibleValuesParser::new(TEMPLATES.map(|template| template.name));
    names.try_map(|name| TEMPLATES.into_iter().find(|template| template.name == name).ok_or("unknown"))
}

/// Writes a case file, or tells which there are.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    match arguments.experiment {
        Some(template) => {
            let name = PathBuf::from(format!("{}.toml", template.name));
            write(&template, arguments.path.as_deref().unwrap_or(&name), arguments.force)?;
        }
        None => {
            let rows = TEMPLATES.map(|template| (template.name, template.about.to_owned()));
            terminal::say(&terminal::columns(&rows));
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn write(template: &Template, path: &Path, force: bool) -> anyhow::Result<()> {
    let refuse =
        |path: &Path, problem: String| Err(WrongInput(format!("{} {problem}", path.display())).into());
    let beside = |(name, text): &(&str, &'static str)| (path.with_file_name(name), *text);
    let case = std::iter::once((path.to_owned(), template.text));
    let files: Vec<(PathBuf, &str)> = case.chain(template.files.iter().map(beside)).collect();
    for (path, _) in &files {
        if path.is_dir() {
            return refuse(path, "is a folder; name a file to write".to_owned());
        }
        if path.exists() && !force {
            return refuse(path, "exists already; give --force to replace it, or another name".to_owned());
        }
    }
    if let Some(folder) = path.parent().filter(|folder| *folder != Path::new("") && !folder.is_dir()) {
        return refuse(path, format!("cannot be written: there is no folder {}", folder.display()));
    }
    for (path, text) in &files {
        if let Err(error) = tremie_output::atomic::write(path, text.as_bytes()) {
            let reason = std::error::Error::source(&error).unwrap_or(&error);
            return refuse(path, format!("cannot be written: {reason}"));
        }
    }
    let name = quoted(path);
    let next = if template.beam {
        format!("tremie fracture {name}")
    } else {
        format!("tremie check {name}\n  tremie run {name}")
    };
    terminal::say(&format!("{} written. Edit it, then\n  {next}", path.display()));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_case::{BeamCase, Case};

    fn parse(beam: bool, name: &str, text: &str) {
        let read =
            if beam { BeamCase::parse(name, text).map(drop) } else { Case::parse(name, text).map(drop) };
        read.unwrap_or_else(|error| panic!("{error}"));
    }

    #[test]
    fn every_case_that_comes_along_is_a_template() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases");
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        let mut templates = TEMPLATES.map(|template| template.name);
        templates.sort_unstable();
        assert_eq!(names, templates);
    }

    #[test]
    fn templates_are_right_and_so_are_their_options() {
        for Template { name, text, beam, files, .. } in TEMPLATES {
            let folder = tempfile::tempdir().unwrap();
            for (name, text) in files {
                std::fs::write(folder.path().join(name), text).unwrap();
            }
            let name = folder.path().join(name);
            let name = name.to_str().unwrap();
            parse(beam, name, text);
            let options: Vec<&str> = text
                .lines()
                .filter(|line| {
                    line.strip_prefix('#').is_some_and(|rest| rest.starts_with(char::is_alphabetic))
                })
                .collect();
            assert!(options.len() > 5, "{name}");
            for option in options {
                let text = text.replace(option, &option[1..]);
                parse(beam, name, &text);
            }
        }
    }

    #[test]
    fn every_line_with_a_key_says_what_it_means() {
        for Template { name, text, .. } in TEMPLATES {
            let lines: Vec<&str> = text.lines().collect();
            for (n, line) in lines.iter().enumerate() {
                let key = line.strip_prefix('#').unwrap_or(line);
                if key.starts_with(|c: char| c.is_ascii_lowercase()) {
                    let around = lines[n.saturating_sub(2)..n].iter().any(|line| line.contains("# "));
                    assert!(key.contains('#') || around, "{name}: {line}");
                }
            }
        }
    }
}
