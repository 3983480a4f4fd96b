//! Pictures of a snapshot: the surface from above, and quantities in a vertical cut.
//!
//! All show the whole body, with its mirror images, in a frame that stays the same throughout a run.

use std::ops::Range;

use rayon::prelude::*;
use tremie_case::Case;
use tremie_numerics::DMat3;
use tremie_output::Error;
use tremie_output::picture::{self, Circle, Cut, Ellipse, EllipseMap, Grid, HeightMap, Palette, Picture};
use tremie_suspension::Inclusions;
use tremie_suspension::orientation::{Block, principal};

use crate::filling::Maps;
use crate::folder::RunFolder;
use crate::gauges::{Half, Region, held, regions};
use crate::plan::{Axis, Plan};
use crate::{Cells, Fluid, Snapshot};

/// What is shown in a vertical cut of every run, and the names of its pictures.
const CUTS: [(Quantity, &str); 3] =
    [(Quantity::Speed, "cut"), (Quantity::Pressure, "pressure"), (Quantity::ShearRate, "shear_rate")];

/// What a picture of a moment shows.
#[derive(Debug, Clone, Copy)]
enum Subject {
    /// The surface from above.
    Above,
    /// How fibres lie in a half of the fluid.
    Lying(Half),
    /// A quantity in the vertical cut.
    Cut(Quantity),
}

/// What pictures of a case show, and the names of their files.
fn subjects(cells: &Cells, case: &Case) -> Vec<(Subject, &'static str)> {
    let mut subjects = vec![
        (Subject::Above, "above"),
        (Subject::Lying(Half::Lower), "orientation_lower"),
        (Subject::Lying(Half::Upper), "orientation_upper"),
    ];
    if case.fibre_region().is_some() {
        subjects.push((Subject::Cut(Quantity::ApparentViscosity), "viscosity"));
    }
    if !cells.batches.is_empty() {
        subjects.push((Subject::Cut(Quantity::Batch), "batches"));
    }
    subjects.extend(CUTS.map(|(quantity, name)| (Subject::Cut(quantity), name)));
    subjects
}

/// Draws the pictures of one moment, at `time` in s.
pub(crate) fn draw(
    view: &Snapshot,
    time: f64,
    case: &Case,
    folder: &RunFolder,
    number: u64,
) -> Result<(), Error> {
    let Fluid::Cells(cells) = &view.fluid;
    let title = format!("{}, t = {time:.2} s", case.title);
    subjects(cells, case).par_iter().try_for_each(|(subject, name)| {
        let picture = match *subject {
            Subject::Above => Some(above(cells, &view.inclusions, case, &title)?),
            Subject::Lying(half) => lying(cells, &view.inclusions, case, half, &title)?,
            Subject::Cut(quantity) => Some(cut(cells, case, quantity, Frame::Domain, &title)?),
        };
        let path = folder.path().join(format!("{name}_{number:06}.png"));
        picture.map_or(Ok(()), |picture| picture.write(&path))
    })
}

/// Names of the pictures of how the form filled, each in the vertical cut and at half the height of the fluid.
pub(crate) const FILLING_PICTURES: [&str; 6] = [
    "filling_time_cut.png",
    "filling_time_level.png",
    "filling_fronts_cut.png",
    "filling_fronts_level.png",
    "filling_dead_cut.png",
    "filling_dead_level.png",
];

