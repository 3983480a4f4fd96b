//! Bodies one by one from a CSV file, in m: fibres by both ends, others by their centre.
//!
//! The columns are those of `tremie export --format csv`: `id,x1_m,y1_m,z1_m,x2_m,y2_m,z2_m,d_m,type`, and for ellipsoids
//! `axis1_m,axis2_m,axis3_m,turn_x_rad,turn_y_rad,turn_z_rad`; they may stand in any order. `id` and `type` may be absent, and so may the second
//! point, where there are no fibres. A body whose two points are the same is a sphere, or an ellipsoid if it has axes. Ellipsoids are turned
//! about x, then y, then z, all fixed in space.

use tremie_numerics::{DQuat, DVec3, EulerRot};
use tremie_suspension::Form;

use crate::document::Value;
use crate::fault::Fault;

/// The columns that may be there.
const COLUMNS: [&str; 15] = [
    "id",
    "x1_m",
    "y1_m",
    "z1_m",
    "x2_m",
    "y2_m",
    "z2_m",
    "d_m",
    "type",
    "axis1_m",
    "axis2_m",
    "axis3_m",
    "turn_x_rad",
    "turn_y_rad",
    "turn_z_rad",
];
/// Those that must be there.
const NEEDED: [&str; 4] = ["x1_m", "y1_m", "z1_m", "d_m"];
/// As one would begin the file.
const EXAMPLE: &str = "id,x1_m,y1_m,z1_m,x2_m,y2_m,z2_m,d_m,type";
/// Bodies whose sizes agree up to this share have one form: both ends of a fibre tell its length up to rounding only.
const SAME: f64 = 1e-6;
/// More forms than this take too much time as kinds of bodies; fibres that were clipped have a length each.
const MOST_FORMS: usize = 10_000;

/// Bodies from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Listed {
    /// Path of the file from the folder of the case file.
    pub path: String,
    /// The forms that there are.
    pub forms: Vec<Form>,
    /// The bodies.
    pub bodies: Vec<ListedBody>,
}

/// A body from a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListedBody {
    /// Its line in the file, from 1.
    pub line: usize,
    /// Number of its form.
    pub form: usize,
    /// Centre in m.
    pub position: DVec3,
    /// How it is turned.
    pub orientation: DQuat,
}

/// What is wrong with a table: in which line, if in one; what it is; and what to write.
type Wrong = (Option<usize>, String, String);

/// A CSV file whose bodies are still to be read.
pub(crate) struct Table {
    path: String,
    text: String,
}

impl Table {
    /// Opens the file at `path`; `value` is where the case names it.
    pub(crate) fn open(value: &Value<'_>, path: String) -> Result<Self, Fault> {
        let bytes = value.files.read(value, &path, ".csv", "a CSV file")?;
        let text = std::str::from_utf8(&bytes)
            .map_err(|_| value.fault(format!("is no text: {path}"), "save it again as CSV"))?;
        Ok(Self { path, text: text.to_owned() })
    }

    /// The bodies of the type `name`, all of them if the file tells no types.
    pub(crate) fn of_type(self, value: &Value<'_>, name: &str) -> Result<Listed, Fault> {
        let Self { path, text } = self;
        let (forms, bodies) = table(&text, name).map_err(|(line, problem, advice)| {
            let place = line.map(|line| format!(", line {line}")).unwrap_or_default();
            value.fault(format!("holds no such bodies: {path}{place}: {problem}"), advice)
        })?;
        Ok(Listed { path, forms, bodies })
    }
}

