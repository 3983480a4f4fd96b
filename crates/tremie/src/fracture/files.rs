//! The files of a test.

use std::path::Path;

use tremie_fracture::fibres::Fibre;
use tremie_fracture::{Reading, Trial};
use tremie_numerics::DVec3;
use tremie_output::picture::{Axis, Curve, Picture, Plot, Reference, Style};
use tremie_output::table::{self, Cell};
use tremie_output::vtp::{Marks, Surface};
use tremie_output::{Field, Values, atomic, packing};

use super::folder::{FIBRES, Folder};
use super::job::{COLUMNS, beam_file, row};
use super::page;
use super::results::{Done, STRENGTHS, strengths};

/// The fibres of a cast, as other programs read them.
pub(super) fn listed(folder: &Folder, fibres: &[Fibre]) -> anyhow::Result<()> {
    let body = |(n, fibre): (usize, &Fibre)| packing::Body {
        id: n as u64,
        kind: "fibres".to_owned(),
        form: packing::Form::Fibre { ends: fibre.ends.map(|end| end.to_array()), diameter: fibre.diameter },
    };
    let all: Vec<packing::Body> = fibres.iter().enumerate().map(body).collect();
    Ok(atomic::write(&folder.file(FIBRES), packing::csv(&all).as_bytes())?)
}

/// What there is to tell of one beam, by its number from 1.
pub(super) fn beam(folder: &Folder, number: u64, readings: &[Reading], trial: &Trial) -> anyhow::Result<()> {
    let cells = |reading: &Reading| row(reading).map(Cell::Number).to_vec();
    table::write(&beam_file(folder, number), &COLUMNS, &readings.iter().map(cells).collect::<Vec<_>>())?;
    crack_table(&folder.file(&format!("crack_{number}.csv")), trial)?;
    crack(&folder.file(&format!("crack_{number}.vtp")), trial)?;
    fibres(&folder.file(&format!("fibres_{number}.vtp")), trial)?;
    if number == 1 {
        let picture = if trial.setup().anywhere { crack_from_the_side(trial) } else { crack_picture(trial) };
        picture.write(&folder.file("crack.png"))?;
    }
    Ok(())
}

/// Fibres across the crack.
fn crack_table(path: &Path, trial: &Trial) -> anyhow::Result<()> {
    let columns = ["y_m", "z_m", "angle_rad", "length1_m", "length2_m", "opening_m", "force_N"];
    let rows: Vec<Vec<Cell>> = trial
        .bridges()
        .iter()
        .map(|bridge| {
            let crossing = &bridge.crossing;
            let [a, b] = crossing.lengths;
            [crossing.point.y, crossing.point.z, crossing.angle, a, b, bridge.opening, bridge.force]
                .map(Cell::Number)
                .to_vec()
        })
        .collect();
    Ok(table::write(path, &columns, &rows)?)
}

/// The crack with its opening.
fn crack(path: &Path, trial: &Trial) -> anyhow::Result<()> {
    let (mut positions, mut triangles, mut openings) = (Vec::new(), Vec::new(), Vec::new());
    for (corners, opening) in trial.crack() {
        let first = positions.len() as u32;
        positions.extend(corners.iter().map(|corner| corner.to_array()));
        openings.extend(opening);
        triangles.extend((2..corners.len() as u32).map(|k| [first, first + k - 1, first + k]));
    }
    let fields = vec![Field { name: "opening [m]", components: 1, values: Values::F64(&openings) }];
    Ok(Surface { positions: &positions, triangles: &triangles, time: 0.0, fields }.write(path)?)
}

