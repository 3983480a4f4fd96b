//! Bodies in the fluid: what a case says of them, and where they are at the start.
//!
//! They are placed when the case is read: so a case is complete, and what does not fit is told at the line that asks for it.

use tremie_geometry::Shape;
use tremie_numerics::DVec3;
use tremie_suspension::{
    Amount, AtWalls, ContactLaw, Coupling, Direction, Form, Freedom, Inclusions, Kind, Method, Order,
    Periods, Region, Scheme, place,
};

use crate::case::{Case, Side};
use crate::check::tidy;
use crate::document::{
    Bound, Choice, Document, Maybe, Name, Need, Or, Quantity, Rule, Section, Variants, Vector, WordOr, maybe,
    need, or,
};
use crate::fault::Fault;
use crate::schema::{BATCH, DIAMETER, LENGTH, SHAPES, quantity};
use crate::units::Dimension;

/// Bodies of one kind that are in the fluid at the start.
#[derive(Debug, Clone, PartialEq)]
pub struct InclusionGroup {
    /// Their kind.
    pub kind: Kind,
    /// How many there are.
    pub amount: Amount,
    /// Where in the fluid they are; everywhere if absent.
    pub region: Option<Shape>,
    /// How they lie.
    pub direction: Direction,
    /// The same seed gives the same places.
    pub seed: u64,
    /// The batch that they belong to, if any.
    pub batch: Option<String>,
}

/// How bodies in the fluid are followed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Following {
    /// Coupling and motion.
    pub method: Method,
    /// What happens when they touch.
    pub contact: ContactLaw,
}

pub(crate) const GROUP: Section<InclusionGroup> = {
    const NAME: Need<Name> = need("name", "what they are called in results", Name { example: "fibres" });
    const DENSITY: Need<Quantity> =
        need("density", "their density", quantity(Dimension::DENSITY, Bound::Positive, "7850 kg/m3"));
    const NUMBER: Maybe<Quantity> =
        maybe("number", "how many there are", quantity(Dimension::NUMBER, Bound::UpTo(1e7), "415"));
    const SHARE: Maybe<Quantity> = maybe(
        "volume_fraction",
        "share of the volume that they take",
        quantity(Dimension::NUMBER, Bound::UpTo(0.6), "0.005"),
    );
    const AMOUNT: Rule = Rule("oneOf", ["number", "volume_fraction"]);
    const WITHIN: Maybe<Section<Shape>> =
        maybe("within", "where in the fluid they are; everywhere if this is absent", REGION);
    const DIRECTION: Or<WordOr<Direction>> = or("direction", "\"isotropic\"", "how they lie", DIRECTIONS);
    const SEED: Or<Quantity> = or(
        "seed",
        "1",
        "a whole number; the same gives the same places",
        quantity(Dimension::NUMBER, Bound::NotNegative, "1"),
    );
    Section {
        keys: &[&NAME, &FORMS, &DENSITY, &NUMBER, &SHARE, &AMOUNT, &WITHIN, &DIRECTION, &SEED, &BATCH],
        example: &[
            "name = \"fibres\"",
            "fibre = { length = \"60 mm\", diameter = \"0.75 mm\" }",
            "density = \"7850 kg/m3\"",
            "volume_fraction = 0.005",
        ],
        read: |t| {
            let (number, seed) = (t.maybe(&NUMBER)?, t.or(&SEED)?);
            for (key, number) in [("number", number), ("seed", Some(seed))] {
                if number.is_some_and(|number| number.fract() != 0.0) {
                    let value = t.value(key).unwrap_or_else(|| t.itself());
                    return Err(value.fault("must be a whole number", "write one without a fraction"));
                }
            }
            let amount = match (number, t.maybe(&SHARE)?) {
                (Some(number), None) => Amount::Number(number as usize),
                (None, Some(share)) => Amount::Share(share),
                (None, None) => {
                    let help = "add volume_fraction = 0.005, say, or a number";
                    return Err(t.itself().fault("does not say how many there are", "").help(help));
                }
                (Some(_), Some(_)) => {
                    let share = t.value("volume_fraction").unwrap_or_else(|| t.itself());
                    return Err(share.fault("says again what the number says", "keep only one of them"));
                }
            };
            Ok(InclusionGroup {
                kind: Kind { name: t.need(&NAME)?, form: t.one_of(&FORMS)?, density: t.need(&DENSITY)? },
                amount,
                region: t.maybe(&WITHIN)?,
                direction: t.or(&DIRECTION)?,
                seed: seed as u64,
                batch: t.maybe(&BATCH)?,
            })
        },
    }
};