/// The bodies of a type in a table, and the forms that they have.
fn table(text: &str, name: &str) -> Result<(Vec<Form>, Vec<ListedBody>), Wrong> {
    // Some programs begin text files with a mark of their encoding.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text.lines().enumerate().map(|(n, line)| (n + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let advice = || format!("write {EXAMPLE} in the first line, and a line for each body");
    let Some((first, header)) = lines.next() else {
        return Err((None, "it is empty".to_owned(), advice()));
    };
    let header: Vec<&str> = header.split(',').map(str::trim).collect();
    let wrong = header
        .iter()
        .enumerate()
        .find(|(n, column)| !COLUMNS.contains(*column) || header[..*n].contains(*column));
    if let Some((_, column)) = wrong {
        let problem = format!("there is no column \"{column}\", or there are two");
        return Err((Some(first), problem, advice()));
    }
    if let Some(column) = NEEDED.iter().find(|column| !header.contains(*column)) {
        return Err((Some(first), format!("the column {column} is missing"), advice()));
    }
    let (mut forms, mut bodies, mut types) = (Vec::new(), Vec::new(), Vec::new());
    for (line, text) in lines {
        let cells: Vec<&str> = text.split(',').map(str::trim).collect();
        if cells.len() != header.len() {
            let problem = format!("it has {} values, not {}", cells.len(), header.len());
            return Err((Some(line), problem, format!("write {}", header.join(","))));
        }
        let row = Row { line, header: &header, cells };
        if let Some(kind) = row.cell("type").filter(|kind| *kind != name) {
            if !types.contains(&kind.to_owned()) {
                types.push(kind.to_owned());
            }
            continue;
        }
        let (form, position, orientation) = row.body()?;
        let form = match forms.iter().position(|other| same(other, &form)) {
            Some(form) => form,
            None if forms.len() == MOST_FORMS => {
                let problem = format!("there are more than {MOST_FORMS} different sizes of bodies");
                return Err((Some(line), problem, "round lengths and diameters".to_owned()));
            }
            None => {
                forms.push(form);
                forms.len() - 1
            }
        };
        bodies.push(ListedBody { line, form, position, orientation });
    }
    match (bodies.is_empty(), types.is_empty()) {
        (false, _) => Ok((forms, bodies)),
        (true, true) => Err((None, "it has no bodies".to_owned(), "write a line for each body".to_owned())),
        (true, false) => Err((
            None,
            format!("none is of the type \"{name}\" after which the bodies are called"),
            format!("let the name be a type of the file, such as \"{}\"", types[0]),
        )),
    }
}

/// Whether two forms differ by rounding only.
fn same(a: &Form, b: &Form) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() <= SAME * b.abs();
    match (*a, *b) {
        (Form::Sphere { diameter: a }, Form::Sphere { diameter: b }) => close(a, b),
        (Form::Ellipsoid { half_axes: a }, Form::Ellipsoid { half_axes: b }) => {
            (0..3).all(|n| close(a[n], b[n]))
        }
        (Form::Fibre { length: a, diameter: c }, Form::Fibre { length: b, diameter: d }) => {
            close(a, b) && close(c, d)
        }
        _ => false,
    }
}

/// A line of the table.
struct Row<'a> {
    line: usize,
    header: &'a [&'a str],
    cells: Vec<&'a str>,
}

