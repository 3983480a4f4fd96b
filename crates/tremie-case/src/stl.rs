//! The STL files that a case names: read, judged and put in their place while the case is read, so that what is wrong with a file
//! is told at the line that names it.
//!
//! STL knows neither units nor shared corners. The case says the unit; corners that agree in all bits are one.

use std::io::Cursor;
use std::sync::Arc;

use tremie_geometry::Body;
use tremie_geometry::isosurface::Mesh;
use tremie_geometry::mesh::{ClosedMesh, Trouble};
use tremie_numerics::{DMat3, DVec3};

use crate::case::{MeshFile, Role};
use crate::document::Value;
use crate::fault::Fault;

/// How a drawing is put in its place.
pub(crate) struct Place {
    /// Name of the drawing's unit, and its length in m.
    pub(crate) unit: &'static str,
    pub(crate) length: f64,
    pub(crate) scale: f64,
    /// Angles about x, y and z in rad.
    pub(crate) rotate: [f64; 3],
    /// Way in m.
    pub(crate) way: DVec3,
}

/// Reads the file at `path`; `value` is where the case names it.
pub(crate) fn read(value: &Value<'_>, path: String, role: Role, place: &Place) -> Result<Body, Fault> {
    let bytes = value.files.read(value, &path, ".stl", "an STL file")?;
    let triangles = triangles(&bytes).map_err(|reason| {
        value
            .fault(format!("is not an STL file: {path}: {reason}"), "export it again, as binary or ASCII STL")
    })?;
    let drawn = place.length * place.scale;
    let mesh = Mesh::weld(triangles.iter().map(|t| t.map(|p| p.map(|x| f64::from(x) * drawn))));
    let mesh = ClosedMesh::new(mesh).map_err(|defect| {
        // Where whoever drew it finds it: in the coordinates and the unit of the file.
        let short = |x: f64| format!("{x:.5e}").parse().unwrap_or(x) + 0.0;
        let [x, y, z] = (defect.place / drawn).to_array().map(short);
        let place = match defect.what {
            Trouble::Empty | Trouble::NotNumbers(_) => String::new(),
            _ => format!(", the first at x = {x}, y = {y}, z = {z} {} of the file", place.unit),
        };
        value.fault(format!("bounds no body: in {path} {}{place}", defect.what), remedy(defect.what))
    })?;
    let mesh = Arc::new(mesh.moved(rotation(place.rotate), place.way));
    value.files.keep(MeshFile { path, mesh: mesh.clone(), role });
    let body = Body::Mesh(mesh);
    Ok(match role {
        Role::Obstacle => body,
        Role::Formwork => Body::Complement(Box::new(body)),
    })
}

/// Turns about x, then y, then z; by right angles exactly.
fn rotation([x, y, z]: [f64; 3]) -> DMat3 {
    let rotation = DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
    let exact = |share: f64| if share.abs() < 1e-15 { 0.0 } else { share };
    DMat3::from_cols_array(&rotation.to_cols_array().map(exact))
}

/// What to do about a mesh that bounds no body.
fn remedy(trouble: Trouble) -> &'static str {
    match trouble {
        Trouble::Empty | Trouble::NotNumbers(_) => "export it again",
        Trouble::ZeroArea(_) => {
            "merge corners that lie on each other where it was drawn, and export it again"
        }
        Trouble::Open(_) => "close the holes where it was drawn, and export it again",
        Trouble::Branching(_) => "unite the parts that touch, or keep them apart, and export it again",
        Trouble::Flipped(_) => "turn all normals outwards where it was drawn, and export it again",
        Trouble::Crossing(_) => "unite the parts that cross into one, or write one solid for each",
        Trouble::Inverted(_) => "turn the normals of this shell, or leave it out",
    }
}

/// Bytes before the facets of a binary file, the last four of them their number; and bytes a facet.
const HEADER: usize = 84;
const FACET: u64 = 50;

/// The corners of all facets; or why it is no STL file.
///
/// A file is binary if its length is that of the facets it announces: many programs begin binary files with `solid` too, the first word
/// of ASCII files.
fn triangles(bytes: &[u8]) -> Result<Vec<[[f32; 3]; 3]>, String> {
    const WORD: &[u8] = b"solid";
    let announced = bytes.get(HEADER - 4..HEADER).and_then(|count| count.try_into().ok());
    let count = announced.map(u32::from_le_bytes);
    let mut bytes = bytes.to_vec();
    if count.is_some_and(|count| HEADER as u64 + FACET * u64::from(count) == bytes.len() as u64) {
        // To `stl_io` the first word tells.
        bytes[..WORD.len()].fill(0);
    } else if bytes.starts_with(WORD) {
        // `stl_io` wants a space after it, even if there is no name.
        bytes.insert(WORD.len(), b' ');
    } else {
        let length = bytes.len();
        return Err(match count {
            Some(count) => format!(
                "it does not begin with \"solid\" as ASCII does, and for {count} binary facets {length} bytes is not its length"
            ),
            None => format!(
                "it does not begin with \"solid\" as ASCII does, and {length} bytes hold no binary facet"
            ),
        });
    }
    let mut file = Cursor::new(bytes);
    let facets = stl_io::create_stl_reader(&mut file).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let shorten = |error: std::io::Error| error.to_string().chars().take(100).collect::<String>();
    Ok(facets.map_err(shorten)?.iter().map(|facet| facet.vertices.map(Into::into)).collect())
}
