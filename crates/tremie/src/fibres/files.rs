//! The files that are written of what is cut out of a cast.

use std::path::{Path, PathBuf};

use tremie_case::Cuts;
use tremie_output::table::{self, Cell};
use tremie_simulation::bodies::export_pieces;
use tremie_simulation::{Fluid, pictures};

use super::figures::{Figures, Lying, PARTS, Through};
use super::table::AXES;
use super::{CUTS, Cast};
use crate::failure::{WrongInput, chain};

/// The columns of `beams.csv`: each beam has a row for all of it and for each half, and its section stands in the first.
const BEAMS: [&str; 24] = [
    "beam",
    "part",
    "fibres",
    "length_m",
    "volume_m3",
    "concrete_m3",
    "volume_fraction",
    "a11",
    "a22",
    "a33",
    "a12",
    "a13",
    "a23",
    "eigenvalue1",
    "eigenvalue2",
    "eigenvalue3",
    "axis_x",
    "axis_y",
    "axis_z",
    "section_axis",
    "section_at_m",
    "section_fibres",
    "section_fibres_per_m2",
    "section_concrete_m2",
];
/// The last column of both tables.
const FACTOR: &str = "orientation_factor";
/// The columns of `planes.csv`.
const PLANES: [&str; 4] = ["plane", "fibres", "fibres_per_m2", "concrete_m2"];

/// Writes all files into a folder, which is made if need be; their paths.
pub(super) fn write(
    cast: &Cast,
    figures: &Figures,
    cuts: &Cuts,
    folder: &Path,
) -> Result<Vec<PathBuf>, WrongInput> {
    let Fluid::Cells(cells) = &cast.state.fluid;
    let bodies = &cast.state.inclusions;
    let refused =
        |path: &Path, reason: String| WrongInput(format!("{} cannot be written: {reason}", path.display()));
    std::fs::create_dir_all(folder).map_err(|error| refused(folder, error.to_string()))?;
    let mut written = Vec::new();
    let mut write = |name: String, how: &dyn Fn(&Path) -> Result<(), tremie_output::Error>| {
        let path = folder.join(name);
        how(&path).map_err(|error| {
            // The path is told already.
            let reason = std::error::Error::source(&error).unwrap_or(&error);
            refused(&path, chain(reason))
        })?;
        written.push(path);
        Ok::<(), WrongInput>(())
    };
    write(CUTS.to_owned(), &|path| tremie_output::atomic::write(path, cuts.text().as_bytes()))?;
    if !figures.beams.is_empty() {
        let columns: Vec<&str> = BEAMS.into_iter().chain([FACTOR]).collect();
        write("beams.csv".to_owned(), &|path| table::write(path, &columns, &beams(figures)))?;
        let title = format!("{}, t = {:.2} s", figures.title, figures.time);
        let blocks: Vec<_> = figures.beams.iter().map(|beam| (beam.name.as_str(), beam.block)).collect();
        write("cuts.png".to_owned(), &|path| pictures::beams(cells, bodies, &title, &blocks)?.write(path))?;
        for beam in figures.beams.iter().filter(|_| cells.field_beside(bodies).is_none()) {
            write(format!("{}.csv", beam.name), &|path| export_pieces(bodies, &beam.block, path))?;
        }
    }
    if !figures.planes.is_empty() {
        let columns: Vec<&str> = PLANES.into_iter().chain([FACTOR]).collect();
        let row = |plane: &super::figures::PlaneFigures| {
            [vec![Cell::Name(plane.name.clone())], through(&plane.through)].concat()
        };
        let rows: Vec<Vec<Cell>> = figures.planes.iter().map(row).collect();
        write("planes.csv".to_owned(), &|path| table::write(path, &columns, &rows))?;
    }
    Ok(written)
}

/// The rows of `beams.csv`.
fn beams(figures: &Figures) -> Vec<Vec<Cell>> {
    let rows = figures.beams.iter().flat_map(|beam| {
        let row = |n: usize| {
            let section = match n {
                0 => {
                    let place = [Cell::Name(AXES[beam.along].to_owned()), Cell::Number(beam.at)];
                    place.into_iter().chain(through(&beam.section)).collect()
                }
                _ => vec![Cell::Empty; 6],
            };
            let names = [beam.name.clone(), PARTS[n].to_owned()].map(Cell::Name).to_vec();
            [names, lying(&beam.parts[n]), section].concat()
        };
        (0..PARTS.len()).map(row).collect::<Vec<_>>()
    });
    rows.collect()
}

/// The cells of a part, from the number of fibres to the axis.
fn lying(part: &Lying) -> Vec<Cell> {
    let fibres = &part.held.fibres;
    let known = |numbers: Option<Vec<f64>>, count: usize| {
        numbers.unwrap_or_else(|| vec![f64::NAN; count]).into_iter().map(Cell::Number)
    };
    let volumes = [fibres.length, fibres.volume, part.held.fluid, part.held.share()].map(Cell::Number);
    std::iter::once(Cell::Count(fibres.parts))
        .chain(volumes)
        .chain(known(part.components().map(|all| all.to_vec()), 6))
        .chain(known(part.principal.map(|found| found.values.to_vec()), 3))
        .chain(known(part.axis().map(|axis| axis.to_array().to_vec()), 3))
        .collect()
}

/// The cells of a section: number of fibres, for each m2, area, orientation factor.
fn through(through: &Through) -> Vec<Cell> {
    let numbers = [through.density(), through.crossing.section, through.factor].map(Cell::Number);
    std::iter::once(Cell::Count(through.crossing.count)).chain(numbers).collect()
}
