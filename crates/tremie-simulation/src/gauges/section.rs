//! Fibres through planes across an axis.
//!
//! The orientation factor is alpha = N A_f / (Phi A_c) (Svec 2013, Eq. 1.1): Phi is the share of fibres in all of the fluid, and A_c the wet area of the
//! section, between the centres of cells by linear interpolation.

use tremie_case::FibreSection;
use tremie_numerics::DVec3;
use tremie_suspension::orientation::{Crossing, Section, crossing};
use tremie_suspension::{Form, Inclusions};

use super::cut::cut_field;
use crate::Cells;

/// What goes through a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Through {
    /// How many fibres.
    pub count: usize,
    /// Area in m2 of the section that is wet.
    pub area: f64,
    /// The orientation factor; not a number where it is dry.
    pub factor: f64,
}

impl Through {
    /// Fibres for each m2; not a number where it is dry.
    pub fn density(&self) -> f64 {
        self.count as f64 / self.area
    }
}

/// The corners of a section within the domain, in m.
fn corners(section: &FibreSection, [low, high]: [DVec3; 2]) -> [DVec3; 2] {
    [section.min.unwrap_or(low).max(low), section.max.unwrap_or(high).min(high)]
}

/// Area in m2 that is wet of a section across an axis, at a coordinate in m, between corners within the domain.
pub(super) fn wet(cells: &Cells, axis: usize, at: f64, [low, high]: [DVec3; 2]) -> f64 {
    let weight = |a: usize, i: usize| {
        let from = cells.origin[a] + i as f64 * cells.size;
        if a == axis {
            // Beyond the last centre before a side of the domain nothing is known but the last cell.
            let half = 0.5 * cells.size;
            let at = at.clamp(cells.domain[0][a] + half, cells.domain[1][a] - half);
            (1.0 - (at - from - half).abs() / cells.size).max(0.0)
        } else {
            ((from + cells.size).min(high[a]) - from.max(low[a])).max(0.0) / cells.size
        }
    };
    let weights = [0, 1, 2].map(|a| (0..cells.count[a]).map(|i| weight(a, i)).collect::<Vec<f64>>());
    let [nx, ny, _] = cells.count;
    let share = |n: usize| weights[0][n % nx] * weights[1][n / nx % ny] * weights[2][n / (nx * ny)];
    cells.fill.iter().enumerate().map(|(n, fill)| share(n) * fill).sum::<f64>() * cells.size.powi(2)
}

/// What goes through a section.
pub fn through(cells: &Cells, bodies: &Inclusions, section: &FibreSection) -> Through {
    let [low, high] = corners(section, cells.domain);
    let [one, two] = [1, 2].map(|n| (section.axis + n) % 3);
    let side = |a: usize| DVec3::AXES[a] * (high[a] - low[a]);
    let mut corner = low;
    corner[section.axis] = section.at;
    let plane = Section { corner, sides: [side(one), side(two)] };
    let found = crossing(bodies, &plane);
    let area = wet(cells, section.axis, section.at, [low, high]);
    if let Some(field) = cells.field_beside(bodies) {
        let found = cut_field(cells, field, &plane, area);
        let factor = if area > 0.0 { found.orientation_factor(field.share) } else { f64::NAN };
        return Through { count: found.count, area, factor };
    }
    let fluid = cells.fill.iter().sum::<f64>() * cells.size.powi(3);
    let fibre = |n: usize| match bodies.form(n) {
        form @ Form::Fibre { .. } => form.volume(),
        Form::Sphere { .. } | Form::Ellipsoid { .. } => 0.0,
    };
    let share = (0..bodies.len()).map(fibre).sum::<f64>() / fluid;
    let factor = if area > 0.0 && share > 0.0 {
        Crossing { section: area, ..found }.orientation_factor(share)
    } else {
        f64::NAN
    };
    Through { count: found.count, area, factor }
}

#[cfg(test)]
mod tests {
    use tremie_numerics::DQuat;
    use tremie_suspension::Kind;

    use super::*;

    /// Aligned fibres through a plane across them: alpha is 1. Half of the box is dry.
    #[test]
    fn aligned_fibres_have_the_factor_one() {
        let fill = (0..8000).map(|n| if n / 400 < 10 { 1.0 } else { 0.0 }).collect();
        let domain = [DVec3::ZERO, DVec3::splat(0.2)];
        let cells = Cells { size: 0.01, count: [20; 3], fill, domain, ..Cells::default() };
        let form = Form::Fibre { length: 0.02, diameter: 1e-3 };
        let kinds = vec![Kind { name: "f".into(), form, density: 7850.0 }];
        let mut bodies = Inclusions { kinds, ..Inclusions::default() };
        let along = DQuat::from_rotation_arc(DVec3::Z, DVec3::X);
        for n in 0..1000_u32 {
            let place = [n % 10, n / 10 % 10, n / 100].map(|i| 0.01 + 0.02 * f64::from(i));
            bodies.add(0, 0, DVec3::new(place[0], place[1], 0.5 * place[2]), along);
        }
        let mut section = FibreSection { name: "s".into(), axis: 0, at: 0.095, min: None, max: None };
        let found = through(&cells, &bodies, &section);
        assert_eq!(found.count, 100);
        assert!((found.area - 0.02).abs() < 1e-12 && (found.factor - 1.0).abs() < 1e-12, "{found:?}");
        assert!((found.density() - 5000.0).abs() < 1e-6);
        // Half of it by a corner; and between the last wet layer of cells and the first dry one.
        section.min = Some(DVec3::new(-1.0, 0.1, -1.0));
        let half = through(&cells, &bodies, &section);
        assert_eq!(half.count, 50);
        assert!((half.area - 0.01).abs() < 1e-12 && (half.factor - 1.0).abs() < 1e-12);
        let across = FibreSection { name: "z".into(), axis: 2, at: 0.1025, min: None, max: None };
        let found = through(&cells, &bodies, &across);
        assert!((found.area - 0.25 * 0.04).abs() < 1e-12 && found.factor == 0.0, "{found:?}");
        let dry = through(&cells, &bodies, &FibreSection { at: 0.15, ..across });
        assert!(dry.factor.is_nan() && dry.count == 0);
    }
}
