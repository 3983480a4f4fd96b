//! What is wrong with a case only in combination: every value is fine by itself, but they contradict each other.

use tremie_geometry::{Body, Motion, Outline, Shape};
use tremie_numerics::DVec3;
use tremie_rheology::{FlowCurve, Regularisation};

use crate::case::{
    AboveFill, Cage, Case, Collision, Course, Domain, FluidRegion, Inlet, Lattice, Lbm, Load, Method,
    PressureGauge, Side, Solid, Stepping, Surface,
};
use crate::document::Document;
use crate::fault::Fault;
use crate::schema::SIDE_KEYS;
use crate::suggestion::either;

const AXES: [&str; 3] = ["x", "y", "z"];

/// More cells than this have no place in the memory of any machine that is likely to run the case.
const MOST_CELLS: f64 = 2_147_483_648.0;

/// Fewer cells than this between walls resolve no flow.
const FEWEST_CELLS: f64 = 4.0;

/// An inlet of fewer cells does not know where it looks.
const FEWEST_CELLS_OF_INLET: f64 = 2.0;

/// Fluid that nowhere reaches so far into the domain, as a share of a cell, is none.
const LEAST_FLUID: f64 = 0.25;

/// Numbers of files have six digits.
const MOST_FILES: f64 = 999_999.0;

/// A round bar so many cells thick covers the centre of a cell wherever it stands, and with less it may vanish.
const BAR_CELLS: f64 = std::f64::consts::SQRT_2;

/// A domain is a whole number of cells if it is one up to this share of a cell.
const CELL_TOLERANCE: f64 = 1e-6;

/// Refuses contradictions.
pub(crate) fn check(case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    flow_curve(&case.material.curve, document)?;
    corners(case.domain.min, case.domain.max, "domain", document)?;
    sides(&case.domain, document)?;
    cells(&case.domain, &case.method, document)?;
    match &case.method {
        Method::Lbm(lbm) => scheme(lbm, case, document)?,
        Method::Isph(_) | Method::Ldd(_) => particles(case, document)?,
    }
    for (index, region) in case.fluid.iter().enumerate() {
        let path = format!("fluid.{index}");
        fluid(region, &path, &case.domain, document)?;
        holds(&region.shape, &path, &case.domain, case.method.resolution(), document)?;
    }
    for (index, inlet) in case.inlets.iter().enumerate() {
        self::inlet(inlet, &format!("inlet.{index}"), case, document)?;
    }
    for (index, outlet) in case.outlets.iter().enumerate() {
        let path = format!("outlet.{index}.box");
        corners(outlet.min, outlet.max, &path, document)?;
        let bounds = (outlet.min, outlet.max);
        meets(bounds, &case.domain, "this outlet lies outside the domain", &path, document)?;
    }
    for (index, solid) in case.solids.iter().enumerate() {
        self::solid(solid, &solid_path(index, document), case, document)?;
    }
    for (index, cage) in case.cages.iter().enumerate() {
        self::cage(cage, &format!("cage.{index}"), &case.domain, document)?;
    }
    structure(case, document)?;
    names(case, document)?;
    crate::inclusions::sections(case, document)?;
    gauges(case, document)?;
    stop(case, document)?;
    output(case, document)
}

/// Viscosities that bound each other are in the right order.
fn flow_curve(curve: &FlowCurve, document: &Document<'_>) -> Result<(), Fault> {
    match *curve {
        FlowCurve::Cross { zero_shear_viscosity, infinite_shear_viscosity, .. }
        | FlowCurve::CarreauYasuda { zero_shear_viscosity, infinite_shear_viscosity, .. }
            if infinite_shear_viscosity > zero_shear_viscosity =>
        {
            let model = if matches!(curve, FlowCurve::Cross { .. }) { "cross" } else { "carreau_yasuda" };
            let path = |key: &str| format!("material.{model}.{key}");
            Err(Fault::new(
                document.locate(&path("infinite_shear_viscosity")),
                "the viscosity must not grow with the shear rate",
                format!("write \"{zero_shear_viscosity} Pa s\" at most"),
            )
            .related(document.find(&path("zero_shear_viscosity")), "the viscosity without shear"))
        }
        FlowCurve::Regularised { exact, by: Regularisation::BiViscosity { largest_viscosity } }
            if largest_viscosity <= exact.least_viscosity() =>
        {
            Err(Fault::new(
                document.locate("material.regularisation.bi_viscosity.largest_viscosity"),
                "the largest viscosity is no larger than the flow curve's own",
                format!(
                    "write more than \"{} Pa s\", a thousand times as much, say",
                    exact.least_viscosity()
                ),
            ))
        }
        _ => Ok(()),
    }
}

/// A box between two corners is not empty.
fn corners(min: DVec3, max: DVec3, path: &str, document: &Document<'_>) -> Result<(), Fault> {
    for (axis, name) in AXES.iter().enumerate() {
        if min[axis] >= max[axis] {
            return Err(Fault::new(
                document.locate(&format!("{path}.max.{axis}")),
                format!("the largest {name} must be larger than the smallest"),
                format!("write more than \"{} m\"", min[axis]),
            )
            .related(document.find(&format!("{path}.min.{axis}")), "the smallest"));
        }
    }
    Ok(())
}

