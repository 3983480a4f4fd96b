//! Bodies in the fluid: what a case says of them, and where they are at the start.
//!
//! They are placed, or read from a file, when the case is read: so a case is complete, and what does not fit is told at the line that asks for it.

use tremie_geometry::{Face, Shape};
use tremie_numerics::DVec3;
use tremie_suspension::{
    Amount, AtWalls, ContactLaw, Coupling, Direction, Felt, Form, Freedom, Inclusions, Kind, Method, Opening,
    Order, Periods, Region, Scheme, Wall, Walls, passes, place,
};

use crate::case::{Case, Inlet, Side};
use crate::check::tidy;
use crate::document::{
    self, Bound, Choice, Document, List, Maybe, Name, Need, Or, Quantity, Rule, Section, Text, Variants,
    Vector, WordOr, maybe, need, or,
};
use crate::fault::Fault;
use crate::listed::{Listed, Table};
use crate::schema::{BATCH, DIAMETER, LENGTH, SHAPES, quantity};
use crate::units::Dimension;

/// Bodies that are in the fluid at the start.
#[derive(Debug, Clone, PartialEq)]
pub struct InclusionGroup {
    /// What they are called.
    pub name: String,
    /// Their density in kg/m3.
    pub density: f64,
    /// What they are and where.
    pub bodies: Bodies,
    /// The batch that they belong to, if any.
    pub batch: Option<String>,
}

/// What bodies are, and where.
#[derive(Debug, Clone, PartialEq)]
pub enum Bodies {
    /// Of one form, at random.
    Random(Random),
    /// One by one.
    Listed(Listed),
}

/// Bodies of one form at random.
#[derive(Debug, Clone, PartialEq)]
pub struct Random {
    /// Their form.
    pub form: Form,
    /// How many there are.
    pub amount: Amount,
    /// Where in the fluid they are; everywhere if absent.
    pub region: Option<Shape>,
    /// How they lie.
    pub direction: Direction,
    /// The same seed gives the same places.
    pub seed: u64,
}

impl InclusionGroup {
    /// The forms of the bodies.
    pub fn forms(&self) -> &[Form] {
        match &self.bodies {
            Bodies::Random(random) => std::slice::from_ref(&random.form),
            Bodies::Listed(listed) => &listed.forms,
        }
    }
}

/// Bodies of one form at random that come in with the fluid of an inlet.
#[derive(Debug, Clone, PartialEq)]
pub struct Incoming {
    /// What they are called.
    pub name: String,
    /// Their density in kg/m3.
    pub density: f64,
    /// Their form.
    pub form: Form,
    /// Share that they take of the volume that comes in, of fluid and bodies together.
    pub share: f64,
    /// How they lie.
    pub direction: Direction,
    /// The same seed gives the same places.
    pub seed: u64,
}

impl Incoming {
    /// How many have to have come in with a volume in m3 of fluid and bodies together.
    pub fn due(&self, volume: f64) -> u64 {
        (volume * self.share / self.form.volume()) as u64
    }
}

/// How bodies in the fluid are followed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Following {
    /// Coupling and motion.
    pub method: Method,
    /// What happens when they touch.
    pub contact: ContactLaw,
    /// Edge in m of the squares over which the orientation of fibres is gathered; the length of the longest if absent.
    pub region: Option<f64>,
    /// Sections whose fibres are counted; no two have the same name.
    pub sections: Vec<FibreSection>,
}

/// A plane across an axis whose fibres are counted.
#[derive(Debug, Clone, PartialEq)]
pub struct FibreSection {
    /// What it is called.
    pub name: String,
    /// The axis: 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Coordinate of the plane in m.
    pub at: f64,
    /// Corner, with the smallest coordinates in m, of what counts of it; all of it if absent. The coordinate along the axis does not matter.
    pub min: Option<DVec3>,
    /// The corner with the largest.
    pub max: Option<DVec3>,
}

const NAME: Need<Name> = need("name", "what they are called in results", Name { example: "fibres" });
const DENSITY: Need<Quantity> =
    need("density", "their density", quantity(Dimension::DENSITY, Bound::Positive, "7850 kg/m3"));