/// The fibres of the beam; with the forces of those that cross the crack.
fn fibres(path: &Path, trial: &Trial) -> anyhow::Result<()> {
    let setup = trial.setup();
    let lines: Vec<[[f64; 3]; 2]> =
        setup.fibres.iter().map(|fibre| fibre.ends.map(|end| end.to_array())).collect();
    let bridges = trial.bridges();
    let mut forces = vec![0.0_f64; setup.fibres.len()];
    for bridge in &bridges {
        forces[bridge.fibre] = forces[bridge.fibre].max(bridge.force);
    }
    let diameters: Vec<f64> = setup.fibres.iter().map(|fibre| fibre.diameter).collect();
    let fields = vec![
        Field { name: "force [N]", components: 1, values: Values::F64(&forces) },
        Field { name: "diameter [m]", components: 1, values: Values::F64(&diameters) },
    ];
    Ok(Marks { points: &[], lines: &lines, time: 0.0, fields }.write(path)?)
}

/// Fibres in the crack plane, those with more than half of the largest force apart.
fn crack_picture(trial: &Trial) -> Picture {
    let bridges = trial.bridges();
    let largest = bridges.iter().map(|bridge| bridge.force).fold(0.0, f64::max);
    let place = |p: DVec3| [1e3 * p.y, 1e3 * p.z];
    let of = |strong: bool| -> Vec<[f64; 2]> {
        let some = bridges.iter().filter(|bridge| (bridge.force > 0.5 * largest) == strong);
        some.map(|bridge| place(bridge.crossing.point)).collect()
    };
    let (weak, strong) = (of(false), of(true));
    let label = format!("more than {:.0} N", 0.5 * largest);
    let size = trial.setup().size;
    Plot {
        title: &format!("Fibres in the crack at an opening of {:.2} mm", 1e3 * trial.last().opening),
        x: Axis { range: Some([0.0, 1e3 * size.y]), ..Axis::linear("across [mm]") },
        y: Axis { range: Some([0.0, 1e3 * size.z]), ..Axis::linear("height [mm]") },
        curves: vec![
            Curve { label: &label, points: &strong, style: Style::Marks },
            Curve { label: "less", points: &weak, style: Style::Marks },
        ],
        horizontals: if trial.setup().notch > 0.0 {
            vec![Reference { at: 1e3 * trial.setup().notch, label: "notch" }]
        } else {
            Vec::new()
        },
        verticals: Vec::new(),
    }
    .draw()
}

/// The middles of the facets of the crack, seen from the side, those with more than half of the largest opening apart.
fn crack_from_the_side(trial: &Trial) -> Picture {
    let facets = trial.crack();
    let mean = |opening: &[f64]| opening.iter().sum::<f64>() / opening.len().max(1) as f64;
    let largest = facets.iter().map(|(_, opening)| mean(opening)).fold(0.0, f64::max);
    let of = |wide: bool| -> Vec<[f64; 2]> {
        let some = facets.iter().filter(|(_, opening)| (mean(opening) > 0.5 * largest) == wide);
        some.map(|(corners, _)| {
            let middle = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
            [1e3 * middle.x, 1e3 * middle.z]
        })
        .collect()
    };
    let (narrow, wide) = (of(false), of(true));
    let label = format!("open by more than {:.2} mm", 0.5e3 * largest);
    let size = trial.setup().size;
    Plot {
        title: &format!("The crack from the side at an opening of {:.2} mm", 1e3 * trial.last().opening),
        x: Axis { range: Some([0.0, 1e3 * size.x]), ..Axis::linear("along the beam [mm]") },
        y: Axis { range: Some([0.0, 1e3 * size.z]), ..Axis::linear("height [mm]") },
        curves: vec![
            Curve { label: &label, points: &wide, style: Style::Marks },
            Curve { label: "less", points: &narrow, style: Style::Marks },
        ],
        horizontals: Vec::new(),
        verticals: Vec::new(),
    }
    .draw()
}