const FORMS: Variants<Form> = Variants {
    what: "form",
    sections: &[
        ("sphere", "form: spheres", SPHERE),
        ("ellipsoid", "form: ellipsoids", ELLIPSOID),
        ("fibre", "form: straight fibres", FIBRE),
    ],
};

const SPHERE: Section<Form> = Section {
    keys: &[&DIAMETER],
    example: &["diameter = \"16 mm\""],
    read: |t| Ok(Form::Sphere { diameter: t.need(&DIAMETER)? }),
};

const ELLIPSOID: Section<Form> = {
    const AXES: Need<Vector<3>> = need("axes", "lengths of the three axes", Vector(LENGTH));
    Section {
        keys: &[&AXES],
        example: &["axes = [\"20 mm\", \"16 mm\", \"12 mm\"]"],
        read: |t| Ok(Form::Ellipsoid { half_axes: 0.5 * DVec3::from(t.need(&AXES)?) }),
    }
};

const FIBRE: Section<Form> = {
    const LONG: Need<Quantity> = need("length", "length", LENGTH);
    Section {
        keys: &[&LONG, &DIAMETER],
        example: &["length = \"60 mm\"", "diameter = \"0.75 mm\""],
        read: |t| Ok(Form::Fibre { length: t.need(&LONG)?, diameter: t.need(&DIAMETER)? }),
    }
};

const REGION: Section<Shape> = Section { keys: &[&SHAPES], example: &[], read: |t| t.one_of(&SHAPES) };

const DIRECTIONS: WordOr<Direction> = WordOr {
    words: Choice(&[("isotropic", "in all directions alike", Direction::Isotropic)]),
    table: {
        const VECTOR: Vector<3> = Vector(quantity(Dimension::NUMBER, Bound::Any, "1"));
        const ALONG: Maybe<Vector<3>> = maybe("along", "all along this", VECTOR);
        const ACROSS: Maybe<Vector<3>> =
            maybe("across", "in the plane across this, in all its directions alike", VECTOR);
        Section {
            keys: &[&ALONG, &ACROSS],
            example: &["along = [1, 0, 0]"],
            read: |t| {
                let unit = |v: Option<[f64; 3]>| v.and_then(|v| DVec3::from(v).try_normalize());
                match (unit(t.maybe(&ALONG)?), unit(t.maybe(&ACROSS)?)) {
                    (Some(axis), None) => Ok(Direction::Aligned(axis)),
                    (None, Some(normal)) => Ok(Direction::Planar(normal)),
                    _ => Err(t
                        .itself()
                        .fault("names no direction, or two", "write { along = [1, 0, 0] }, say")),
                }
            },
        }
    },
};

pub(crate) const FOLLOWING: Section<Following> = {
    const COUPLING: Or<Choice<Coupling>> = or(
        "coupling",
        "\"slender\"",
        "how fibres feel the fluid",
        Choice(&[
            ("slender", "by the friction of slender bodies", Coupling::Slender),
            ("svec", "by the correction of the thesis (Svec 2013, Eq. 3.14)", Coupling::Svec),
        ]),
    );
    const MOTION: Or<Choice<Scheme>> = or(
        "motion",
        "\"implicit\"",
        "how bodies move in a step of the fluid",
        Choice(&[
            ("implicit", "by one implicit step", Scheme::Implicit),
            ("fehlberg", "by Runge-Kutta-Fehlberg 4(5) with steps of its own", Scheme::Fehlberg),
        ]),
    );
    const RESTITUTION: Or<Quantity> = or(
        "restitution",
        "0",
        "speed apart over speed of approach when bodies meet",
        quantity(Dimension::NUMBER, Bound::NotNegative, "0.2"),
    );
    const FRICTION: Or<Quantity> = or(
        "friction",
        "0.6",
        "coefficient of friction of bodies that touch",
        quantity(Dimension::NUMBER, Bound::NotNegative, "0.3"),
    );
    Section {
        keys: &[&COUPLING, &MOTION, &RESTITUTION, &FRICTION],
        example: &["coupling = \"slender\""],
        read: |t| {
            let (.., coupling) = *t.or(&COUPLING)?;
            let (.., scheme) = *t.or(&MOTION)?;
            let restitution = t.or(&RESTITUTION)?;
            if restitution > 1.0 {
                let value = t.value("restitution").unwrap_or_else(|| t.itself());
                return Err(value.fault("must not be above 1", "write 0 for bodies that do not bounce"));
            }
            Ok(Following {
                method: Method { coupling, scheme, freedom: Freedom::default() },
                contact: ContactLaw { restitution, friction: t.or(&FRICTION)? },
            })
        },
    }
};