/// Opposite sides are both periodic or neither is; walls move within their plane.
fn sides(domain: &Domain, document: &Document<'_>) -> Result<(), Fault> {
    let path = |index: usize| format!("domain.sides.{}", SIDE_KEYS[index]);
    for (index, side) in domain.sides.iter().enumerate() {
        let opposite = index ^ 1;
        let axis = index / 2;
        match side {
            Side::Periodic if domain.sides[opposite] != Side::Periodic => {
                return Err(Fault::new(
                    document.locate(&path(index)),
                    format!("`{}` is periodic, but the opposite side is not", SIDE_KEYS[index]),
                    format!("write {} = \"periodic\" too, or neither", SIDE_KEYS[opposite]),
                )
                .related(document.find(&path(opposite)), "the opposite side"));
            }
            Side::Wall { velocity, .. } if velocity[axis] != 0.0 => {
                return Err(Fault::new(
                    document.locate(&format!("{}.velocity.{axis}", path(index))),
                    format!("the wall `{}` must move within its own plane", SIDE_KEYS[index]),
                    format!("write \"0 m/s\" for the velocity in {}", AXES[axis]),
                ));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Lattice and collision go together, and with the rest of the case.
fn scheme(lbm: &Lbm, case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    let find = |key: &str| document.find(&format!("lbm.{key}"));
    let clash = |key: &str, problem: &str, advice: &str| {
        Err(Fault::new(document.locate(&format!("lbm.{key}")), problem, advice))
    };
    if lbm.preset.is_some() {
        for key in ["lattice", "collision"] {
            if find(key).is_some() {
                return clash(key, "the preset says this already", "leave out this line, or the preset");
            }
        }
    } else if lbm.lattice != Lattice::D3q19 && lbm.collision == Collision::Mtrt {
        let advice = "add collision = \"trt\", \"bgk\" or \"regularised\", or write \"d3q19\"";
        return clash("lattice", "the program's own collision is for d3q19 only", advice);
    }
    let Some(asked) = (lbm.textbook()).map(|_| if lbm.preset.is_some() { "preset" } else { "collision" })
    else {
        return Ok(());
    };
    if lbm.stepping == Stepping::Adaptive {
        let advice = "write \"fixed\", or leave out the preset or collision";
        return clash("stepping", "only the program's own scheme can change its steps", advice);
    }
    if lbm.bulk_relaxation != 1.0 {
        let advice = "leave out this line, or the preset or collision";
        return clash(
            "bulk_relaxation",
            "only the program's own scheme has a bulk viscosity to choose",
            advice,
        );
    }
    let slides = |side: &Side| matches!(side, Side::Wall { surface, .. } if *surface != Surface::NoSlip);
    if let Some(index) = case.domain.sides.iter().position(slides) {
        return Err(Fault::new(
            document.locate(&format!("domain.sides.{}.surface", SIDE_KEYS[index])),
            "only the program's own scheme knows walls along which the fluid slides",
            format!("leave out `{asked}` under [lbm], or write \"no_slip\""),
        ));
    }
    let unknown = [
        ("solids", !case.solids.is_empty()),
        ("cages", !case.cages.is_empty()),
        ("inclusions", case.has_bodies()),
        ("fibre fields", case.fibre_field.is_some()),
        ("inlets", !case.inlets.is_empty()),
        ("outlets and open sides", case.has_outlets()),
        ("batches", !case.batches().is_empty()),
        ("thixotropy", case.material.thixotropy.is_some()),
        ("surface tension", case.material.surface_tension > 0.0),
    ];
    match unknown.into_iter().find(|(_, present)| *present) {
        Some((what, _)) => clash(
            asked,
            &format!("only the program's own scheme knows {what}"),
            &format!("leave out this line, or the {what}"),
        ),
        None => Ok(()),
    }
}

/// There is nothing in the case that particles do not know.
fn particles(case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    let unknown = [
        ("cage", "cages", !case.cages.is_empty()),
        ("inclusions", "inclusions", case.has_bodies()),
        ("fibre_field", "fibre fields", case.fibre_field.is_some()),
        ("inlet", "inlets", !case.inlets.is_empty()),
        ("outlet", "outlets", !case.outlets.is_empty()),
        ("fluid", "batches", !case.batches().is_empty()),
        ("material.thixotropy", "thixotropy", case.material.thixotropy.is_some()),
        ("material.surface_tension", "surface tension", case.material.surface_tension > 0.0),
    ];
    if let Some((key, what, _)) = unknown.into_iter().find(|(.., present)| *present) {
        let place = document.locate(key);
        let problem = format!("the method `{}` does not know {what}", case.method.name());
        return Err(Fault::new(place, problem, "leave this out, or write method = \"lbm\"")
            .related(document.find("method"), "the method"));
    }
    let film = |surface: &Surface| matches!(surface, Surface::Film { .. });
    let of_side = |side: &Side| matches!(side, Side::Wall { surface, .. } if film(surface));
    let side = case.domain.sides.iter().position(of_side);
    let solid = case.solids.iter().position(|solid| film(&solid.surface));
    let place = match (side, solid) {
        (Some(side), _) => format!("domain.sides.{}.surface", SIDE_KEYS[side]),
        (None, Some(solid)) => format!("{}.surface", solid_path(solid, document)),
        (None, None) => return Ok(()),
    };
    let problem = format!("the method `{}` knows no walls with a film", case.method.name());
    let advice = "write \"no_slip\", \"free_slip\" or a slip length, or method = \"lbm\"";
    Err(Fault::new(document.locate(&place), problem, advice))
}

/// The domain is a whole number of cells along each axis, and not too many.
fn cells(domain: &Domain, method: &Method, document: &Document<'_>) -> Result<(), Fault> {
    let cell_size = method.resolution();
    let cell_size_span = document.locate(method.resolution_key());
    let cells = (domain.max - domain.min) / cell_size;
    for (axis, name) in AXES.iter().enumerate() {
        if cells[axis] < 1.0 - CELL_TOLERANCE {
            let size = tidy(domain.max[axis] - domain.min[axis]);
            return Err(Fault::new(
                cell_size_span,
                "the cells are larger than the domain",
                format!("write \"{size} m\" at most"),
            )
            .related(
                document.find(&format!("domain.max.{axis}")),
                format!("the domain is {size} m along {name}"),
            ));
        }
    }
    let number = cells.element_product();
    if number > MOST_CELLS {
        return Err(Fault::new(
            cell_size_span,
            format!("the domain has {number:.2e} cells, more than {MOST_CELLS:.2e}"),
            "write a larger cell size, or a smaller domain",
        ));
    }
    for (axis, name) in AXES.iter().enumerate() {
        if (cells[axis] - cells[axis].round()).abs() > CELL_TOLERANCE {
            let nearby = |n: f64| format!("\"{} m\"", tidy(domain.min[axis] + n * cell_size));
            return Err(Fault::new(
                document.locate(&format!("domain.max.{axis}")),
                format!("the domain is {:.2} cells along {name}, not a whole number", cells[axis]),
                format!(
                    "write {} or {}",
                    nearby(cells[axis].floor().max(1.0)),
                    nearby(cells[axis].floor() + 1.0)
                ),
            )
            .related(Some(cell_size_span), "the cell size"));
        }
    }
    for (axis, name) in AXES.iter().enumerate() {
        let walls = [2 * axis, 2 * axis + 1].map(|side| matches!(domain.sides[side], Side::Wall { .. }));
        if walls.contains(&true) && cells[axis].round() < FEWEST_CELLS {
            let size = tidy((domain.max[axis] - domain.min[axis]) / FEWEST_CELLS);
            return Err(Fault::new(
                cell_size_span,
                format!(
                    "the domain is only {} cells across along {name}, too few beside a wall",
                    cells[axis].round()
                ),
                format!("write \"{size} m\" at most"),
            )
            .related(document.find(&format!("domain.max.{axis}")), "the domain's corner")
            .help(format!(
                "a planar flow is one cell thick between periodic sides: {} = \"periodic\", {} = \"periodic\"",
                SIDE_KEYS[2 * axis],
                SIDE_KEYS[2 * axis + 1]
            )));
        }
    }
    Ok(())
}

/// Without the noise in the last digits that a sum of decimal numbers leaves, and without negative zeros.
pub(crate) fn tidy(number: f64) -> f64 {
    format!("{number:.11e}").parse().unwrap_or(number) + 0.0
}

/// Only a thixotropic fluid has a structure.
fn structure(case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    let regions = case.fluid.iter().map(|region| region.structure).enumerate();
    let inlets = case.inlets.iter().map(|inlet| inlet.structure).enumerate();
    let paths = regions
        .map(|(n, structure)| (format!("fluid.{n}.structure"), structure))
        .chain(inlets.map(|(n, structure)| (format!("inlet.{n}.structure"), structure)));
    for (path, structure) in paths {
        if structure.is_some() && case.material.thixotropy.is_none() {
            return Err(Fault::new(
                document.locate(&path),
                "only a thixotropic fluid has a structure",
                "remove this, or add `thixotropy` under [material]",
            ));
        }
    }
    Ok(())
}

/// A region of fluid meets the domain.
fn fluid(region: &FluidRegion, path: &str, domain: &Domain, document: &Document<'_>) -> Result<(), Fault> {
    shape(&region.shape, path, document)?;
    meets(region.shape.bounds(), domain, "this fluid lies outside the domain", path, document)
}

/// A box between two corners meets the domain.
fn meets(
    (min, max): (DVec3, DVec3),
    domain: &Domain,
    problem: &str,
    path: &str,
    document: &Document<'_>,
) -> Result<(), Fault> {
    for (axis, name) in AXES.iter().enumerate() {
        if max[axis] <= domain.min[axis] || min[axis] >= domain.max[axis] {
            return Err(Fault::new(
                document.locate(path),
                problem,
                format!("{name} from {} m to {} m", tidy(min[axis]), tidy(max[axis])),
            )
            .related(
                document.find("domain"),
                format!("{name} from {} m to {} m", domain.min[axis], domain.max[axis]),
            ));
        }
    }
    Ok(())
}

/// Name of a shape in the case file.
fn key(shape: &Shape) -> &'static str {
    match shape {
        Shape::Box { .. } => "box",
        Shape::Sphere { .. } => "sphere",
        Shape::Cone { .. } => "cone",
        Shape::Cylinder { .. } => "cylinder",
        Shape::Capsule { .. } => "capsule",
        Shape::Bar { .. } => "bar",
        Shape::HalfSpace { .. } => "plane",
        Shape::ConeShell { .. } => "cone_shell",
    }
}

/// A shape has a volume.
fn shape(shape: &Shape, path: &str, document: &Document<'_>) -> Result<(), Fault> {
    let within = |name: &str| format!("{path}.{}.{name}", key(shape));
    match *shape {
        Shape::Box { min, max } => corners(min, max, &format!("{path}.box"), document),
        Shape::Cone { base_radius: 0.0, top_radius: 0.0, .. }
        | Shape::ConeShell { base_radius: 0.0, top_radius: 0.0, .. } => {
            let span = document.locate(&within("base_diameter"));
            let top = document.find(&within("top_diameter"));
            Err(Fault::new(span, "both diameters of the cone are zero", "write \"200 mm\", say")
                .related(top, "zero too"))
        }
        Shape::Cylinder { axis: DVec3::ZERO, .. } => Err(Fault::new(
            document.locate(&within("axis")),
            "the axis of the cylinder has no direction",
            "write [0, 0, 1], say",
        )),
        Shape::HalfSpace { normal: DVec3::ZERO, .. } => Err(Fault::new(
            document.locate(&within("normal")),
            "the normal of the plane has no direction",
            "write [0, 0, 1], say",
        )),
        _ => Ok(()),
    }
}

/// Some of a shape lies within the domain: its bounds alone do not tell of a round one.
fn holds(
    shape: &Shape,
    path: &str,
    domain: &Domain,
    cell_size: f64,
    document: &Document<'_>,
) -> Result<(), Fault> {
    if reaches(shape, domain.min, domain.max, LEAST_FLUID * cell_size) {
        return Ok(());
    }
    Err(Fault::new(
        document.locate(path),
        "none of this fluid lies in the domain",
        format!("move it, or make it larger than a cell (\"{cell_size} m\")"),
    )
    .related(document.find("domain"), "the domain"))
}

/// Whether a shape has points in a box, found by halving the box; parts smaller than `least` may be missed.
fn reaches(shape: &Shape, min: DVec3, max: DVec3, least: f64) -> bool {
    let (centre, half) = (0.5 * (min + max), 0.5 * (max - min));
    let distance = shape.signed_distance(centre);
    if distance < 0.0 {
        return true;
    }
    // A box wholly outside, one too small, and one so far away that there are no numbers for it.
    if distance.is_nan() || distance >= half.length() || half.max_element() < least {
        return false;
    }
    let axis = half.max_position();
    let mut cut = [max, min];
    cut[0][axis] = centre[axis];
    cut[1][axis] = centre[axis];
    reaches(shape, min, cut[0], least) || reaches(shape, cut[1], max, least)
}

/// The stop rule can apply before the run ends.
fn stop(case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    match (&case.stop.rest, document.find("stop.rest.duration")) {
        (Some(rest), Some(span)) if rest.duration > case.stop.time => {
            Err(Fault::new(span, "the run ends before it can have been at rest for so long", "write less")
                .related(document.find("stop.time"), "the end of the run"))
        }
        _ => Ok(()),
    }
}

/// Where the solid number `index` of a case stands: under `solid`, or under `bars`, which come after.
fn solid_path(index: usize, document: &Document<'_>) -> String {
    let path = format!("solid.{index}");
    if document.find(&path).is_some() {
        return path;
    }
    let others = (0..index).filter(|n| document.find(&format!("solid.{n}")).is_some()).count();
    format!("bars.{}", index - others)
}

/// What is told apart by its name has a name of its own.
fn names(case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    let gauges = &case.gauges;
    let within = |kind: &str, n: usize| format!("gauges.{kind}.{n}");
    let solids =
        case.solids.iter().enumerate().map(|(n, solid)| (solid.name.as_str(), solid_path(n, document)));
    let levels = gauges.level.iter().enumerate().map(|(n, gauge)| (gauge.name.as_str(), within("level", n)));
    let fronts = gauges.front.iter().enumerate().map(|(n, gauge)| (gauge.name.as_str(), within("front", n)));
    let lights = gauges.light.iter().enumerate().map(|(n, gauge)| (gauge.name.as_str(), within("light", n)));
    let pressures =
        gauges.pressure.iter().enumerate().map(|(n, gauge)| (gauge.name.as_str(), within("pressure", n)));
    let cages = case.cages.iter().enumerate().map(|(n, cage)| (cage.name.as_str(), format!("cage.{n}")));
    // Solids and cages have columns in the same table; the stop rule knows fronts and lights by their names alone.
    let groups: [(&str, Vec<(&str, String)>); 4] = [
        (if case.cages.is_empty() { "solids" } else { "solids or cages" }, solids.chain(cages).collect()),
        ("level gauges", levels.collect()),
        ("front and light gauges", fronts.chain(lights).collect()),
        ("pressure gauges", pressures.collect()),
    ];
    for (what, group) in &groups {
        for (n, (name, path)) in group.iter().enumerate() {
            if let Some((_, first)) = group[..n].iter().find(|(other, _)| other == name) {
                return Err(Fault::new(
                    document.locate(&format!("{path}.name")),
                    format!("two {what} are called `{name}`"),
                    "write another name",
                )
                .related(document.find(&format!("{first}.name")), "the first"));
            }
        }
    }
    let events = &groups[2].1;
    if let Some(event) = &case.stop.event
        && !events.iter().any(|(name, _)| name == event)
    {
        return Err(unknown("stop.event", "front or light gauge", event, events, document));
    }
    if gauges.level.is_empty() && case.stop.rest.is_some_and(|rest| rest.level_rate.is_some()) {
        return Err(Fault::new(
            document.locate("stop.rest.level_rate"),
            "no level is read",
            "leave this out, or write a level gauge: level = [{ name = \"H1\", ... }]",
        ));
    }
    for (n, gauge) in gauges.light.iter().enumerate() {
        if let Some(with) = &gauge.with
            && !case.solids.iter().any(|solid| solid.name == *with)
        {
            return Err(unknown(
                &format!("{}.with", within("light", n)),
                "solid",
                with,
                &groups[0].1[..case.solids.len()],
                document,
            ));
        }
    }
    for (n, gauge) in gauges.pressure.iter().enumerate() {
        if gauge.side().is_none() && !case.solids.iter().any(|solid| solid.name == gauge.wall) {
            let sides = SIDE_KEYS.iter().map(|key| (*key, String::new()));
            let walls: Vec<_> = sides.chain(groups[0].1[..case.solids.len()].iter().cloned()).collect();
            let path = format!("{}.wall", within("pressure", n));
            return Err(unknown(&path, "side or solid", &gauge.wall, &walls, document));
        }
    }
    Ok(())
}

/// What is called by a name that nothing has.
fn unknown(path: &str, what: &str, name: &str, there: &[(&str, String)], document: &Document<'_>) -> Fault {
    let names: Vec<&str> = there.iter().map(|(name, _)| *name).collect();
    let advice = match names.as_slice() {
        [] => "there is none: leave this out".to_owned(),
        _ => format!("write {}", either(names.iter().map(|name| format!("\"{name}\"")))),
    };
    Fault::new(document.locate(path), format!("there is no {what} called `{name}`"), advice)
}

/// A solid is thick enough for the cells, moves forwards in time, and meets the domain.
fn solid(solid: &Solid, path: &str, case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    if path.starts_with("bars") {
        bars(&solid.body, path, case, document)?;
    } else {
        parts(&solid.body, path, case, document)?;
    }
    forwards(&solid.motion, path, document)?;
    if let Some(load) = &solid.load {
        self::load(load, path, case, document)?;
    }
    let problem = "this solid lies outside the domain from the start to the end of the run";
    meets(solid.swept(0.0, case.stop.time), &case.domain, problem, path, document)
}

/// A load acts along an axis, on one solid only, and the method can move it.
fn load(load: &Load, path: &str, case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    let place = document.locate(&format!("{path}.motion.load"));
    let axes = load.force.to_array().iter().filter(|component| **component != 0.0).count();
    if axes != 1 {
        let place = document.locate(&format!("{path}.motion.load.force"));
        let problem = if axes == 0 { "there is no force" } else { "the force is not along an axis" };
        return Err(Fault::new(
            place,
            problem,
            "write one component that is not zero: [\"0 N\", \"0 N\", \"-10 N\"]",
        ));
    }
    if case.solids.iter().filter(|solid| solid.load.is_some()).count() > 1 {
        return Err(Fault::new(
            place,
            "more than one solid is moved by a load",
            "prescribe the motion of all but one",
        ));
    }
    if let Method::Ldd(_) = case.method {
        return Err(Fault::new(
            place,
            "loads do not move solids by this method",
            "set method = \"lbm\", \"isph\" or \"sph\", or prescribe the motion: motion.uniform",
        ));
    }
    Ok(())
}

/// A cage has a volume in the domain, and its bars go somewhere.
fn cage(cage: &Cage, path: &str, domain: &Domain, document: &Document<'_>) -> Result<(), Fault> {
    if let Body::Shape(region) = &cage.body {
        shape(region, path, document)?;
    }
    meets(cage.body.bounds(), domain, "this cage lies outside the domain", path, document)?;
    for (index, layer) in cage.layers.iter().enumerate() {
        let (direction, key) = match layer.course {
            Course::Straight(direction) => (direction, "direction"),
            Course::Around { axis, .. } => (axis, "around.axis"),
        };
        if direction == DVec3::ZERO {
            return Err(Fault::new(
                document.locate(&format!("{path}.layers.{index}.{key}")),
                "the bars go nowhere: this is no direction",
                "write [0, 0, 1] for upright, say",
            ));
        }
    }
    Ok(())
}

/// An inlet looks somewhere, is large enough for the cells, begins before it ends, and is in the domain at some time.
fn inlet(inlet: &Inlet, path: &str, case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    let (key, size) = match inlet.face.outline {
        Outline::Disc { .. } => ("disc", "diameter"),
        Outline::Rectangle { .. } => ("rectangle", "size"),
    };
    if inlet.face.direction == DVec3::ZERO {
        return Err(Fault::new(
            document.locate(&format!("{path}.{key}.direction")),
            "the inlet looks nowhere: its direction is zero",
            "write [0, 0, -1] for downwards, say",
        ));
    }
    let resolution = case.method.resolution();
    let least = FEWEST_CELLS_OF_INLET * resolution;
    if inlet.face.least_extent() < least * (1.0 - CELL_TOLERANCE) {
        return Err(Fault::new(
            document.locate(&format!("{path}.{key}.{size}")),
            format!(
                "the inlet is only {} m across, too little for the cells",
                tidy(inlet.face.least_extent())
            ),
            format!("write \"{} m\" at least (better three times that), or smaller cells", tidy(least)),
        )
        .related(document.find(case.method.resolution_key()), "the cell size"));
    }
    if inlet.stop <= inlet.start {
        return Err(Fault::new(
            document.locate(&format!("{path}.stop")),
            "the inlet ends before it begins",
            format!("write more than \"{} s\"", inlet.start),
        )
        .related(document.find(&format!("{path}.start")), "its beginning"));
    }
    if inlet.start >= case.stop.time {
        return Err(Fault::new(
            document.locate(&format!("{path}.start")),
            "the run ends before this inlet begins",
            format!("write less than \"{} s\"", case.stop.time),
        )
        .related(document.find("stop.time"), "the end of the run"));
    }
    forwards(&inlet.motion, path, document)?;
    if let Some(above) = inlet.above_fill {
        above_fill(&above, path, case, document)?;
    }
    let (min, max) = inlet.face.bounds(0.0);
    let (low, high) = inlet.motion.range(inlet.start, case.stop.time);
    // A face along a side of the domain has no thickness to meet it with.
    let touch = 0.5 * resolution;
    let problem = "this inlet lies outside the domain from the start to the end of the run";
    meets((min + low - touch, max + high + touch), &case.domain, problem, path, document)
}

/// An inlet that stays above the fill has no other motion, knows where up is, and keeps clear of the fluid.
fn above_fill(above: &AboveFill, path: &str, case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    let key = format!("{path}.above_fill");
    if let Some(motion) = document.find(&format!("{path}.motion")) {
        return Err(Fault::new(
            document.locate(&key),
            "the inlet moves with the fill and by a motion of its own",
            "keep only one of them",
        )
        .related(Some(motion), "its motion"));
    }
    let gravity = case.domain.gravity;
    if gravity.x != 0.0 || gravity.y != 0.0 || gravity.z >= 0.0 {
        return Err(Fault::new(
            document.locate(&key),
            "nothing is above the fill where gravity does not point straight down",
            "leave this out, or let gravity point along -z",
        )
        .related(document.find("domain.gravity"), "the gravity"));
    }
    let resolution = case.method.resolution();
    if above.distance < resolution * (1.0 - CELL_TOLERANCE) {
        return Err(Fault::new(
            document.locate(&format!("{key}.distance")),
            "the inlet is less than a cell above the fill",
            format!("write \"{} m\" at least (better some cells more), or smaller cells", tidy(resolution)),
        )
        .related(document.find(case.method.resolution_key()), "the cell size"));
    }
    Ok(())
}

/// A path goes forwards in time.
fn forwards(motion: &Motion, path: &str, document: &Document<'_>) -> Result<(), Fault> {
    if let Motion::Path(points) = motion {
        for (n, ends) in points.windows(2).enumerate() {
            if ends[1].time <= ends[0].time {
                let time = |n: usize| format!("{path}.motion.path.points.{n}.time");
                return Err(Fault::new(
                    document.locate(&time(n + 1)),
                    "the motion does not go forwards in time",
                    format!("write more than \"{} s\"", ends[0].time),
                )
                .related(document.find(&time(n)), "the point before"));
            }
        }
    }
    Ok(())
}

/// Bars are thick enough for the cells.
fn bars(body: &Body, path: &str, case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    let Body::Union(bars) = body else { return Ok(()) };
    let resolution = case.method.resolution();
    let thickness = |body: &Body| match body {
        Body::Shape(shape) => shape.thickness(),
        _ => f64::INFINITY,
    };
    let thin = |body: &Body| thickness(body) < BAR_CELLS * resolution * (1.0 - CELL_TOLERANCE);
    let Some(first) = bars.bodies().iter().position(thin) else { return Ok(()) };
    let all = bars.bodies().len();
    let count = bars.bodies().iter().filter(|body| thin(body)).count();
    let listed = format!("{path}.list.of.{first}.diameter");
    let places = [listed, format!("{path}.grid.diameter"), format!("{path}.csv.file")];
    let span = places.iter().find_map(|place| document.find(place));
    Err(Fault::new(
        span.unwrap_or_else(|| document.locate(path)),
        format!(
            "the cells are too large to see {count} of {all} bars: number {} is {} m thick",
            first + 1,
            tidy(thickness(&bars.bodies()[first]))
        ),
        "write smaller cells, half as large as the bars at most, or a [[cage]] in place of the bars",
    )
    .related(document.find(case.method.resolution_key()), "the cell size"))
}

/// All shapes of a body have a volume, and are not thinner than a cell.
fn parts(body: &Body, path: &str, case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    match body {
        Body::Shape(one) => {
            shape(one, path, document)?;
            let resolution = case.method.resolution();
            if one.thickness() >= resolution * (1.0 - CELL_TOLERANCE) {
                return Ok(());
            }
            let what = match one {
                Shape::ConeShell { .. } => format!("{path}.cone_shell.thickness"),
                Shape::Sphere { .. } | Shape::Cylinder { .. } | Shape::Capsule { .. } | Shape::Bar { .. } => {
                    format!("{path}.{}.diameter", key(one))
                }
                _ => format!("{path}.{}", key(one)),
            };
            // The wall of a shell leans, and is thinner than it is along the horizontal.
            let lean = match one {
                Shape::ConeShell { thickness, .. } => thickness / one.thickness(),
                _ => 1.0,
            };
            let least = resolution * (100.0 * lean * (1.0 - CELL_TOLERANCE)).ceil() / 100.0;
            Err(Fault::new(
                document.locate(&what),
                format!("the cells are too large to see this: it is {} m thick", tidy(one.thickness())),
                format!("write \"{} m\" at least (better twice that), or smaller cells", tidy(least)),
            )
            .related(document.find(case.method.resolution_key()), "the cell size"))
        }
        Body::Mesh(mesh) => {
            let resolution = case.method.resolution();
            let Some((count, place)) = mesh.thin(resolution * (1.0 - CELL_TOLERANCE)) else {
                return Ok(());
            };
            let [x, y, z] = place.to_array().map(tidy);
            let all = mesh.mesh().triangles.len();
            Err(Fault::new(
                document.locate(&format!("{path}.stl")),
                "the cells are too large to see this: it is thinner than one",
                format!("at {count} of {all} facets, the first at {x} m, {y} m, {z} m; make it thicker, or write smaller cells"),
            )
            .related(document.find(case.method.resolution_key()), "the cell size"))
        }
        Body::Complement(body) => {
            parts(body, path, case, document)?;
            let problem = "the inside of this formwork lies outside the domain";
            meets(body.bounds(), &case.domain, problem, path, document)
        }
        Body::Union(union) => union
            .bodies()
            .iter()
            .enumerate()
            .try_for_each(|(n, body)| parts(body, &format!("{path}.union.of.{n}"), case, document)),
        Body::Difference(bodies) => {
            let [from, without] = &**bodies;
            parts(from, &format!("{path}.difference.from"), case, document)?;
            let Body::Union(cut) = without else { return Ok(()) };
            cut.bodies().iter().enumerate().try_for_each(|(n, body)| {
                parts(body, &format!("{path}.difference.without.{n}"), case, document)
            })
        }
    }
}

/// Files are no more than their numbers.
fn output(case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    let output = &case.output;
    let intervals =
        [("snapshot_interval", output.snapshot_interval), ("picture_interval", output.picture_interval)];
    for (key, interval) in intervals {
        if let Some(interval) = interval
            && case.stop.time / interval > MOST_FILES
        {
            return Err(Fault::new(
                document.locate(&format!("output.{key}")),
                format!("`output.{key}` asks for more than {MOST_FILES} files"),
                format!("write \"{} s\" at least", tidy(case.stop.time / 1000.0)),
            )
            .related(document.find("stop.time"), "the end of the run"));
        }
    }
    Ok(())
}

/// What is measured is inside the domain or its mirror images, and what the stop rule asks for is measured.
fn gauges(case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    for (n, gauge) in case.gauges.level.iter().enumerate() {
        let path = format!("gauges.level.{n}");
        measured(&gauge.min.to_array(), &gauge.max.to_array(), &path, case, document)?;
    }
    for (n, gauge) in case.gauges.light.iter().enumerate() {
        let path = format!("gauges.light.{n}");
        corners(gauge.min, gauge.max, &path, document)?;
        if gauge.with.is_none() {
            measured(&gauge.min.to_array(), &gauge.max.to_array(), &path, case, document)?;
        }
    }
    for (n, gauge) in case.gauges.front.iter().enumerate() {
        let [low, high] = whole(&case.domain, gauge.axis);
        if !(low..=high).contains(&gauge.at) {
            return Err(Fault::new(
                document.locate(&format!("gauges.front.{n}.at")),
                "the fluid never comes there: the plane lies outside the domain",
                format!("write \"{} m\" to \"{} m\"", tidy(low), tidy(high)),
            ));
        }
    }
    for (n, gauge) in case.gauges.pressure.iter().enumerate() {
        pressure(gauge, &format!("gauges.pressure.{n}"), case, document)?;
    }
    match case.gauges.spread {
        Some(spread) => {
            let (min, max) = (case.domain.min.truncate(), case.domain.max.truncate());
            for axis in 0..2 {
                if spread.centre[axis] < min[axis] || spread.centre[axis] > max[axis] {
                    return Err(Fault::new(
                        document.locate(&format!("gauges.spread.centre.{axis}")),
                        "the spread is measured from an axis outside the domain",
                        format!("write \"{} m\" to \"{} m\"", min[axis], max[axis]),
                    ));
                }
            }
        }
        None => {
            let by_spread = ["stop.rest.spread_rate", "stop.rest.growth"];
            if let Some(span) = by_spread.into_iter().find_map(|key| document.find(key)) {
                return Err(Fault::new(
                    span,
                    "the run is to stop by its spread, but there is no spread gauge",
                    "remove this, or add the gauge",
                )
                .help("add spread = { centre = [\"0 m\", \"0 m\"] } to [gauges]"));
            }
        }
    }
    Ok(())
}

/// The wall of a pressure gauge is one that bears something, and some of it is in the box that counts.
fn pressure(gauge: &PressureGauge, path: &str, case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    if let Method::Lbm(lbm) = &case.method
        && lbm.textbook().is_some()
    {
        let problem = "the schemes of the textbooks do not tell what walls bear";
        return Err(Fault::new(document.locate(path), problem, "leave this out"));
    }
    if let Some(side) = gauge.side()
        && matches!(case.domain.sides[side], Side::Periodic | Side::Open)
    {
        return Err(Fault::new(
            document.locate(&format!("{path}.wall")),
            format!("`{}` bears nothing: it is no wall", gauge.wall),
            "write a side that is a wall or a plane of symmetry, or the name of a solid",
        )
        .related(document.find(&format!("domain.sides.{}", gauge.wall)), "what it is"));
    }
    let (min, max) = (gauge.min.unwrap_or(case.domain.min), gauge.max.unwrap_or(case.domain.max));
    measured(&min.to_array(), &max.to_array(), path, case, document)?;
    if min.z == max.z {
        let place = document.locate(&format!("{path}.max.2"));
        return Err(Fault::new(place, "the box has no height", "write a larger z than that of `min`"));
    }
    Ok(())
}

/// Where the domain and its mirror images begin and end along an axis, in m.
fn whole(domain: &Domain, axis: usize) -> [f64; 2] {
    let (low, high) = (domain.min[axis], domain.max[axis]);
    let mirrored = |side: usize| domain.sides[2 * axis + side] == Side::Symmetry;
    [if mirrored(0) { 2.0 * low - high } else { low }, if mirrored(1) { 2.0 * high - low } else { high }]
}

/// A range of coordinates in which something is measured is in order, and inside the domain or its mirror images.
fn measured(min: &[f64], max: &[f64], path: &str, case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    for (axis, name) in AXES.iter().enumerate().take(min.len()) {
        let [low, high] = whole(&case.domain, axis);
        let slack = CELL_TOLERANCE * (high - low);
        let place = |key: &str| document.locate(&format!("{path}.{key}.{axis}"));
        if min[axis] > max[axis] {
            return Err(Fault::new(
                place("max"),
                format!("the largest {name} is smaller than the smallest"),
                format!("write \"{} m\" at least", tidy(min[axis])),
            )
            .related(document.find(&format!("{path}.min.{axis}")), "the smallest"));
        }
        for (key, value) in [("min", min[axis]), ("max", max[axis])] {
            if value < low - slack || value > high + slack {
                return Err(Fault::new(
                    place(key),
                    "what is measured lies outside the domain",
                    format!("write \"{} m\" to \"{} m\"", tidy(low), tidy(high)),
                )
                .related(document.find("domain"), "the domain"));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_is_found_in_a_box_if_it_is_there() {
        let sphere = |x: f64| Shape::Sphere { centre: DVec3::new(x, 1.0, 1.0), radius: 0.5 };
        let within = |shape: &Shape| reaches(shape, DVec3::ZERO, DVec3::ONE, 1e-3);
        // Its bounds overlap the box; the sphere itself reaches the corner or does not.
        assert!(within(&sphere(1.49)));
        assert!(!within(&sphere(1.51)));
        let corner = |d: f64| Shape::Sphere { centre: DVec3::splat(1.0 + d), radius: 0.5 };
        assert!(within(&corner(0.28)));
        assert!(!within(&corner(0.3)));
        // Smaller than what is looked for.
        assert!(!within(&Shape::Sphere { centre: DVec3::splat(0.3), radius: 1e-6 }));
    }
}
