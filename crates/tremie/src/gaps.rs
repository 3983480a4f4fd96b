//! Gaps between solids, and between solids and walls, in which the fluid would have too few cells.
//!
//! In a gap the nearest surfaces of two solids face each other: their normals point at each other, and their distances add up to its width.
//! That is asked at the start of the run, at points on a grid.

use tremie_case::{Case, Side};
use tremie_geometry::{Body, Shape};
use tremie_numerics::DVec3;

/// Points at most that are looked at.
const POINTS: f64 = 3e5;
/// Bars of a solid at most that are looked at.
const MOST_BARS: usize = 1000;
/// Cosine of the angle between two normals from which on the surfaces face each other.
const FACING: f64 = -0.7;

/// The narrowest gap.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Gap {
    /// Its width in m.
    pub(crate) width: f64,
    /// Between what it is.
    pub(crate) between: String,
}

/// The narrowest gap at the start, if there is any.
pub(crate) fn narrowest(case: &Case, cell_size: f64) -> Option<Gap> {
    let inside = case.solids.iter().filter_map(|solid| match &solid.body {
        Body::Shape(Shape::ConeShell { base_radius, top_radius, .. }) => {
            let width = 2.0 * base_radius.min(*top_radius);
            Some(Gap { width, between: format!("the walls of {}", solid.name) })
        }
        Body::Union(union) => {
            let width = between_bars(union.bodies())?;
            Some(Gap { width, between: format!("two bars of {}", solid.name) })
        }
        _ => None,
    });
    let found = inside.chain(between(case, cell_size));
    found.min_by(|a, b| a.width.total_cmp(&b.width))
}

/// The narrowest gap in m between two bars that do not touch, looked for at both ends and the middle of each.
fn between_bars(bodies: &[Body]) -> Option<f64> {
    let bars = bodies.iter().take(MOST_BARS).filter_map(|body| match *body {
        Body::Shape(shape @ Shape::Bar { start, end, radius }) => Some((shape, start, end, radius)),
        _ => None,
    });
    let bars: Vec<_> = bars.collect();
    let gaps = bars.iter().enumerate().flat_map(|(n, (_, start, end, radius))| {
        let places = [*start, 0.5 * (start + end), *end];
        let others = bars[..n].iter().chain(&bars[n + 1..]);
        others.flat_map(move |(other, ..)| places.map(|p| other.signed_distance(p) - radius))
    });
    gaps.filter(|gap| *gap > 0.0).reduce(f64::min)
}

/// The narrowest gap between two solids, or a solid and a wall.
fn between(case: &Case, cell_size: f64) -> Option<Gap> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for solid in &case.solids {
        let (min, max) = solid.swept(0.0, 0.0);
        (low, high) = (low.min(min - 4.0 * cell_size), high.max(max + 4.0 * cell_size));
    }
    (low, high) = (low.max(case.domain.min), high.min(case.domain.max));
    let size = high - low;
    if size.min_element() <= 0.0 || !size.is_finite() {
        return None;
    }
    let step = cell_size.max((size.element_product() / POINTS).cbrt());
    let count = (size / step).ceil().max(DVec3::ONE).to_array().map(|n| n as usize);
    let mut narrowest: Option<(f64, String)> = None;
    for n in 0..count.iter().product() {
        let at = [n % count[0], n / count[0] % count[1], n / count[0] / count[1]];
        let p = low + step * (DVec3::from(at.map(|i| i as f64)) + 0.5);
        let surfaces = surfaces(case, p);
        if surfaces.iter().any(|(distance, ..)| *distance <= 0.0) {
            continue;
        }
        for (k, a) in surfaces.iter().enumerate() {
            for b in &surfaces[k + 1..] {
                let width = a.0 + b.0;
                let solid = a.2.is_ok() || b.2.is_ok();
                let least = narrowest.as_ref().map_or(f64::INFINITY, |found| found.0);
                if solid && a.1.dot(b.1) < FACING && width < least {
                    let name = |surface: Result<usize, &str>| match surface {
                        Ok(n) => case.solids[n].name.clone(),
                        Err(side) => format!("the side {side}"),
                    };
                    narrowest = Some((width, format!("{} and {}", name(a.2), name(b.2))));
                }
            }
        }
    }
    narrowest.map(|(width, between)| Gap { width, between })
}

/// Distance and normal at a point of all solids (by number) and walls (by name).
fn surfaces(case: &Case, p: DVec3) -> Vec<(f64, DVec3, Result<usize, &'static str>)> {
    const SIDES: [&str; 6] = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];
    let solids = case.solids.iter().enumerate().map(|(n, solid)| {
        let (distance, normal) = solid.body.nearest(p - solid.motion.offset(0.0));
        (distance, normal, Ok(n))
    });
    let walls = (0..6).filter(|n| matches!(case.domain.sides[*n], Side::Wall { .. })).map(|n| {
        let axis = n / 2;
        let upper = n % 2 == 1;
        let distance = if upper { case.domain.max[axis] - p[axis] } else { p[axis] - case.domain.min[axis] };
        (distance, DVec3::AXES[axis] * if upper { -1.0 } else { 1.0 }, Err(SIDES[n]))
    });
    solids.chain(walls).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gap(solids: &str) -> Option<Gap> {
        let text = format!(
            "title = \"x\"\nmethod = \"lbm\"\nmaterial = {{ density = \"1000 kg/m3\", newtonian.viscosity = \"1 Pa s\" }}\n\
             domain = {{ min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"0.4 m\", \"0.4 m\", \"0.4 m\"] }}\n\
             fluid = [{{ sphere = {{ centre = [\"0.2 m\", \"0.2 m\", \"0.2 m\"], diameter = \"0.1 m\" }} }}]\n\
             lbm.cell_size = \"10 mm\"\ngauges.interval = \"1 s\"\nstop.time = \"1 s\"\n{solids}"
        );
        narrowest(&Case::parse("x", &text).unwrap_or_else(|error| panic!("{error}")), 0.01)
    }

    #[test]
    fn gaps_are_found_and_corners_are_none() {
        let gate = |z: &str| {
            format!(
                "[[solid]]\nbox = {{ min = [\"0.2 m\", \"-1 m\", \"{z}\"], max = [\"0.22 m\", \"1 m\", \"1 m\"] }}\n"
            )
        };
        let open = gap(&gate("0.025 m")).unwrap();
        assert!(
            (open.width - 0.025).abs() < 1e-12 && open.between == "solid1 and the side z_min",
            "{open:?}"
        );
        // Standing on the floor there is none; the next are the ones to the sides.
        assert!((gap(&gate("-1 m")).unwrap().width - 0.18).abs() < 1e-12);
        assert_eq!(gap(""), None);
        let mould = gap(
            "[[solid]]\ncone_shell = { base = [\"0.2 m\", \"0.2 m\", \"0 m\"], base_diameter = \"0.1 m\", \
                         top_diameter = \"30 mm\", height = \"0.2 m\", thickness = \"20 mm\" }\n",
        );
        assert!((mould.unwrap().width - 0.03).abs() < 1e-12);
        let bar = |x: &str| {
            format!(
                "{{ start = [\"{x} m\", \"0.2 m\", \"0 m\"], end = [\"{x} m\", \"0.2 m\", \"0.4 m\"], diameter = \"20 mm\" }}"
            )
        };
        let cage = gap(&format!("[[bars]]\nlist.of = [{}, {}, {}]\n", bar("0.1"), bar("0.17"), bar("0.22")))
            .unwrap();
        assert!((cage.width - 0.03).abs() < 1e-12 && cage.between == "two bars of bars1", "{cage:?}");
    }
}
