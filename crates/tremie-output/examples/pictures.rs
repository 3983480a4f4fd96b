//! Draws one picture of each kind, of made-up fields, into the folder given as the only argument.

use std::error::Error;
use std::path::PathBuf;

use tremie_output::picture::{Axis, Circle, Curve, Cut, Grid, HeightMap, Palette, Plot, Reference, Style};

/// Height of a cake of self-compacting concrete at a distance from its axis (m): radius 0.3 m.
fn cake(r: f64) -> f64 {
    0.045 * (1.0 - r / 0.3).max(0.0).sqrt()
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: pictures FOLDER")?);
    std::fs::create_dir_all(&folder)?;

    let quarter = Grid { origin: [0.0; 2], spacing: [0.005; 2], cells: [72, 72], mirror: [true; 2] };
    let centre = |n: usize| 0.005 * (n as f64 + 0.5);
    let height: Vec<f32> = (0..72 * 72).map(|n| cake(centre(n % 72).hypot(centre(n / 72))) as f32).collect();
    let circle = Circle { centre: [0.0; 2], radius: 0.25, label: "500 mm" };
    let map = HeightMap {
        title: "Slump flow, t = 12.4 s: spread 600 mm",
        grid: quarter,
        height: &height,
        range: None,
        palette: Palette::Viridis,
        circles: &[circle],
        lines: &[],
    };
    map.draw()?.write(&folder.join("height.png"))?;

    // Flow down the mould of the slump test and outwards, by formula only.
    let grid = Grid { origin: [0.0; 2], spacing: [0.005; 2], cells: [80, 24], mirror: [true, false] };
    let (mut speed, mut fill) = (Vec::new(), Vec::new());
    for n in 0..80 * 24 {
        let (r, z) = (centre(n % 80), centre(n / 80));
        let surface = 2.0 * cake(r);
        fill.push(((surface - z) / 0.005 + 0.5).clamp(0.0, 1.0) as f32);
        speed.push((400.0 * r * (1.0 - (1.0 - z / surface.max(z)).powi(2))) as f32);
    }
    let cut = Cut {
        title: "Slump flow, t = 1.2 s: cut at y = 0",
        grid,
        axes: ["x", "z"],
        quantity: "speed [mm/s]",
        values: &speed,
        fill: Some(&fill),
        range: None,
        palette: Palette::Magma,
        classes: None,
        floor: true,
    };
    cut.draw()?.write(&folder.join("cut.png"))?;

    // A column of fluid at rest beside a gate.
    let grid = Grid { origin: [0.0; 2], spacing: [0.01; 2], cells: [20, 60], mirror: [false; 2] };
    let (mut pressure, mut fill) = (Vec::new(), Vec::new());
    for n in 0..20 * 60 {
        let (i, j) = (n % 20, n / 20);
        pressure.push((2400.0 * 9.81e-3 * (0.5 - 0.01 * (j as f64 + 0.5))) as f32);
        fill.push(if i >= 17 && j >= 10 { f32::NAN } else { f32::from(u8::from(j < 50 && i < 17)) });
    }
    let column = Cut {
        title: "Column",
        quantity: "pressure [kPa]",
        values: &pressure,
        fill: Some(&fill),
        grid,
        palette: Palette::Cividis,
        ..cut
    };
    column.draw()?.write(&folder.join("column.png"))?;

    let spread = |tau: f64| -> Vec<[f64; 2]> {
        (0..=400)
            .map(|n| 0.05 * f64::from(n))
            .map(|t| [t, 200.0 + 420.0 * (1.0 - (-t / tau).exp())])
            .collect()
    };
    let (fast, slow) = (spread(1.3), spread(4.0));
    let measured: Vec<[f64; 2]> =
        slow.iter().step_by(25).map(|[t, s]| [*t, s + 12.0 * (5.0 * t).sin()]).collect();
    let plot = Plot {
        title: "Spread over time",
        x: Axis::linear("time [s]"),
        y: Axis::linear("spread [mm]"),
        curves: vec![
            Curve { label: "30 Pa s", points: &fast, style: Style::Line },
            Curve { label: "100 Pa s", points: &slow, style: Style::Dashed },
            Curve { label: "measured", points: &measured, style: Style::Marks },
        ],
        horizontals: vec![Reference { at: 500.0, label: "500 mm" }],
        verticals: vec![Reference { at: 1.63, label: "T500 = 1.6 s" }],
    };
    plot.draw().write(&folder.join("plot.png"))?;

    let papanastasiou: Vec<[f64; 2]> = (-40..=20)
        .map(|n| 10f64.powf(0.1 * f64::from(n)))
        .map(|rate| [rate, 30.0 * rate + 50.0 * (1.0 - (-1e3 * rate).exp())])
        .collect();
    let bingham: Vec<[f64; 2]> = papanastasiou.iter().map(|[rate, _]| [*rate, 30.0 * rate + 50.0]).collect();
    let flow_curve = Plot {
        title: "Flow curve",
        x: Axis::logarithmic("shear rate [1/s]"),
        y: Axis::logarithmic("shear stress [Pa]"),
        curves: vec![
            Curve { label: "Bingham", points: &bingham, style: Style::Dashed },
            Curve { label: "regularised after Papanastasiou", points: &papanastasiou, style: Style::Line },
        ],
        horizontals: Vec::new(),
        verticals: Vec::new(),
    };
    flow_curve.draw().write(&folder.join("log.png"))?;
    Ok(())
}