impl Row<'_> {
    /// What stands in a column; none if it is empty or absent.
    fn cell(&self, column: &str) -> Option<&str> {
        let n = self.header.iter().position(|other| *other == column)?;
        self.cells.get(n).copied().filter(|cell| !cell.is_empty())
    }

    fn wrong<T>(&self, problem: impl Into<String>, advice: &str) -> Result<T, Wrong> {
        Err((Some(self.line), problem.into(), advice.to_owned()))
    }

    /// Three numbers; none if all three are empty or absent.
    fn vector(&self, columns: [&str; 3]) -> Result<Option<DVec3>, Wrong> {
        if columns.iter().all(|column| self.cell(column).is_none()) {
            return Ok(None);
        }
        let mut numbers = [0.0; 3];
        for (number, column) in numbers.iter_mut().zip(columns) {
            *number = self.number(column)?;
        }
        Ok(Some(numbers.into()))
    }

    fn number(&self, column: &str) -> Result<f64, Wrong> {
        let cell = self.cell(column).unwrap_or_default();
        match cell.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => self.wrong(
                format!("{column} is \"{cell}\", not a number"),
                "write a number without its unit, with a decimal point",
            ),
        }
    }

    /// Form, centre and how it is turned.
    fn body(&self) -> Result<(Form, DVec3, DQuat), Wrong> {
        let point = self.vector(["x1_m", "y1_m", "z1_m"])?;
        let Some(start) = point else { return self.wrong("it has no place", "write x1_m, y1_m and z1_m") };
        let end = self.vector(["x2_m", "y2_m", "z2_m"])?.unwrap_or(start);
        let axes = self.vector(["axis1_m", "axis2_m", "axis3_m"])?;
        if let Some(axes) = axes {
            if axes.cmple(DVec3::ZERO).any() {
                return self.wrong("an axis is not positive", "write a larger one");
            }
            if start != end {
                return self.wrong("it has two ends and axes", "write the centre twice, or no axes");
            }
            let turn = self.vector(["turn_x_rad", "turn_y_rad", "turn_z_rad"])?.unwrap_or(DVec3::ZERO);
            let orientation = DQuat::from_euler(EulerRot::ZYX, turn.z, turn.y, turn.x);
            return Ok((Form::Ellipsoid { half_axes: 0.5 * axes }, start, orientation));
        }
        let diameter = self.number("d_m")?;
        if diameter <= 0.0 {
            return self.wrong("the diameter is not positive", "write a larger one");
        }
        if start == end {
            return Ok((Form::Sphere { diameter }, start, DQuat::IDENTITY));
        }
        let length = (end - start).length();
        let orientation = DQuat::from_rotation_arc(DVec3::Z, (end - start) / length);
        Ok((Form::Fibre { length, diameter }, 0.5 * (start + end), orientation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIBRES: &str = "id,x1_m,y1_m,z1_m,x2_m,y2_m,z2_m,d_m,type\n\
        1,0.1,0,0,0.16,0,0,0.001,steel\n2,0.1,0.1,0.03,0.1,0.1,0.09,0.001,steel\n3,0.2,0.2,0.2,0.2,0.2,0.2,0.016,grains\n";

    #[test]
    fn fibres_and_spheres_are_told_apart_by_their_ends() {
        let (forms, bodies) = table(FIBRES, "steel").unwrap();
        let [Form::Fibre { length, diameter }] = forms[..] else { panic!("{forms:?}") };
        assert!((length - 0.06).abs() < 1e-15 && diameter == 0.001);
        assert_eq!(bodies.iter().map(|body| (body.line, body.form)).collect::<Vec<_>>(), [(2, 0), (3, 0)]);
        assert!((bodies[0].position - DVec3::new(0.13, 0.0, 0.0)).length() < 1e-15);
        assert!((bodies[0].orientation * DVec3::Z - DVec3::X).length() < 1e-15);
        let (forms, bodies) = table(FIBRES, "grains").unwrap();
        assert_eq!(forms, [Form::Sphere { diameter: 0.016 }]);
        assert_eq!(bodies[0].position, DVec3::splat(0.2));
        // Without types all rows count, and columns stand as they like.
        let (forms, _) = table("d_m,z1_m,y1_m,x1_m\n0.02,3,2,1\n0.01,6,5,4\n", "any").unwrap();
        assert_eq!(forms, [0.02, 0.01].map(|diameter| Form::Sphere { diameter }));
    }

    #[test]
    fn ellipsoids_turn_about_fixed_axes() {
        let text = "x1_m,y1_m,z1_m,d_m,axis1_m,axis2_m,axis3_m,turn_x_rad,turn_y_rad,turn_z_rad\n\
            0,0,0,,0.02,0.04,0.06,1.5707963267948966,0,1.5707963267948966\n";
        let (forms, bodies) = table(text, "e").unwrap();
        assert_eq!(forms, [Form::Ellipsoid { half_axes: DVec3::new(0.01, 0.02, 0.03) }]);
        // About x its y goes to z and its z to -y, which goes to x about z.
        let turn = bodies[0].orientation;
        assert!((turn * DVec3::Y - DVec3::Z).length() < 1e-12);
        assert!((turn * DVec3::Z - DVec3::X).length() < 1e-12);
    }

    #[test]
    fn wrong_tables_are_told_with_their_lines() {
        for (old, new, line, says) in [
            (FIBRES, "", None, "it is empty"),
            ("d_m,", "diameter,", Some(1), "no column \"diameter\""),
            ("id,x1_m", "x1_m,x1_m", Some(1), "or there are two"),
            ("d_m,type", "type,id", Some(1), "or there are two"),
            ("x2_m,y2_m,z2_m,d_m", "x2_m,y2_m,z2_m,axis1_m", Some(1), "the column d_m is missing"),
            ("0.001,steel\n2", "0.001\n2", Some(2), "it has 8 values, not 9"),
            ("0.16", "160 mm", Some(2), "x2_m is \"160 mm\", not a number"),
            ("0.16", "inf", Some(2), "not a number"),
            ("0.001,steel\n3", "0,steel\n3", Some(3), "the diameter is not positive"),
            ("steel", "iron", None, "none is of the type \"steel\""),
        ] {
            let (found, problem, _) = table(&FIBRES.replace(old, new), "steel").unwrap_err();
            assert!(problem.contains(says) && found == line, "{problem} in {found:?}, not {says}");
        }
    }
}