/// Draws how the form has filled.
pub(crate) fn draw_filling(cells: &Cells, maps: &Maps, case: &Case, folder: &RunFolder) -> Result<(), Error> {
    let flags = |label, classes: [&'static str; 2], flags: &[u8]| {
        let flags = flags.to_vec();
        let value = Box::new(move |n: usize| f64::from(flags[n]));
        Shown { label, value, palette: Palette::Viridis, range: None, classes: classes.to_vec() }
    };
    let shown = |what: usize| match what {
        0 => Shown {
            label: "time of filling [s]",
            value: Box::new(|n| f64::from(maps.time[n])),
            palette: Palette::Viridis,
            range: None,
            classes: Vec::new(),
        },
        1 => flags("fronts", ["one front", "fronts met"], &maps.met),
        _ => flags("dead zones", ["sheared since filled", "dead zone"], &maps.dead),
    };
    let (along, plane) = vertical(cells, case);
    let wet = (0..cells.fill.len()).filter(|n| cells.fill[*n] >= 0.5);
    let layers = wet.map(|n| n / (cells.count[0] * cells.count[1]));
    let (low, high) = layers.fold((usize::MAX, 0), |(low, high), k| (low.min(k), high.max(k + 1)));
    if high == 0 {
        return Ok(());
    }
    let level = cells.origin.z + 0.5 * (low + high) as f64 * cells.size;
    for (n, name) in FILLING_PICTURES.into_iter().enumerate() {
        let (axes, plane) = if n % 2 == 0 { ([along, 2], plane) } else { ([0, 1], level) };
        section(cells, axes, plane, &shown(n / 2), Frame::Domain, &case.title)?
            .write(&folder.path().join(name))?;
    }
    Ok(())
}

/// Apparent viscosity in plastic viscosities from which on fluid is shown as stiff.
const STIFF: f64 = 5.0;

/// What a cut shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Speed in m/s.
    Speed,
    /// Pressure above that of the air in Pa.
    Pressure,
    /// Shear rate in 1/s.
    ShearRate,
    /// Apparent viscosity, stress over shear rate, in Pa s, from the plastic viscosity to five times as much and more.
    ApparentViscosity,
    /// Where the fluid shears, and where it is as a solid.
    Yielded,
    /// Which batch there is most of.
    Batch,
}

impl Quantity {
    /// Its name with its unit.
    fn label(self) -> &'static str {
        match self {
            Self::Speed => "speed [m/s]",
            Self::Pressure => "pressure [Pa]",
            Self::ShearRate => "shear rate [1/s]",
            Self::ApparentViscosity => "apparent viscosity [Pa s]; more is not told apart",
            Self::Yielded => "yielded",
            Self::Batch => "batch",
        }
    }

    /// As a section shows it.
    fn shown<'a>(self, cells: &'a Cells, case: &Case) -> Shown<'a> {
        let plastic = case.material.curve.plastic_viscosity();
        let batches = cells.batches.iter().map(|(name, _)| name.as_str());
        Shown {
            label: self.label(),
            value: Box::new(move |n| self.of(cells, n)),
            palette: if self == Self::Pressure { Palette::Magma } else { Palette::Viridis },
            range: (self == Self::ApparentViscosity).then_some([plastic, STIFF * plastic]),
            classes: match self {
                Self::Yielded => vec!["not yielded", "flows"],
                Self::Batch => std::iter::once("no batch").chain(batches).collect(),
                _ => Vec::new(),
            },
        }
    }

    fn of(self, cells: &Cells, n: usize) -> f64 {
        match self {
            Self::Speed => cells.velocity[n].length(),
            Self::Pressure => cells.pressure[n],
            Self::ShearRate => cells.shear_rate[n],
            Self::ApparentViscosity if cells.shear_rate[n] > 0.0 => cells.stress[n] / cells.shear_rate[n],
            Self::ApparentViscosity => f64::INFINITY,
            Self::Yielded => f64::from(u8::from(cells.shear_rate[n] > 0.0)),
            Self::Batch => cells.batch(n) as f64,
        }
    }
}

/// What a cut has room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    /// All of the domain, so that pictures of different times can be compared.
    Domain,
    /// The fluid, with a margin.
    Fluid,
}

/// The surface from above, with the fibres in it.
///
/// # Errors
/// If there are no cells.
pub fn above(cells: &Cells, bodies: &Inclusions, case: &Case, title: &str) -> Result<Picture, Error> {
    let lines: Vec<[[f64; 2]; 2]> =
        (0..bodies.len()).filter_map(|n| bodies.ends(n)).map(|ends| ends.map(|end| [end.x, end.y])).collect();
    let (grid, height) = outline(cells);
    let circles: Vec<Circle> = case
        .gauges
        .spread
        .iter()
        .map(|gauge| Circle { centre: gauge.centre.to_array(), radius: 0.25, label: "500 mm" })
        .collect();
    HeightMap {
        title,
        grid,
        height: &height,
        range: None,
        palette: Palette::Viridis,
        circles: &circles,
        lines: &lines,
    }
    .draw()
}