const SHARE: Quantity = quantity(Dimension::NUMBER, Bound::UpTo(0.6), "0.005");
const DIRECTION: Or<WordOr<Direction>> = or("direction", "\"isotropic\"", "how they lie", DIRECTIONS);
const SEED: Or<Quantity> = or(
    "seed",
    "1",
    "a whole number; the same gives the same places",
    quantity(Dimension::NUMBER, Bound::NotNegative, "1"),
);

/// A number under a key is a whole one.
pub(crate) fn whole(t: &document::Table<'_>, key: &str, number: f64) -> Result<u64, Fault> {
    if number.fract() != 0.0 {
        let value = t.value(key).unwrap_or_else(|| t.itself());
        return Err(value.fault("must be a whole number", "write one without a fraction"));
    }
    Ok(number as u64)
}

pub(crate) const INCOMING: Section<Incoming> = {
    const SHARE_OF_INFLOW: Need<Quantity> = need(
        "volume_fraction",
        "share that they take of the volume that comes in, of fluid and bodies together",
        SHARE,
    );
    Section {
        keys: &[&NAME, &FORMS, &DENSITY, &SHARE_OF_INFLOW, &DIRECTION, &SEED],
        example: &[
            "name = \"fibres\"",
            "fibre = { length = \"60 mm\", diameter = \"0.75 mm\" }",
            "density = \"7850 kg/m3\"",
            "volume_fraction = 0.005",
        ],
        read: |t| {
            Ok(Incoming {
                name: t.need(&NAME)?,
                form: t.one_of(&FORMS)?,
                density: t.need(&DENSITY)?,
                share: t.need(&SHARE_OF_INFLOW)?,
                direction: t.or(&DIRECTION)?,
                seed: whole(t, "seed", t.or(&SEED)?)?,
            })
        },
    }
};

