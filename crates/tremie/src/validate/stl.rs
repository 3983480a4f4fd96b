//! Solids that are drawn as facets, against the shapes that they stand for.

use std::f64::consts::TAU;
use std::fmt::Write;

use anyhow::{anyhow, bail};
use tremie_case::Case;
use tremie_geometry::{Body, Shape};

use super::benchmark::{Check, Context, shown};
use super::flow::Flow;

/// Facets around the mould.
const AROUND: usize = 96;

/// A cone lifted from a mould, which is a shape or an STL file.
pub(super) fn stl_cone(context: &Context) -> anyhow::Result<Vec<Check>> {
    let shape = context.case("case.toml")?;
    let drawn = drawn(&shape)?;
    let (shape, drawn) = rayon::join(|| slumped(shape), || slumped(drawn));
    let (shape, drawn) = (shape?, drawn?);
    Ok(vec![
        context.absolute("spread", "spread, STL mould", "m", shape.spread, drawn.spread)?,
        context.absolute("height", "height in the middle, STL mould", "m", shape.height, drawn.height)?,
        shown("time to rest, analytic mould, s", shape.time),
        shown("time to rest, STL mould, s", drawn.time),
    ])
}

/// Spread and height in m of a cone that has come to rest, and when in s.
struct Slumped {
    spread: f64,
    height: f64,
    time: f64,
}

fn slumped(case: Case) -> anyhow::Result<Slumped> {
    let readings = Flow::new(case).until_rest(|_| {})?;
    let spread = readings.spread.ok_or_else(|| anyhow!("the case has no spread gauge"))?;
    Ok(Slumped { spread: spread.mean, height: spread.height, time: readings.time })
}

/// The case with its mould from an STL file.
fn drawn(case: &Case) -> anyhow::Result<Case> {
    let [mould] = case.solids.as_slice() else { bail!("the case has not one solid") };
    let Body::Shape(shell @ Shape::ConeShell { .. }) = &mould.body else {
        bail!("the mould is no cone_shell")
    };
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("mould.stl"), ascii_stl(shell))?;
    let lines = case.text.lines().map(|line| {
        let file = "stl = { file = \"mould.stl\", unit = \"m\" }";
        if line.starts_with("cone_shell = ") { file } else { line }
    });
    let path = folder.path().join("case.toml");
    std::fs::write(&path, lines.collect::<Vec<_>>().join("\n"))?;
    let drawn = Case::read(&path)?;
    if !matches!(drawn.solids[0].body, Body::Mesh(_)) {
        bail!("the mould is no mesh");
    }
    Ok(drawn)
}

/// A conical shell as an ASCII STL file in m.
fn ascii_stl(shell: &Shape) -> String {
    let &Shape::ConeShell { base, base_radius, top_radius, height, thickness } = shell else {
        return String::new();
    };
    // Its section, with the body on the left.
    let section = [
        [base_radius, 0.0],
        [base_radius + thickness, 0.0],
        [top_radius + thickness, height],
        [top_radius, height],
    ];
    let corner = |[radius, z]: [f64; 2], n: usize| {
        let angle = TAU * (n % AROUND) as f64 / AROUND as f64;
        [base.x + radius * angle.cos(), base.y + radius * angle.sin(), base.z + z]
    };
    let mut file = "solid mould\n".to_owned();
    for side in 0..section.len() {
        let [from, to] = [section[side], section[(side + 1) % section.len()]];
        for n in 0..AROUND {
            let [a, b, c, d] = [corner(from, n), corner(from, n + 1), corner(to, n + 1), corner(to, n)];
            for facet in [[a, b, c], [a, c, d]] {
                file += "facet normal 0 0 0\nouter loop\n";
                for [x, y, z] in facet {
                    let _ = writeln!(file, "vertex {x} {y} {z}");
                }
                file += "endloop\nendfacet\n";
            }
        }
    }
    file + "endsolid mould\n"
}