/// The columns of the whole body, and their heights in m.
fn outline(cells: &Cells) -> (Grid, Vec<f32>) {
    let plan = Plan::height(cells);
    let (count, height) = plan.whole();
    let (_, cover) = Plan::cover(cells).whole();
    // The edge is where the spread gauge sees it.
    let height =
        height.iter().zip(&cover).map(|(h, cover)| if *cover < 0.5 { 0.0 } else { *h as f32 }).collect();
    let origin = plan.extent()[0].to_array();
    (Grid { origin, spacing: [plan.size(); 2], cells: count, mirror: [false; 2] }, height)
}

/// Share of the fluid of the fullest square that a square must have to be shown.
const LEAST_FLUID: f64 = 0.05;

/// How fibres lie in a half of the fluid, seen from above, as ellipses; none where the case has no fibres.
///
/// The half-axes of each ellipsoid are the principal values of the orientation tensor along its principal axes, 1 being half the edge of its
/// square: aligned fibres are a line across the square, fibres in all directions alike a disc of a third of it.
///
/// # Errors
/// If there are no cells.
pub fn lying(
    cells: &Cells,
    bodies: &Inclusions,
    case: &Case,
    half: Half,
    title: &str,
) -> Result<Option<Picture>, Error> {
    let Some(size) = case.fibre_region() else { return Ok(None) };
    let (grid, height) = outline(cells);
    let ellipse = |region: &Region| {
        let centre = [region.centre.x, region.centre.y];
        let half_axes = shadow(&region.tensor()?).map(|axis| axis.map(|x| 0.5 * region.size * x));
        Some(Ellipse { centre, half_axes, value: 100.0 * region.share() })
    };
    let regions = regions(cells, bodies, size);
    // Squares that the fluid has hardly reached hold ends of fibres, whose shares would outshine all others.
    let most = regions.iter().map(|region| region.fluid).fold(0.0, f64::max);
    let shown = regions.iter().filter(|region| region.half == half && region.fluid >= LEAST_FLUID * most);
    let ellipses: Vec<Ellipse> = shown.filter_map(ellipse).collect();
    let which = if half == Half::Lower { "lower half" } else { "upper half" };
    EllipseMap {
        title: &format!("{title}, {which}"),
        grid,
        height: &height,
        ellipses: &ellipses,
        quantity: "share of fibres [% by volume]",
        palette: Palette::Viridis,
        classes: None,
        frames: &[],
    }
    .draw()
    .map(Some)
}

/// Beams that are cut out of a cast, seen from above, and how fibres lie in the lower and the upper half of each by height, in squares of about its
/// width: as ellipses like those of [`lying`], of the clipped fibres.
///
/// # Errors
/// If there are no cells.
pub fn beams(
    cells: &Cells,
    bodies: &Inclusions,
    title: &str,
    beams: &[(&str, Block)],
) -> Result<Picture, Error> {
    let (grid, height) = outline(cells);
    let mut ellipses = Vec::new();
    for (_, beam) in beams {
        for square in squares(beam) {
            let middle = 0.5 * (beam.low.z + beam.high.z);
            let lower = Block { high: square.high.with_z(middle), ..square };
            let upper = Block { low: square.low.with_z(middle), ..square };
            let size = square.high - square.low;
            let centre = 0.5 * (square.low + square.high);
            for (class, half) in [lower, upper].iter().enumerate() {
                let Some(tensor) = held(cells, bodies, half).tensor() else { continue };
                ellipses.push(Ellipse {
                    centre: [centre.x, centre.y],
                    half_axes: shadow(&tensor).map(|axis| axis.map(|x| 0.5 * size.x.min(size.y) * x)),
                    value: (class + 1) as f64,
                });
            }
        }
    }
    let frames: Vec<picture::Frame> = beams
        .iter()
        .map(|(label, block)| picture::Frame {
            low: [block.low.x, block.low.y],
            high: [block.high.x, block.high.y],
            label,
        })
        .collect();
    EllipseMap {
        title,
        grid,
        height: &height,
        ellipses: &ellipses,
        quantity: "",
        palette: Palette::Viridis,
        classes: Some(&["concrete", "lower half", "upper half"]),
        frames: &frames,
    }
    .draw()
}