pub(crate) const GROUP: Section<InclusionGroup> = {
    const NUMBER: Maybe<Quantity> =
        maybe("number", "how many there are", quantity(Dimension::NUMBER, Bound::UpTo(1e7), "415"));
    const SHARE_OF_FLUID: Maybe<Quantity> =
        maybe("volume_fraction", "share of the volume that they take", SHARE);
    const AMOUNT: Rule = Rule("oneOf", &["number", "volume_fraction", "csv"]);
    const WITHIN: Maybe<Section<Shape>> =
        maybe("within", "where in the fluid they are; everywhere if this is absent", REGION);
    Section {
        keys: &[
            &NAME,
            &SOURCES,
            &DENSITY,
            &NUMBER,
            &SHARE_OF_FLUID,
            &AMOUNT,
            &WITHIN,
            &DIRECTION,
            &SEED,
            &BATCH,
        ],
        example: &[
            "name = \"fibres\"",
            "fibre = { length = \"60 mm\", diameter = \"0.75 mm\" }",
            "density = \"7850 kg/m3\"",
            "volume_fraction = 0.005",
        ],
        read: |t| {
            let (name, density, batch) = (t.need(&NAME)?, t.need(&DENSITY)?, t.maybe(&BATCH)?);
            let form = match t.one_of(&SOURCES)? {
                Source::Form(form) => form,
                Source::File(table) => {
                    let said = ["number", "volume_fraction", "within", "direction", "seed"];
                    if let Some(value) = said.iter().find_map(|key| t.value(key)) {
                        return Err(value.fault("says again what the file says", "leave it out"));
                    }
                    let value = t.value("csv").unwrap_or_else(|| t.itself());
                    let bodies = Bodies::Listed(table.of_type(&value, &name)?);
                    return Ok(InclusionGroup { name, density, bodies, batch });
                }
            };
            let number = t.maybe(&NUMBER)?.map(|number| whole(t, "number", number)).transpose()?;
            let seed = whole(t, "seed", t.or(&SEED)?)?;
            let amount = match (number, t.maybe(&SHARE_OF_FLUID)?) {
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
            let (region, direction) = (t.maybe(&WITHIN)?, t.or(&DIRECTION)?);
            let bodies = Bodies::Random(Random { form, amount, region, direction, seed });
            Ok(InclusionGroup { name, density, bodies, batch })
        },
    }
};

/// What says of which form bodies are.
enum Source {
    /// The case.
    Form(Form),
    /// A file.
    File(Table),
}

/// A section for a form as one for a source.
macro_rules! source {
    ($form:ident) => {
        Section { keys: $form.keys, example: $form.example, read: |t| Ok(Source::Form(($form.read)(t)?)) }
    };
}

const FORMS: Variants<Form> = Variants {
    what: "form",
    sections: &[
        ("sphere", "form: spheres", SPHERE),
        ("ellipsoid", "form: ellipsoids", ELLIPSOID),
        ("fibre", "form: straight fibres", FIBRE),
    ],
};

const SOURCES: Variants<Source> = Variants {
    what: "form",
    sections: &[
        ("sphere", "form: spheres", source!(SPHERE)),
        ("ellipsoid", "form: ellipsoids", source!(ELLIPSOID)),
        ("fibre", "form: straight fibres", source!(FIBRE)),
        ("csv", "bodies one by one, from a CSV file", CSV),
    ],
};

const CSV: Section<Source> = {
    const FILE: Need<Text> = need(
        "file",
        "path of the file from the folder of the case file, as `tremie export --format csv` writes it; of its types the one of this name counts",
        Text { example: "fibres.csv" },
    );
    Section {
        keys: &[&FILE],
        example: &["file = \"fibres.csv\""],
        read: |t| {
            let value = t.value("file").unwrap_or_else(|| t.itself());
            Ok(Source::File(Table::open(&value, t.need(&FILE)?)?))
        },
    }
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

pub(crate) const FIBRE: Section<Form> = {
    const LONG: Need<Quantity> = need("length", "length", LENGTH);
    Section {
        keys: &[&LONG, &DIAMETER],
        example: &["length = \"60 mm\"", "diameter = \"0.75 mm\""],
        read: |t| Ok(Form::Fibre { length: t.need(&LONG)?, diameter: t.need(&DIAMETER)? }),
    }
};

const REGION: Section<Shape> = Section { keys: &[&SHAPES], example: &[], read: |t| t.one_of(&SHAPES) };

pub(crate) const DIRECTIONS: WordOr<Direction> = WordOr {
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
    const VISCOSITY: Or<Choice<Felt>> = or(
        "viscosity",
        "\"plastic\"",
        "the viscosity that fibres feel",
        Choice(&[
            ("plastic", "the plastic viscosity everywhere", Felt::Plastic),
            (
                "apparent",
                "the apparent viscosity at the shear rate around them: what has not yielded holds them fast",
                Felt::Apparent,
            ),
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
    const REGION_SIZE: Maybe<Quantity> = maybe(
        "region",
        "edge of the squares over which the orientation of fibres is gathered, rounded to whole cells; the length of the longest fibre if absent",
        LENGTH,
    );
    const SECTIONS: Maybe<List<Section<FibreSection>>> =
        maybe("section", "planes whose fibres are counted", List(SECTION));
    Section {
        keys: &[&COUPLING, &VISCOSITY, &MOTION, &RESTITUTION, &FRICTION, &REGION_SIZE, &SECTIONS],
        example: &["coupling = \"slender\""],
        read: |t| {
            let (.., coupling) = *t.or(&COUPLING)?;
            let (.., felt) = *t.or(&VISCOSITY)?;
            let (.., scheme) = *t.or(&MOTION)?;
            let restitution = t.or(&RESTITUTION)?;
            if restitution > 1.0 {
                let value = t.value("restitution").unwrap_or_else(|| t.itself());
                return Err(value.fault("must not be above 1", "write 0 for bodies that do not bounce"));
            }
            Ok(Following {
                method: Method { coupling, felt, scheme, freedom: Freedom::default() },
                contact: ContactLaw { restitution, friction: t.or(&FRICTION)? },
                region: t.maybe(&REGION_SIZE)?,
                sections: t.maybe(&SECTIONS)?.unwrap_or_default(),
            })
        },
    }
};

const SECTION: Section<FibreSection> = {
    const CALLED: Need<Name> = need("name", "what it is called in sections.csv", Name { example: "middle" });
    const AXIS: Need<Choice<usize>> = need(
        "axis",
        "the axis that it lies across",
        Choice(&[("x", "across x", 0), ("y", "across y", 1), ("z", "across z", 2)]),
    );
    const AT: Need<Quantity> = need(
        "at",
        "coordinate of the plane along this axis",
        quantity(Dimension::LENGTH, Bound::Any, "0.3 m"),
    );
    const CORNER: Vector<3> = Vector(quantity(Dimension::LENGTH, Bound::Any, "0.2 m"));
    const LOW: Maybe<Vector<3>> =
        maybe("min", "smallest coordinates of what counts of it; all of it if absent", CORNER);
    const HIGH: Maybe<Vector<3>> =
        maybe("max", "largest coordinates of what counts of it; all of it if absent", CORNER);
    Section {
        keys: &[&CALLED, &AXIS, &AT, &LOW, &HIGH],
        example: &["name = \"middle\"", "axis = \"x\"", "at = \"0.3 m\""],
        read: |t| {
            let (.., axis) = *t.need(&AXIS)?;
            Ok(FibreSection {
                name: t.need(&CALLED)?,
                axis,
                at: t.need(&AT)?,
                min: t.maybe(&LOW)?.map(DVec3::from),
                max: t.maybe(&HIGH)?.map(DVec3::from),
            })
        },
    }
};

impl Case {
    /// Edge in m of the squares over which the orientation of fibres is gathered; none where there are no fibres.
    pub fn fibre_region(&self) -> Option<f64> {
        let length = |form: &Form| match *form {
            Form::Fibre { length, .. } => Some(length),
            Form::Sphere { .. } | Form::Ellipsoid { .. } => None,
        };
        let forms = self.groups.iter().flat_map(InclusionGroup::forms);
        let forms = forms.chain(self.incoming().map(|(_, incoming)| &incoming.form));
        match forms.filter_map(length).reduce(f64::max) {
            Some(longest) => Some(self.following.region.unwrap_or(longest)),
            None => self.fibre_field.map(|field| field.region),
        }
    }

    /// Lengths in m after which the domain repeats itself, along each axis.
    pub fn periods(&self) -> Periods {
        let size = self.domain.max - self.domain.min;
        Periods([0, 1, 2].map(|a| (self.domain.sides[2 * a] == Side::Periodic).then(|| size[a])))
    }
}

/// Cells that a fibre must be long, and another body thick, for the lattice to see it.
const FEWEST_CELLS: [f64; 2] = [3.0, 2.0];

/// Bodies of a form are large enough for the cells, and no longer than half of a period.
fn sizes(form: &Form, case: &Case, path: &str, document: &Document<'_>) -> Result<(), Fault> {
    let resolution = case.method.resolution();
    let [fibre, other] = FEWEST_CELLS.map(|cells| cells * resolution);
    let (key, size, least) = match *form {
        Form::Fibre { length, .. } => ("fibre.length", length, fibre),
        Form::Sphere { diameter } => ("sphere.diameter", diameter, other),
        Form::Ellipsoid { half_axes } => ("ellipsoid.axes", 2.0 * half_axes.min_element(), other),
    };
    // The form stands in the case, or else in a file that it names.
    let file = document.find(&format!("{path}.csv.file"));
    let place = file.unwrap_or_else(|| document.locate(&format!("{path}.{key}")));
    if size < least * (1.0 - 1e-9) {
        let problem = format!("the cells are too large to see bodies of {} m", tidy(size));
        let advice = format!("write \"{} m\" at least, or smaller cells", tidy(least));
        return Err(Fault::new(place, problem, advice)
            .related(document.find(case.method.resolution_key()), "the cell size"));
    }
    let longest = 2.0 * form.reach();
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

/// Sections lie in the domain, have names of their own, and something to count.
pub(crate) fn sections(case: &Case, document: &Document<'_>) -> Result<(), Fault> {
    let path = |n: usize, key: &str| format!("suspension.section.{n}.{key}");
    let sections = &case.following.sections;
    for (n, section) in sections.iter().enumerate() {
        if case.fibre_region().is_none() {
            let problem = "there are no fibres to count in this section";
            let advice = "add [[inclusions]] or [[inlet.inclusions]] with fibres, or leave it out";
            return Err(Fault::new(document.locate(&path(n, "name")), problem, advice));
        }
        if let Some(first) = sections[..n].iter().position(|other| other.name == section.name) {
            let problem = format!("two sections are called `{}`", section.name);
            return Err(Fault::new(document.locate(&path(n, "name")), problem, "write another name")
                .related(document.find(&path(first, "name")), "the first"));
        }
        let (low, high) = (case.domain.min, case.domain.max);
        let axis = section.axis;
        if !(low[axis]..=high[axis]).contains(&section.at) {
            let advice = format!("write \"{} m\" to \"{} m\"", tidy(low[axis]), tidy(high[axis]));
            let problem = "this section lies outside the domain";
            return Err(Fault::new(document.locate(&path(n, "at")), problem, advice));
        }
        let (from, to) = (section.min.unwrap_or(low).max(low), section.max.unwrap_or(high).min(high));
        if (0..3).any(|a| a != axis && from[a] >= to[a]) {
            let key = if section.max.is_some() { "max" } else { "min" };
            let advice = "write a larger max or a smaller min, within the domain";
            let problem = "nothing of this section lies in the domain between min and max";
            return Err(Fault::new(document.locate(&path(n, key)), problem, advice));
        }
    }
    let resolution = case.method.resolution();
    match case.following.region {
        Some(region) if region < resolution * (1.0 - 1e-9) => Err(Fault::new(
            document.locate("suspension.region"),
            "the squares are smaller than a cell",
            format!("write \"{} m\" at least", tidy(resolution)),
        )
        .related(document.find(case.method.resolution_key()), "the cell size")),
        _ => Ok(()),
    }
}

/// Signed distance in m of a place from where bodies can be at the start: negative where there is fluid, in the domain, outside of solids.
fn distance(case: &Case, periods: &Periods, p: DVec3) -> f64 {
    let fluid = case.fluid.iter().map(|region| region.shape.signed_distance(p));
    let mut distance = fluid.fold(f64::INFINITY, f64::min);
    for a in (0..3).filter(|a| periods.0[*a].is_none()) {
        distance = distance.max(case.domain.min[a] - p[a]).max(p[a] - case.domain.max[a]);
    }
    for solid in &case.solids {
        let at = p - solid.motion.offset(0.0);
        distance = distance.max(-solid.body.signed_distance(at));
    }
    distance
}

/// The bodies of a case at the start.
pub(crate) fn placed(case: &Case, document: &Document<'_>) -> Result<Inclusions, Fault> {
    let kind = |group: &InclusionGroup, form: &Form| Kind {
        name: group.name.clone(),
        form: *form,
        density: group.density,
    };
    let kinds = case.groups.iter().flat_map(|group| group.forms().iter().map(|form| kind(group, form)));
    let mut bodies = Inclusions { kinds: kinds.collect(), ..Inclusions::default() };
    if bodies.kinds.len() + case.incoming().count() > usize::from(u16::MAX) {
        let place = document.locate("inclusions");
        return Err(Fault::new(place, "there are too many kinds of bodies", "write fewer sizes"));
    }
    let batches = case.batches();
    let mut first = 0;
    for (n, group) in case.groups.iter().enumerate() {
        let path = format!("inclusions.{n}");
        for form in group.forms() {
            sizes(form, case, &path, document)?;
        }
        let batch = group.batch.as_deref().and_then(|name| batches.iter().position(|batch| *batch == name));
        let batch = batch.map_or(0, |batch| batch as u16 + 1);
        match &group.bodies {
            Bodies::Random(random) => {
                scatter(&mut bodies, random, [first as u16, batch], case, &path, document)?;
            }
            Bodies::Listed(listed) => {
                let periods = case.periods();
                for body in &listed.bodies {
                    if distance(case, &periods, body.position) > 0.0 {
                        let problem = format!(
                            "there is no fluid where a body should be: {}, line {}",
                            listed.path, body.line
                        );
                        let place = document.locate(&format!("{path}.csv.file"));
                        return Err(Fault::new(place, problem, "let its centre be within the fluid"));
                    }
                    let kind = (first + body.form) as u16;
                    bodies.add(kind, batch, body.position, body.orientation);
                }
            }
        }
        first += group.forms().len();
    }
    for (n, inlet) in case.inlets.iter().enumerate() {
        for (k, incoming) in inlet.inclusions.iter().enumerate() {
            let path = format!("inlet.{n}.inclusions.{k}");
            sizes(&incoming.form, case, &path, document)?;
            let resolution = case.method.resolution();
            let mouth = Mouth::new(inlet, case, 0.5 * resolution);
            if !passes(&incoming.form, incoming.direction, &mouth) {
                let problem = "the bodies are too large to come in through the face of the inlet";
                let advice = "write smaller ones, another direction, or a larger face within the domain";
                let find = |path: &str, keys: &[&str]| {
                    keys.iter().find_map(|key| document.find(&format!("{path}.{key}")))
                };
                let form = find(&path, &["sphere", "ellipsoid", "fibre"]);
                let face = find(&format!("inlet.{n}"), &["disc", "rectangle"]);
                let place = form.unwrap_or_else(|| document.locate(&path));
                return Err(Fault::new(place, problem, advice).related(face, "the face"));
            }
        }
    }
    Ok(bodies)
}

/// The face of an inlet as bodies see it before anything else is known.
struct Mouth<'a> {
    face: Face,
    /// What it is in, if it stays where it is.
    case: Option<&'a Case>,
    /// Way in m by which it may lie out of the domain, behind the side that it looks away from.
    touch: f64,
}

impl<'a> Mouth<'a> {
    fn new(inlet: &Inlet, case: &'a Case, touch: f64) -> Self {
        let rests = inlet.above_fill.is_none() && inlet.motion.largest_speed(0.0) == 0.0;
        let face = Face { centre: inlet.face.centre + inlet.motion.offset(inlet.start), ..inlet.face };
        Self { face, case: rests.then_some(case), touch }
    }
}

impl Walls for Mouth<'_> {
    fn nearest(&self, at: DVec3, within: f64) -> Option<Wall> {
        let rim = self.face.rim(at);
        let sides = self.case.into_iter().flat_map(|case| {
            let domain = &case.domain;
            let solid = |side: &usize| matches!(domain.sides[*side], Side::Wall { .. } | Side::Symmetry);
            (0..6).filter(solid).map(move |side| {
                let axis = DVec3::AXES[side / 2];
                match side % 2 {
                    0 => ((at - domain.min).dot(axis), axis),
                    _ => ((domain.max - at).dot(axis), -axis),
                }
            })
        });
        let nearest = sides.fold(rim, |nearest, side| if side.0 < nearest.0 { side } else { nearest });
        let (distance, normal) = nearest;
        (distance < within).then_some(Wall { distance, normal, velocity: DVec3::ZERO })
    }
}

impl Opening for Mouth<'_> {
    fn point(&self, numbers: [f64; 2]) -> Option<DVec3> {
        let at = self.face.point(numbers)?;
        self.case.is_none_or(|case| case.domain.holds(at + self.touch * self.face.direction)).then_some(at)
    }

    fn direction(&self) -> DVec3 {
        self.face.direction
    }

    fn is_wet(&self, _: DVec3) -> bool {
        true
    }
}

/// Places bodies of one kind and batch at random.
fn scatter(
    bodies: &mut Inclusions,
    random: &Random,
    [kind, batch]: [u16; 2],
    case: &Case,
    path: &str,
    document: &Document<'_>,
) -> Result<(), Fault> {
    let (domain, periods) = (case.domain, case.periods());
    let within = |p: DVec3| {
        let distance = distance(case, &periods, p);
        random.region.map_or(distance, |region| distance.max(region.signed_distance(p)))
    };
    let fluid = case.fluid.iter().map(|region| region.shape.bounds());
    let all = fluid.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((DVec3::ZERO, DVec3::ZERO));
    let mut bounds = (all.0.max(domain.min), all.1.min(domain.max));
    if let Some((low, high)) = random.region.map(|region| region.bounds()) {
        bounds = (bounds.0.max(low), bounds.1.min(high));
    }
    if bounds.0.cmpge(bounds.1).any() {
        let problem = "there is no fluid where these bodies should be";
        return Err(Fault::new(document.locate(path), problem, "let them be within the fluid"));
    }
    let region = Region { low: bounds.0, high: bounds.1, distance: &within };
    let order = Order {
        kind,
        batch,
        amount: random.amount,
        direction: random.direction,
        at_walls: AtWalls::default(),
        seed: random.seed,
    };
    place(bodies, &order, &region, &periods).map_err(|error| {
        let advice = "write fewer of them, or give them more room";
        Fault::new(document.locate(path), format!("the bodies do not fit: {error}"), advice)
    })
}
