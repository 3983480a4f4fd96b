//! What benchmarks show as curves: a picture, and a table of the same, in the folder that results go to.

use anyhow::Context as _;
use tremie_output::picture::{Axis, Curve, Plot, Style};

use super::benchmark::Context;

/// Curves over common axes.
pub(super) struct Figure<'a> {
    /// What the files are called, after the benchmark.
    pub(super) name: &'a str,
    /// Stands above the picture.
    pub(super) title: &'a str,
    pub(super) x: Axis<'a>,
    pub(super) y: Axis<'a>,
    /// Names, styles and points.
    pub(super) curves: Vec<(String, Style, Vec<[f64; 2]>)>,
}

impl Figure<'_> {
    fn table(&self) -> String {
        let mut lines = vec![format!("curve,\"{}\",\"{}\"", self.x.label, self.y.label)];
        for (label, _, points) in &self.curves {
            lines.extend(points.iter().map(|[x, y]| format!("\"{label}\",{x},{y}")));
        }
        lines.join("\n") + "\n"
    }
}

impl Context<'_> {
    /// Writes a figure, if results are written at all.
    pub(super) fn show(&self, figure: &Figure) -> anyhow::Result<()> {
        let Some(folder) = self.out() else { return Ok(()) };
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let path = |end: &str| folder.join(format!("{}-{}.{end}", self.id(), figure.name));
        std::fs::write(path("csv"), figure.table()).with_context(|| path("csv").display().to_string())?;
        let curves = figure.curves.iter();
        let plot = Plot {
            title: figure.title,
            x: figure.x,
            y: figure.y,
            curves: curves.map(|(label, style, points)| Curve { label, points, style: *style }).collect(),
            horizontals: Vec::new(),
            verticals: Vec::new(),
        };
        Ok(plot.draw().write(&path("png"))?)
    }
}