/// Equal parts of a block along the longer of its horizontal edges, about as long as the other.
fn squares(block: &Block) -> impl Iterator<Item = Block> {
    // More would not be told apart.
    const MOST: f64 = 100.0;
    let size = block.high - block.low;
    let (along, across) = if size.y > size.x { (1, 0) } else { (0, 1) };
    let number = (size[along] / size[across]).round().clamp(1.0, MOST);
    let (block, edge) = (*block, size[along] / number);
    (0..number as usize).map(move |n| {
        let mut square = block;
        square.low[along] = block.low[along] + n as f64 * edge;
        square.high[along] = block.low[along] + (n + 1) as f64 * edge;
        square
    })
}

/// Half-axes of an ellipsoid seen from above, whose half-axes are the principal values and axes of a tensor `a`: its shadow is
/// x . (a^2)^-1 x <= 1 with the part of a^2 in the plane.
fn shadow(a: &DMat3) -> [[f64; 2]; 2] {
    let square = *a * *a;
    let flat = DMat3::from_cols_array(&[
        square.x_axis.x,
        square.x_axis.y,
        0.0,
        square.x_axis.y,
        square.y_axis.y,
        0.0,
        0.0,
        0.0,
        -1.0,
    ]);
    let found = principal(&flat);
    [0, 1].map(|n| {
        let axis = found.axes[n] * found.values[n].max(0.0).sqrt();
        [axis.x, axis.y]
    })
}

/// A quantity in a vertical cut along the longer side of the body, through the spread axis, or the first inlet, or else the middle.
///
/// # Errors
/// If there are no cells.
pub fn cut(
    cells: &Cells,
    case: &Case,
    quantity: Quantity,
    frame: Frame,
    title: &str,
) -> Result<Picture, Error> {
    let (along, plane) = vertical(cells, case);
    section(cells, [along, 2], plane, &quantity.shown(cells, case), frame, title)
}

/// The horizontal axis of the vertical cut, and where the cut lies across it.
fn vertical(cells: &Cells, case: &Case) -> (usize, f64) {
    let axes = [0, 1, 2].map(|a| Axis::new(cells, a));
    let (along, across) = if axes[1].extent().len() > axes[0].extent().len() { (1, 0) } else { (0, 1) };
    let plane = match &case.gauges.spread {
        Some(gauge) => gauge.centre[across],
        None => {
            let [low, high] = axes[across].span(axes[across].extent());
            let inlet = case.inlets.first().map(|inlet| inlet.face.centre[across].clamp(low, high));
            inlet.unwrap_or(0.5 * (low + high))
        }
    };
    (along, plane)
}

/// What a section shows.
struct Shown<'a> {
    /// Its name with its unit.
    label: &'a str,
    /// Its value in each cell.
    value: Box<dyn Fn(usize) -> f64 + 'a>,
    palette: Palette,
    /// Values at the ends of the colours, if not its extremes.
    range: Option<[f64; 2]>,
    /// Names of classes, if it has any.
    classes: Vec<&'a str>,
}