impl Case {
    /// Lengths in m after which the domain repeats itself, along each axis.
    pub fn periods(&self) -> Periods {
        let size = self.domain.max - self.domain.min;
        Periods([0, 1, 2].map(|a| (self.domain.sides[2 * a] == Side::Periodic).then(|| size[a])))
    }
}

/// Cells that a fibre must be long, and another body thick, for the lattice to see it.
const FEWEST_CELLS: [f64; 2] = [3.0, 2.0];

/// Bodies are large enough for the cells, and no longer than half of a period.
fn sizes(group: &InclusionGroup, case: &Case, path: &str, document: &Document<'_>) -> Result<(), Fault> {
    let crate::case::Method::Lbm(lbm) = &case.method;
    let [fibre, other] = FEWEST_CELLS.map(|cells| cells * lbm.cell_size);
    let (key, size, least) = match group.kind.form {
        Form::Fibre { length, .. } => ("fibre.length", length, fibre),
        Form::Sphere { diameter } => ("sphere.diameter", diameter, other),
        Form::Ellipsoid { half_axes } => ("ellipsoid.axes", 2.0 * half_axes.min_element(), other),
    };
    let place = document.locate(&format!("{path}.{key}"));
    if size < least * (1.0 - 1e-9) {
        let problem = format!("the cells are too large to see bodies of {} m", tidy(size));
        let advice = format!("write \"{} m\" at least, or smaller cells", tidy(least));
        return Err(
            Fault::new(place, problem, advice).related(document.find("lbm.cell_size"), "the cell size")
        );
    }
    let longest = 2.0 * group.kind.form.reach();
    if let Some(period) = case.periods().0.into_iter().flatten().find(|period| *period < 2.0 * longest) {
        let problem = format!("the bodies are longer than half of the period of {} m", tidy(period));
        return Err(Fault::new(
            place,
            problem,
            "write less, or let the domain be longer between its periodic sides",
        ));
    }
    Ok(())
}

/// The bodies of a case at the start.
pub(crate) fn placed(case: &Case, document: &Document<'_>) -> Result<Inclusions, Fault> {
    let kinds = case.groups.iter().map(|group| group.kind.clone()).collect();
    let mut bodies = Inclusions { kinds, ..Inclusions::default() };
    let (domain, periods) = (case.domain, case.periods());
    let batches = case.batches();
    for (n, group) in case.groups.iter().enumerate() {
        let path = format!("inclusions.{n}");
        sizes(group, case, &path, document)?;
        // Where there is fluid, in the domain, outside of solids.
        let distance = |p: DVec3| {
            let fluid = case.fluid.iter().map(|region| region.shape.signed_distance(p));
            let mut distance = fluid.fold(f64::INFINITY, f64::min);
            for a in (0..3).filter(|a| periods.0[*a].is_none()) {
                distance = distance.max(domain.min[a] - p[a]).max(p[a] - domain.max[a]);
            }
            for solid in &case.solids {
                let at = p - solid.motion.offset(0.0);
                distance = distance.max(-solid.body.signed_distance(at));
            }
            group.region.map_or(distance, |region| distance.max(region.signed_distance(p)))
        };
        let fluid = case.fluid.iter().map(|region| region.shape.bounds());
        let all = fluid.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((DVec3::ZERO, DVec3::ZERO));
        let mut bounds = (all.0.max(domain.min), all.1.min(domain.max));
        if let Some((low, high)) = group.region.map(|region| region.bounds()) {
            bounds = (bounds.0.max(low), bounds.1.min(high));
        }
        if bounds.0.cmpge(bounds.1).any() {
            let problem = "there is no fluid where these bodies should be";
            return Err(Fault::new(document.locate(&path), problem, "let them be within the fluid"));
        }
        let region = Region { low: bounds.0, high: bounds.1, distance: &distance };
        let batch = group.batch.as_deref().and_then(|name| batches.iter().position(|batch| *batch == name));
        let order = Order {
            kind: n as u16,
            batch: batch.map_or(0, |batch| batch as u16 + 1),
            amount: group.amount,
            direction: group.direction,
            at_walls: AtWalls::default(),
            seed: group.seed,
        };
        place(&mut bodies, &order, &region, &periods).map_err(|error| {
            let advice = "write fewer of them, or give them more room";
            Fault::new(document.locate(&path), format!("the bodies do not fit: {error}"), advice)
        })?;
    }
    Ok(bodies)
}
