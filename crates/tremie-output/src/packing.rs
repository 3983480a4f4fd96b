//! Bodies in the formats that other programs read.
//!
//! - CSV, all bodies: `id,x1_m,y1_m,z1_m,x2_m,y2_m,z2_m,d_m,type`, both ends of a fibre, twice the centre of others. Where there are
//!   ellipsoids the columns `axis1_m,axis2_m,axis3_m,turn_x_rad,turn_y_rad,turn_z_rad` follow, empty for other bodies; their d is that of the sphere as large.
//! - The packing file of the lattice tools of OOFEM (`aggregate`, `converter`), in m from the box's lower corner; fibres, spheres and ellipsoids.
//! - The file of fibres from computed tomography of the LDPM workbench of Chrono: three lines of header, then `id x1 y1 z1 x2 y2 z2` in mm.
//!
//! Angles turn about x, then y, then z, all fixed in space. Numbers are written such that reading gives back the same bits, but those in mm.

use std::fmt::Write as _;

/// A body.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Its number.
    pub id: u64,
    /// What its kind is called; no comma in it.
    pub kind: String,
    /// Its form and place, in m.
    pub form: Form,
}

/// The form and place of a body, in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// A sphere.
    Sphere {
        /// Centre.
        centre: [f64; 3],
        /// Diameter.
        diameter: f64,
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Centre.
        centre: [f64; 3],
        /// Half-axes.
        half_axes: [f64; 3],
        /// Angles in rad by which it has been turned about x, then y, then z.
        turn: [f64; 3],
    },
    /// A straight fibre.
    Fibre {
        /// Both ends.
        ends: [[f64; 3]; 2],
        /// Diameter.
        diameter: f64,
    },
}

/// The box that bodies are in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Lower corner in m.
    pub low: [f64; 3],
    /// Lengths of the sides in m.
    pub size: [f64; 3],
    /// Whether it repeats itself along each axis.
    pub periodic: [bool; 3],
}

/// Numbers with a separator between them.
fn joined<const N: usize>(numbers: [f64; N], separator: &str) -> String {
    numbers.map(|x| x.to_string()).join(separator)
}

/// All bodies as CSV.
pub fn csv(bodies: &[Body]) -> String {
    let long = bodies.iter().any(|body| matches!(body.form, Form::Ellipsoid { .. }));
    let mut text = String::from("id,x1_m,y1_m,z1_m,x2_m,y2_m,z2_m,d_m,type");
    text.push_str(if long { ",axis1_m,axis2_m,axis3_m,turn_x_rad,turn_y_rad,turn_z_rad\n" } else { "\n" });
    for Body { id, kind, form } in bodies {
        let (ends, diameter, more) = match *form {
            Form::Sphere { centre, diameter } => ([centre; 2], diameter, None),
            Form::Ellipsoid { centre, half_axes, turn } => {
                let [a, b, c] = half_axes;
                ([centre; 2], 2.0 * (a * b * c).cbrt(), Some((half_axes.map(|a| 2.0 * a), turn)))
            }
            Form::Fibre { ends, diameter } => (ends, diameter, None),
        };
        let ends = ends.map(|end| joined(end, ",")).join(",");
        // Writing to a string cannot fail.
        let _ = write!(text, "{id},{ends},{diameter},{kind}");
        text.push_str(&match more {
            Some((axes, turn)) => format!(",{},{}\n", joined(axes, ","), joined(turn, ",")),
            None if long => ",,,,,,\n".to_owned(),
            None => "\n".to_owned(),
        });
    }
    text
}

/// All bodies as a packing file of OOFEM. Each form counts its own numbers, from 1.
pub fn oofem(bodies: &[Body], frame: &Frame) -> String {
    let flags = frame.periodic.map(|periodic| if periodic { "1" } else { "0" }).join(" ");
    let mut text = format!("# packing v1\n# box {}\n# periodicity {flags}\n", joined(frame.size, " "));
    let place = |at: [f64; 3]| joined([0, 1, 2].map(|a| at[a] - frame.low[a]), " ");
    let mut numbers = [0; 3];
    let mut next = |form: usize| {
        numbers[form] += 1;
        numbers[form]
    };
    for Body { form, .. } in bodies {
        let line = match *form {
            Form::Sphere { centre, diameter } => {
                format!("sphere {} centre 3 {} radius {}\n", next(0), place(centre), 0.5 * diameter)
            }
            Form::Ellipsoid { centre, half_axes, turn } => format!(
                "ellipsoid {} centre 3 {} angles 3 {} radii 3 {}\n",
                next(1),
                place(centre),
                joined(turn, " "),
                joined(half_axes, " ")
            ),
            Form::Fibre { ends: [a, b], diameter } => {
                format!("fibre {} endpointcoords 6 {} {} diameter {diameter}\n", next(2), place(a), place(b))
            }
        };
        text.push_str(&line);
    }
    text
}

