//! A thin layer of a Bingham fluid that spreads over a plate under its own weight: the theory of lubrication.
//!
//! Where a layer of height h is thin against its width, the pressure is hydrostatic and the shear stress falls from
//! `rho g h |h'|` at the plate to nothing at the surface. It flows below `Y = h - tau0/(rho g |h'|)` and rides on that as a plug above
//! (Liu and Mei, Journal of Fluid Mechanics 207, 1989; around an axis Balmforth, Craster, Rust and Sassi, Journal of
//! Non-Newtonian Fluid Mechanics 139, 2006), so that
//!
//! ```text
//!     q = -rho g h' Y^2 (3 h - Y) / (6 mu),    h_t + (r q)_r / r = 0
//! ```
//!
//! with q = 0 where Y <= 0. It comes to rest at `h h' = -tau0/(rho g)`, the shape of the spreading formula. What it was at first is soon
//! forgotten. It knows no inertia and no normal stress; it tells here how much of its way a layer has behind it at some time,
//! apart from any of our solvers.

/// Gravity in m/s2, as everywhere in the references.
const GRAVITY: f64 = 9.81;

/// Width of a ring in m.
const RING: f64 = 2e-3;

/// Share of the diffusive limit that a step takes.
const SHARE: f64 = 0.2;

/// Share of the height in the middle from which on the shape tells where the edge is.
const TOE: f64 = 0.2;

/// A layer around an axis.
pub(super) struct ThinLayer {
    /// Weight of a unit of volume in N/m3.
    weight: f64,
    yield_stress: f64,
    plastic_viscosity: f64,
    /// Height in m of each ring.
    height: Vec<f64>,
    time: f64,
}

impl ThinLayer {
    /// A cylinder of radius `radius` in m and volume `volume` in m3 that is let go, with room for twice its spread at rest; Pa, Pa s
    /// and kg/m3.
    pub(super) fn new(
        yield_stress: f64,
        plastic_viscosity: f64,
        density: f64,
        radius: f64,
        volume: f64,
    ) -> Self {
        let weight = density * GRAVITY;
        let end = end_radius(yield_stress, weight, volume);
        let filled = (radius / RING).round();
        let height = volume / (std::f64::consts::PI * (filled * RING).powi(2));
        let rings = (2.0 * end / RING) as usize;
        let height = (0..rings).map(|i| if (i as f64) < filled { height } else { 0.0 }).collect();
        Self { weight, yield_stress, plastic_viscosity, height, time: 0.0 }
    }

    /// Spreads until a time in s.
    pub(super) fn until(&mut self, end: f64) {
        let mut flux = vec![0.0; self.height.len() + 1];
        while self.time < end {
            let highest = self.height.iter().fold(0.0, |a: f64, b| a.max(*b));
            let diffusivity = self.weight * highest.powi(3) / (3.0 * self.plastic_viscosity);
            let step = (SHARE * RING * RING / diffusivity).min(end - self.time);
            for (i, pair) in self.height.windows(2).enumerate() {
                flux[i + 1] = (i + 1) as f64 * RING * self.flux(pair[0], pair[1]);
            }
            for (i, height) in self.height.iter_mut().enumerate() {
                *height += step * (flux[i] - flux[i + 1]) / (RING * RING * (i as f64 + 0.5));
            }
            self.time += step;
        }
    }

    /// Flux in m2/s from one ring to the next.
    fn flux(&self, inner: f64, outer: f64) -> f64 {
        let slope = (inner - outer) / RING;
        let height = if slope > 0.0 { inner } else { outer };
        let pull = self.weight * slope.abs();
        let yielded = if pull > 0.0 { (height - self.yield_stress / pull).max(0.0) } else { 0.0 };
        self.weight * slope * yielded * yielded * (3.0 * height - yielded) / (6.0 * self.plastic_viscosity)
    }

    /// Radius in m: near its edge the square of the height falls linearly to nothing.
    fn radius(&self) -> f64 {
        let toe = TOE * self.height[0];
        let last = self.height.iter().rposition(|h| *h > toe).unwrap_or(1).max(1);
        let (a, b) = (self.height[last - 1].powi(2), self.height[last].powi(2));
        RING * (last as f64 + 0.5 + b / (a - b))
    }

    /// How much of its spread at rest is still missing.
    pub(super) fn missing(&self) -> f64 {
        let rings = self.height.iter().enumerate();
        let volume: f64 =
            rings.map(|(i, h)| std::f64::consts::PI * RING * RING * (2.0 * i as f64 + 1.0) * h).sum();
        1.0 - self.radius() / end_radius(self.yield_stress, self.weight, volume)
    }
}

/// Radius in m at rest (Roussel and Coussot, Journal of Rheology 49, 2005).
fn end_radius(yield_stress: f64, weight: f64, volume: f64) -> f64 {
    let pi = std::f64::consts::PI;
    (225.0 * weight * volume * volume / (128.0 * pi * pi * yield_stress)).powf(0.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(viscosity: f64, radius: f64) -> ThinLayer {
        ThinLayer::new(20.0, viscosity, 2300.0, radius, 5.5e-3)
    }

    #[test]
    fn it_comes_to_rest_at_the_spreading_formula() {
        let mut layer = layer(50.0, 0.15);
        let [early, late] = [150.0, 300.0].map(|time| {
            layer.until(time);
            layer.missing()
        });
        // What is missing falls as one over the time (Matson and Hogg 2007).
        assert!((2.0 * late - early).abs() < 0.005, "{early} {late}");
        assert!(late > 0.01);
    }

    #[test]
    fn time_is_measured_by_viscosity_and_the_start_is_forgotten() {
        let missing = |viscosity: f64, radius: f64, time: f64| {
            let mut layer = layer(viscosity, radius);
            layer.until(time);
            layer.missing()
        };
        let reference = missing(50.0, 0.15, 100.0);
        assert!((missing(25.0, 0.15, 50.0) - reference).abs() < 1e-9);
        assert!((missing(50.0, 0.2, 100.0) - reference).abs() < 0.001, "{reference}");
    }
}
