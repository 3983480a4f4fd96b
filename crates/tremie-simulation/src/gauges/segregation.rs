//! How bodies have segregated: their share of the volume by height.

use tremie_numerics::DVec3;
use tremie_suspension::Inclusions;
use tremie_suspension::orientation::volumes_by_height;

use super::lying::Column;
use crate::Cells;

/// Layers of the same height from the lowest fluid to the highest.
const LAYERS: usize = 10;

/// What swims in a layer of the fluid.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// From where to where it reaches, in m.
    pub span: [f64; 2],
    /// Volume of the fluid in it, in m3, with what swims in it.
    pub fluid: f64,
    /// Share of that which bodies of each kind take.
    pub shares: Vec<f64>,
}

/// All of the fluid, and then its layers from the lowest.
pub fn layers(cells: &Cells, bodies: &Inclusions) -> Vec<Layer> {
    let column = Column::of_all(cells);
    let Some([low, high]) = column.span() else { return Vec::new() };
    let heights: Vec<f64> = (0..=LAYERS).map(|n| low + (high - low) * n as f64 / LAYERS as f64).collect();
    let layer = |span: [f64; 2], fluid: f64, bodies: Vec<f64>| Layer {
        span,
        fluid,
        shares: bodies.into_iter().map(|volume| if fluid > 0.0 { volume / fluid } else { 0.0 }).collect(),
    };
    let kinds = 0..bodies.kinds.len() as u16;
    let volumes: Vec<Vec<f64>> =
        kinds.map(|kind| volumes_by_height(bodies, DVec3::Z, &heights, |other| other == kind)).collect();
    let mut all = vec![0.0; bodies.kinds.len()];
    for n in 0..bodies.len() {
        all[usize::from(bodies.kind[n])] += bodies.form(n).volume();
    }
    let whole = layer([low, high], column.volume(), all);
    let between = heights.windows(2).enumerate().map(|(n, span)| {
        let fluid = column.below(span[1]) - column.below(span[0]);
        layer([span[0], span[1]], fluid, volumes.iter().map(|volumes| volumes[n]).collect())
    });
    std::iter::once(whole).chain(between).collect()
}

#[cfg(test)]
mod tests {
    use tremie_numerics::DQuat;
    use tremie_suspension::{Form, Kind};

    use super::*;

    #[test]
    fn shares_are_those_of_the_layers() {
        let fill = (0..1000).map(|n| if n / 100 < 5 { 1.0 } else { 0.0 }).collect();
        let cells = Cells { size: 0.01, count: [10, 10, 10], fill, ..Cells::default() };
        let kind = |diameter| {
            let form = Form::Sphere { diameter };
            Kind { name: "s".into(), form, density: 2600.0 }
        };
        let mut bodies = Inclusions { kinds: vec![kind(4e-3), kind(2e-3)], ..Inclusions::default() };
        bodies.add(0, 0, DVec3::new(0.05, 0.05, 0.0025), DQuat::IDENTITY);
        bodies.add(1, 0, DVec3::new(0.05, 0.05, 0.01), DQuat::IDENTITY);
        let layers = layers(&cells, &bodies);
        assert_eq!(layers.len(), 1 + LAYERS);
        let volume = bodies.form(0).volume();
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        assert!(close(layers[0].shares[0], volume / 5e-4) && close(layers[0].fluid, 5e-4));
        assert!(close(layers[1].shares[0], volume / 5e-5) && layers[2].shares[0] == 0.0);
        // The second lies half in the second layer, half in the third.
        assert!(close(layers[2].shares[1], 0.5 * bodies.form(1).volume() / 5e-5));
        assert!(close(layers[3].shares[1], layers[2].shares[1]));
    }
}
