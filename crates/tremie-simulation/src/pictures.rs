//! Pictures of a snapshot: the surface from above, and the speed in a vertical cut.
//!
//! Both show the whole body, with its mirror images, in a frame that stays the same throughout a run.

use tremie_case::Case;
use tremie_output::Error;
use tremie_output::picture::{Circle, Cut, Grid, HeightMap, Palette, Picture};

use crate::Cells;
use crate::folder::RunFolder;
use crate::plan::{Axis, Plan};

/// Draws the pictures of one moment, at `time` in s.
pub(crate) fn draw(
    cells: &Cells,
    time: f64,
    case: &Case,
    folder: &RunFolder,
    number: u64,
) -> Result<(), Error> {
    let title = format!("{}, t = {time:.2} s", case.title);
    draw_above(cells, case, &title)?.write(&folder.path().join(format!("above_{number:06}.png")))?;
    draw_cut(cells, case, &title)?.write(&folder.path().join(format!("cut_{number:06}.png")))
}

fn draw_above(cells: &Cells, case: &Case, title: &str) -> Result<Picture, Error> {
    let plan = Plan::height(cells);
    let (count, height) = plan.whole();
    let (_, cover) = Plan::cover(cells).whole();
    // The edge is where the spread gauge sees it.
    let height: Vec<f32> =
        height.iter().zip(&cover).map(|(h, cover)| if *cover < 0.5 { 0.0 } else { *h as f32 }).collect();
    let circles: Vec<Circle> = case
        .gauges
        .spread
        .iter()
        .map(|gauge| Circle { centre: gauge.centre.to_array(), radius: 0.25, label: "500 mm" })
        .collect();
    HeightMap {
        title,
        grid: Grid {
            origin: plan.extent()[0].to_array(),
            spacing: [plan.size(); 2],
            cells: count,
            mirror: [false; 2],
        },
        height: &height,
        range: None,
        palette: Palette::Viridis,
        circles: &circles,
    }
    .draw()
}

/// The cut goes along the longer side of the body, through the spread axis or else the middle.
fn draw_cut(cells: &Cells, case: &Case, title: &str) -> Result<Picture, Error> {
    let axes = [0, 1, 2].map(|a| Axis::new(cells, a));
    let (along, across) = if axes[1].extent().len() > axes[0].extent().len() { (1, 0) } else { (0, 1) };
    let plane = match &case.gauges.spread {
        Some(gauge) => gauge.centre[across],
        None => 0.5 * axes[across].span().iter().sum::<f64>(),
    };
    let depth = axes[across].cell(axes[across].place(plane));
    let (is, ks) = (axes[along].extent(), axes[2].extent());
    let (mut speed, mut fill) = (Vec::new(), Vec::new());
    for k in ks.clone() {
        for i in is.clone() {
            let cell = match (axes[along].cell(i), depth, axes[2].cell(k)) {
                (Some(i), Some(j), Some(k)) => {
                    Some(if along == 0 { cells.index(i, j, k) } else { cells.index(j, i, k) })
                }
                _ => None,
            };
            speed.push(cell.map_or(0.0, |n| cells.velocity[n].length() as f32));
            fill.push(match cell {
                Some(n) if cells.solid[n] != 0 => f32::NAN,
                Some(n) => cells.fill[n] as f32,
                None => 0.0,
            });
        }
    }
    let names = ["x", "y"];
    Cut {
        title: &format!("{title}, {} = {:.0} mm", names[across], 1e3 * plane),
        grid: Grid {
            origin: [axes[along].span()[0], axes[2].span()[0]],
            spacing: [cells.size; 2],
            cells: [is.len(), ks.len()],
            mirror: [false; 2],
        },
        axes: [names[along], "z"],
        quantity: "speed [m/s]",
        values: &speed,
        fill: Some(&fill),
        range: None,
        palette: Palette::Viridis,
        floor: true,
    }
    .draw()
}
