//! Bodies in the fluid as files: fibres as lines and others as points for ParaView, a table at the end of a run, and the formats of other
//! programs.

use std::path::Path;

use tremie_numerics::{DVec3, EulerRot};
use tremie_output::packing::{self, Frame};
use tremie_output::vtp::Marks;
use tremie_output::{Error, Field, Values, atomic};
use tremie_suspension::orientation::{Block, pieces};
use tremie_suspension::{Form, Inclusions};

/// Length and diameter of a body; of an ellipsoid the longest axis and the diameter of the sphere as large.
fn size(form: &Form) -> [f64; 2] {
    match *form {
        Form::Sphere { diameter } => [diameter; 2],
        Form::Ellipsoid { half_axes } => {
            [2.0 * half_axes.max_element(), 2.0 * half_axes.element_product().cbrt()]
        }
        Form::Fibre { length, diameter } => [length, diameter],
    }
}

/// Writes all bodies as points and lines.
pub(crate) fn write(bodies: &Inclusions, time: f64, path: &Path) -> Result<(), Error> {
    let long = |n: &usize| matches!(bodies.form(*n), Form::Fibre { .. });
    // In the order of their numbers, wherever they are in memory.
    let mut all: Vec<usize> = (0..bodies.len()).collect();
    all.sort_unstable_by_key(|n| (long(n), bodies.id[*n]));
    let points: Vec<[f64; 3]> =
        all.iter().filter(|n| !long(n)).map(|n| bodies.position[*n].to_array()).collect();
    let line = |n: &usize| bodies.ends(*n).map(|ends| ends.map(|end| end.to_array()));
    let lines: Vec<[[f64; 3]; 2]> = all.iter().filter_map(line).collect();
    let scalar = |of: &dyn Fn(usize) -> f64| all.iter().map(|n| of(*n) as f32).collect::<Vec<f32>>();
    let vector =
        |of: &[DVec3]| all.iter().flat_map(|n| of[*n].to_array()).map(|x| x as f32).collect::<Vec<f32>>();
    let number = |of: &dyn Fn(usize) -> u32| all.iter().map(|n| of(*n)).collect::<Vec<u32>>();
    let id = number(&|n| bodies.id[n] as u32);
    let kind = number(&|n| u32::from(bodies.kind[n]));
    let batch = number(&|n| u32::from(bodies.batch[n]));
    let contacts = number(&|n| bodies.contacts[n]);
    let length = scalar(&|n| size(bodies.form(n))[0]);
    let diameter = scalar(&|n| size(bodies.form(n))[1]);
    let axes: Vec<DVec3> = (0..bodies.len()).map(|n| bodies.axis(n)).collect();
    let (axis, velocity) = (vector(&axes), vector(&bodies.velocity));
    let spin = vector(&bodies.angular_velocity);
    fn one<'a>(name: &'a str, values: Values<'a>) -> Field<'a> {
        Field { name, components: 1, values }
    }
    fn three<'a>(name: &'a str, values: &'a [f32]) -> Field<'a> {
        Field { name, components: 3, values: Values::F32(values) }
    }
    let fields = vec![
        one("id", Values::U32(&id)),
        one("kind", Values::U32(&kind)),
        one("batch", Values::U32(&batch)),
        one("contacts", Values::U32(&contacts)),
        one("length [m]", Values::F32(&length)),
        one("diameter [m]", Values::F32(&diameter)),
        three("axis", &axis),
        three("velocity [m/s]", &velocity),
        three("angular velocity [1/s]", &spin),
    ];
    Marks { points: &points, lines: &lines, time, fields }.write(path)
}

/// Writes the end points of all fibres, and the centres of all other bodies, as a table.
pub(crate) fn write_table(bodies: &Inclusions, path: &Path) -> Result<(), Error> {
    let mut all: Vec<usize> = (0..bodies.len()).collect();
    all.sort_unstable_by_key(|n| bodies.id[*n]);
    let mut text = String::from("id,x1_m,y1_m,z1_m,x2_m,y2_m,z2_m,diameter_m,batch,kind\n");
    for n in all {
        let [_, diameter] = size(bodies.form(n));
        let [a, b] = bodies.ends(n).unwrap_or([bodies.position[n]; 2]);
        let name = &bodies.kinds[usize::from(bodies.kind[n])].name;
        let (id, batch) = (bodies.id[n], bodies.batch[n]);
        text.push_str(&format!(
            "{id},{:.9},{:.9},{:.9},{:.9},{:.9},{:.9},{diameter},{batch},{name}\n",
            a.x, a.y, a.z, b.x, b.y, b.z
        ));
    }
    atomic::write(path, text.as_bytes())
}

/// A format that other programs read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Format {
    /// A table of all bodies.
    Csv,
    /// The packing file of OOFEM, in the box of the domain.
    Oofem(Frame),
    /// Fibres for the LDPM workbench of Chrono.
    Ldpm,
    /// Lines and points for ParaView.
    Vtp {
        /// Simulated time in s.
        time: f64,
    },
}