/// What is shown in the plane of two axes, across which it lies at the coordinate `plane`.
fn section(
    cells: &Cells,
    [along, up]: [usize; 2],
    plane: f64,
    shown: &Shown,
    frame: Frame,
    title: &str,
) -> Result<Picture, Error> {
    let axes = [0, 1, 2].map(|a| Axis::new(cells, a));
    let across = 3 - along - up;
    let depth = axes[across].cell(axes[across].place(plane));
    let cell = |i: isize, k: isize| {
        let mut at = [0; 3];
        (at[along], at[across], at[up]) = (axes[along].cell(i)?, depth?, axes[up].cell(k)?);
        Some(cells.index(at[0], at[1], at[2]))
    };
    let (mut is, mut ks) = (axes[along].extent(), axes[up].extent());
    if frame == Frame::Fluid {
        let wet = |i: isize, k: isize| cell(i, k).is_some_and(|n| cells.fill[n] > 0.0);
        (is, ks) = (
            around(is.clone(), |i| ks.clone().any(|k| wet(i, k))),
            around(ks.clone(), |k| is.clone().any(|i| wet(i, k))),
        );
    }
    let (mut values, mut fill) = (Vec::new(), Vec::new());
    for k in ks.clone() {
        for i in is.clone() {
            let cell = cell(i, k);
            let value = cell.map_or(0.0, |n| (shown.value)(n));
            values.push(shown.range.map_or(value, |[low, high]| value.clamp(low, high)) as f32);
            fill.push(match cell {
                Some(n) if cells.solid[n] != 0 => f32::NAN,
                Some(n) => cells.fill[n] as f32,
                None => 0.0,
            });
        }
    }
    let names = ["x", "y", "z"];
    Cut {
        title: &format!("{title}, {} = {:.0} mm", names[across], 1e3 * plane),
        grid: Grid {
            origin: [axes[along].coordinate(is.start), axes[up].coordinate(ks.start)],
            spacing: [cells.size; 2],
            cells: [is.len(), ks.len()],
            mirror: [false; 2],
        },
        axes: [names[along], names[up]],
        quantity: shown.label,
        values: &values,
        fill: Some(&fill),
        range: shown.range,
        palette: shown.palette,
        classes: (!shown.classes.is_empty()).then_some(&shown.classes),
        floor: up == 2 && ks.start == axes[up].extent().start,
    }
    .draw()
}

/// The places of `all` from the first to the last for which something holds, with a margin of a sixth of them.
fn around(all: Range<isize>, holds: impl Fn(isize) -> bool) -> Range<isize> {
    match (all.clone().find(|i| holds(*i)), all.clone().rfind(|i| holds(*i))) {
        (Some(first), Some(last)) => {
            let margin = (last - first) / 6 + 1;
            (first - margin).max(all.start)..(last + 1 + margin).min(all.end)
        }
        _ => all,
    }
}

#[cfg(test)]
mod tests {
    use tremie_numerics::DVec3;

    use super::*;

    #[test]
    fn ellipsoids_are_seen_from_above() {
        let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-12;
        let [long, short] = shadow(&DMat3::from_diagonal([0.2, 0.7, 0.1].into()));
        assert!(close(long.map(f64::abs), [0.0, 0.7]) && close(short.map(f64::abs), [0.2, 0.0]));
        // Aligned at 45 degrees in the plane of y and z: half of the square of its length is seen along y.
        let up = DMat3::from_cols_array(&[0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.5, 0.5]);
        let [long, short] = shadow(&up);
        assert!(close(long.map(f64::abs), [0.0, 0.5_f64.sqrt()]) && close(short, [0.0, 0.0]));
    }

    #[test]
    fn beams_are_parted_into_squares() {
        let block = Block { low: DVec3::new(0.1, 0.2, 0.0), high: DVec3::new(0.25, 0.8, 0.15) };
        let parts: Vec<Block> = squares(&block).collect();
        assert_eq!(parts.len(), 4);
        assert_eq!((parts[0].low, parts[3].high.x), (block.low, 0.25));
        assert!(parts.windows(2).all(|pair| pair[0].high.y == pair[1].low.y));
        assert!((parts[3].high.y - 0.8).abs() < 1e-12 && (parts[1].low.y - 0.35).abs() < 1e-12);
        let flat = Block { high: DVec3::new(100.0, 0.201, 0.15), ..block };
        assert_eq!(squares(&flat).count(), 100);
    }

    #[test]
    fn a_frame_around_the_fluid_stays_within_the_domain() {
        assert_eq!(around(-20..20, |i| (-6..6).contains(&i)), -8..8);
        assert_eq!(around(0..20, |i| i < 12), 0..14);
        assert_eq!(around(0..20, |_| false), 0..20);
    }
}