/// The fibres as a file for the LDPM workbench of Chrono, in mm.
pub fn ldpm(bodies: &[Body]) -> String {
    let mut text = String::from("// Fibres as both ends of each\n// mm\n// id x1 y1 z1 x2 y2 z2\n");
    for body in bodies {
        if let Form::Fibre { ends, .. } = body.form {
            let ends = ends.map(|end| joined(end.map(|x| 1e3 * x), " ")).join(" ");
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{} {ends}", body.id);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENDS: [[f64; 3]; 2] = [[0.1, 0.2 + 1e-17, 1.0 / 3.0], [-0.1, 1e-9, 0.25]];

    fn bodies() -> Vec<Body> {
        let fibre = Form::Fibre { ends: ENDS, diameter: 7.5e-4 };
        let sphere = Form::Sphere { centre: [0.1, 0.2, 0.7 / 3.0], diameter: 0.016 };
        let ellipsoid =
            Form::Ellipsoid { centre: [0.3; 3], half_axes: [0.01, 0.02, 0.03], turn: [0.5, -1.0, 3.0] };
        let body = |id, kind: &str, form| Body { id, kind: kind.to_owned(), form };
        vec![
            body(3, "steel", fibre),
            body(7, "grains", sphere),
            body(8, "gravel", ellipsoid),
            body(9, "steel", fibre),
        ]
    }

    /// The numbers of a line after so many words, as a reader finds them.
    fn numbers(line: &str, words: &[&str]) -> Vec<f64> {
        let parts: Vec<&str> = line.split_whitespace().collect();
        assert_eq!(parts[..words.len()], *words, "{line}");
        parts[words.len()..].iter().filter_map(|part| part.parse().ok()).collect()
    }

    #[test]
    fn the_table_gives_back_all_bits() {
        let bodies = bodies();
        let text = csv(&bodies);
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].starts_with("id,x1_m,y1_m,z1_m,x2_m,y2_m,z2_m,d_m,type,axis1_m"));
        assert!(lines.iter().all(|line| line.matches(',').count() == 14), "{text}");
        let cells: Vec<&str> = lines[1].split(',').collect();
        let found: Vec<f64> = cells[1..8].iter().map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(found, [ENDS.as_flattened(), &[7.5e-4]].concat());
        assert_eq!((cells[0], cells[8]), ("3", "steel"));
        assert!(lines[3].ends_with(",gravel,0.02,0.04,0.06,0.5,-1,3"));
        let plain = csv(&bodies[..2]);
        assert!(plain.lines().all(|line| line.matches(',').count() == 8), "{plain}");
    }

    #[test]
    fn oofem_reads_metres_from_the_corner_of_the_box() {
        let frame = Frame { low: [-0.5, 0.0, 0.0], size: [1.0, 0.5, 0.25], periodic: [true, false, true] };
        let text = oofem(&bodies(), &frame);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[..3], ["# packing v1", "# box 1 0.5 0.25", "# periodicity 1 0 1"]);
        let fibre = numbers(lines[3], &["fibre", "1", "endpointcoords", "6"]);
        let [a, b] = ENDS;
        assert_eq!(fibre, [a[0] + 0.5, a[1], a[2], b[0] + 0.5, b[1], b[2], 7.5e-4]);
        assert_eq!(numbers(lines[4], &["sphere", "1", "centre", "3"]), [0.6, 0.2, 0.7 / 3.0, 0.008]);
        let ellipsoid = numbers(lines[5], &["ellipsoid", "1", "centre", "3"]);
        assert_eq!(ellipsoid, [0.8, 0.3, 0.3, 3.0, 0.5, -1.0, 3.0, 3.0, 0.01, 0.02, 0.03]);
        numbers(lines[6], &["fibre", "2", "endpointcoords", "6"]);
    }

    #[test]
    fn ldpm_reads_millimetres_after_three_lines() {
        let text = ldpm(&bodies());
        let rows: Vec<Vec<f64>> = text.lines().skip(3).map(|line| numbers(line, &[])).collect();
        assert_eq!(rows.len(), 2);
        assert_eq!((rows[0].len(), rows[0][0], rows[1][0]), (7, 3.0, 9.0));
        for (found, metres) in rows[0][1..].iter().zip(ENDS.as_flattened()) {
            assert!((found - 1e3 * metres).abs() <= 1e-12 * found.abs());
        }
    }
}