/// Writes bodies in the format of another program, in the order of their numbers.
///
/// # Errors
/// If the file system refuses.
pub fn export(bodies: &Inclusions, format: Format, path: &Path) -> Result<(), Error> {
    let text = match format {
        Format::Csv => packing::csv(&listed(bodies)),
        Format::Oofem(frame) => packing::oofem(&listed(bodies), &frame),
        Format::Ldpm => packing::ldpm(&listed(bodies)),
        Format::Vtp { time } => return write(bodies, time, path),
    };
    atomic::write(path, text.as_bytes())
}

/// Writes the pieces of fibres that lie in a block, in the order of their numbers and in the same format as all bodies as [`Format::Csv`]. They
/// keep the numbers of their fibres.
///
/// # Errors
/// If the file system refuses.
pub fn export_pieces(bodies: &Inclusions, block: &Block, path: &Path) -> Result<(), Error> {
    let mut found = pieces(bodies, block);
    found.sort_unstable_by_key(|piece| bodies.id[piece.body]);
    let listed: Vec<packing::Body> = found
        .into_iter()
        .map(|piece| {
            let [_, diameter] = size(bodies.form(piece.body));
            packing::Body {
                id: bodies.id[piece.body],
                kind: bodies.kinds[usize::from(bodies.kind[piece.body])].name.clone(),
                form: packing::Form::Fibre { ends: piece.ends.map(|end| end.to_array()), diameter },
            }
        })
        .collect();
    atomic::write(path, packing::csv(&listed).as_bytes())
}

/// All bodies as other programs know them.
fn listed(bodies: &Inclusions) -> Vec<packing::Body> {
    let mut all: Vec<usize> = (0..bodies.len()).collect();
    all.sort_unstable_by_key(|n| bodies.id[*n]);
    let form = |n: usize| {
        let centre = bodies.position[n].to_array();
        match *bodies.form(n) {
            Form::Sphere { diameter } => packing::Form::Sphere { centre, diameter },
            Form::Ellipsoid { half_axes } => {
                let (z, y, x) = bodies.orientation[n].to_euler(EulerRot::ZYX);
                packing::Form::Ellipsoid { centre, half_axes: half_axes.to_array(), turn: [x, y, z] }
            }
            Form::Fibre { diameter, .. } => {
                let ends = bodies.ends(n).unwrap_or([bodies.position[n]; 2]);
                packing::Form::Fibre { ends: ends.map(|end| end.to_array()), diameter }
            }
        }
    };
    let kind = |n: usize| bodies.kinds[usize::from(bodies.kind[n])].name.clone();
    all.into_iter().map(|n| packing::Body { id: bodies.id[n], kind: kind(n), form: form(n) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tremie_numerics::DQuat;
    use tremie_suspension::Kind;

    /// Turning about x, then y, then z gives back the body, as a matrix made of its own.
    #[test]
    fn ellipsoids_are_turned_about_fixed_axes() {
        use tremie_numerics::DMat3;
        let form = Form::Ellipsoid { half_axes: DVec3::new(0.01, 0.02, 0.03) };
        let kinds = vec![Kind { name: "gravel".into(), form, density: 2600.0 }];
        let mut bodies = Inclusions { kinds, ..Inclusions::default() };
        let orientation = DQuat::from_scaled_axis(DVec3::new(0.4, -2.0, 0.9));
        bodies.add(0, 0, DVec3::new(0.1, 0.2, 0.3), orientation);
        let packing::Form::Ellipsoid { turn: [x, y, z], .. } = listed(&bodies)[0].form else { panic!() };
        let (c, s) = ([x, y, z].map(f64::cos), [x, y, z].map(f64::sin));
        let about_x = DMat3::from_cols_array(&[1.0, 0.0, 0.0, 0.0, c[0], s[0], 0.0, -s[0], c[0]]);
        let about_y = DMat3::from_cols_array(&[c[1], 0.0, -s[1], 0.0, 1.0, 0.0, s[1], 0.0, c[1]]);
        let about_z = DMat3::from_cols_array(&[c[2], s[2], 0.0, -s[2], c[2], 0.0, 0.0, 0.0, 1.0]);
        let found = about_z * about_y * about_x;
        assert!((found - DMat3::from_quat(orientation)).to_cols_array().iter().all(|x| x.abs() < 1e-12));
    }

    #[test]
    fn the_table_has_the_ends_of_fibres_in_the_order_of_their_numbers() {
        let form = Form::Fibre { length: 0.06, diameter: 0.75e-3 };
        let kinds = vec![Kind { name: "fibres".into(), form, density: 7850.0 }];
        let mut bodies = Inclusions { kinds, ..Inclusions::default() };
        bodies.add(0, 0, DVec3::new(0.1, 0.2, 0.3), DQuat::from_rotation_arc(DVec3::Z, DVec3::X));
        bodies.add(0, 1, DVec3::ZERO, DQuat::IDENTITY);
        bodies.id.swap(0, 1);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bodies.csv");
        write_table(&bodies, &path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[1].starts_with("0,0.000000000,0.000000000,-0.030000000,"), "{}", lines[1]);
        let second =
            "1,0.070000000,0.200000000,0.300000000,0.130000000,0.200000000,0.300000000,0.00075,0,fibres";
        assert_eq!(lines[2], second);
        write(&bodies, 1.0, &folder.path().join("bodies.vtp")).unwrap();
    }
}