/// What there is to tell of all beams together.
pub(super) fn all(folder: &Folder, done: &Done) -> anyhow::Result<()> {
    let columns: Vec<&str> = ["beam", "seed"]
        .into_iter()
        .chain(STRENGTHS.map(|(_, key)| key))
        .chain(["peak_opening_m", "work_J", "matrix_loss_J", "fibre_loss_J", "energy_imbalance", "fibres"])
        .collect();
    let rows = done.beams.iter().enumerate().map(|(n, beam)| {
        let found = &beam.strengths;
        let [matrix, fibres] = found.losses;
        let mut cells = vec![Cell::Count(n + 1), Cell::Count(beam.seed as usize)];
        cells.extend(strengths(beam).map(Cell::Number));
        cells.extend([found.peak_opening, found.work, matrix, fibres, found.imbalance].map(Cell::Number));
        cells.push(Cell::Count(beam.fibres));
        cells
    });
    table::write(&folder.file("results.csv"), &columns, &rows.collect::<Vec<_>>())?;
    let columns = ["beam", "from_crack_m", "fibres", "fibres_per_m2", "mean_angle_rad"];
    let rows = done.beams.iter().enumerate().flat_map(|(n, beam)| {
        beam.sections.iter().map(move |(off, count)| {
            vec![
                Cell::Count(n + 1),
                Cell::Number(*off),
                Cell::Count(count.fibres),
                Cell::Number(count.density),
                Cell::Number(count.angle),
            ]
        })
    });
    table::write(&folder.file("sections.csv"), &columns, &rows.collect::<Vec<_>>())?;
    for (name, picture) in pictures(done) {
        picture.write(&folder.file(name))?;
    }
    folder.json("summary.json", &done.json())?;
    page::write(folder, done)
}

/// A curve for each beam, if they are not too many to be told apart, in a plot.
fn curves(done: &Done, title: &str, axes: [&str; 2], of: impl Fn(&Reading) -> [f64; 2]) -> Picture {
    let points: Vec<Vec<[f64; 2]>> = done
        .beams
        .iter()
        .map(|beam| std::iter::once([0.0; 2]).chain(beam.readings.iter().map(&of)).collect())
        .collect();
    let labels: Vec<String> = (1..=points.len()).map(|n| format!("beam {n}")).collect();
    let named = (2..=8).contains(&points.len());
    let curve = |(points, label)| Curve { label: if named { label } else { "" }, points, style: Style::Line };
    let labels = labels.iter().map(String::as_str);
    Plot {
        title,
        x: Axis::linear(axes[0]),
        y: Axis::linear(axes[1]),
        curves: points.iter().map(Vec::as_slice).zip(labels).map(curve).collect(),
        horizontals: Vec::new(),
        verticals: Vec::new(),
    }
    .draw()
}

/// The plots of all beams, by the names of their files.
fn pictures(done: &Done) -> [(&'static str, Picture); 3] {
    let title = &done.case.title;
    let stress = curves(done, title, ["opening of the crack [mm]", "nominal stress [MPa]"], |reading| {
        [1e3 * reading.opening, 1e-6 * reading.stress]
    });
    let load = curves(done, title, ["deflection in the middle [mm]", "load [kN]"], |reading| {
        [1e3 * reading.middle, 1e-3 * reading.load]
    });
    let of = |value: fn(&Reading) -> f64| -> Vec<[f64; 2]> {
        done.beams[0].readings.iter().map(|reading| [1e3 * reading.opening, value(reading)]).collect()
    };
    let parts = [
        ("put in", Style::Line, of(|reading| reading.work)),
        ("used up by the matrix", Style::Line, of(|reading| reading.matrix_loss)),
        ("used up by the fibres", Style::Line, of(|reading| reading.fibre_loss)),
        ("stored and used up", Style::Dashed, of(|r| r.stored() + r.matrix_loss + r.fibre_loss)),
    ];
    let energy = Plot {
        title: "Energy of beam 1",
        x: Axis::linear("opening of the crack [mm]"),
        y: Axis::linear("energy [J]"),
        curves: parts.iter().map(|(label, style, points)| Curve { label, points, style: *style }).collect(),
        horizontals: Vec::new(),
        verticals: Vec::new(),
    };
    [("load_opening.png", stress), ("load_deflection.png", load), ("energy.png", energy.draw())]
}
