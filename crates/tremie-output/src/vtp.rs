//! Triangle meshes, lines and points as VTK PolyData (`.vtp`), readable by ParaView.

use std::path::Path;

use crate::Error;
use crate::vtk::{Document, Field};

/// A triangle mesh with fields over its vertices at one moment.
#[derive(Debug, Clone)]
pub struct Surface<'a> {
    /// Vertex positions in metres.
    pub positions: &'a [[f64; 3]],
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// Time in seconds.
    pub time: f64,
    /// The fields, one value or vector a vertex.
    pub fields: Vec<Field<'a>>,
}

impl Surface<'_> {
    /// Writes the file.
    ///
    /// # Errors
    /// If a triangle refers to a missing vertex, a field has not as many values as there are vertices, or the file
    /// system refuses.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let count = self.positions.len();
        if let Some(&index) = self.triangles.as_flattened().iter().find(|&&index| index as usize >= count) {
            return Err(Error::Vertex { index, count });
        }
        let mut document = Document::new("PolyData", "", self.time);
        document.line(&format!(
            "<Piece NumberOfPoints=\"{count}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" \
             NumberOfPolys=\"{}\">",
            self.triangles.len()
        ));
        document.section("PointData", count, &self.fields)?;
        document.line("<Points>");
        document.array("Points", 3, "Float64", bytemuck::cast_slice(self.positions));
        document.line("</Points>");
        cells(&mut document, "Polys", self.triangles);
        document.line("</Piece>");
        document.write(path)
    }
}

/// Points and straight lines, with fields over them, at one moment.
#[derive(Debug, Clone)]
pub struct Marks<'a> {
    /// Positions of single points in metres.
    pub points: &'a [[f64; 3]],
    /// Both ends of each line in metres.
    pub lines: &'a [[[f64; 3]; 2]],
    /// Time in seconds.
    pub time: f64,
    /// The fields: one value or vector for each point, and then for each line.
    pub fields: Vec<Field<'a>>,
}

impl Marks<'_> {
    /// Writes the file.
    ///
    /// # Errors
    /// If a field has not as many values as there are points and lines, or the file system refuses.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let single = self.points.len() as u32;
        let ends = self.lines.as_flattened();
        let points: Vec<[u32; 1]> = (0..single).map(|n| [n]).collect();
        let lines: Vec<[u32; 2]> =
            (0..self.lines.len() as u32).map(|n| [single + 2 * n, single + 2 * n + 1]).collect();
        let mut document = Document::new("PolyData", "", self.time);
        document.line(&format!(
            "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" \
             NumberOfPolys=\"0\">",
            self.points.len() + ends.len(),
            points.len(),
            lines.len()
        ));
        document.section("CellData", points.len() + lines.len(), &self.fields)?;
        document.line("<Points>");
        document.array("Points", 3, "Float64", bytemuck::cast_slice(&[self.points, ends].concat()));
        document.line("</Points>");
        cells(&mut document, "Verts", &points);
        cells(&mut document, "Lines", &lines);
        document.line("</Piece>");
        document.write(path)
    }
}

/// Adds cells of one kind, by their points.
fn cells<const N: usize>(document: &mut Document, kind: &str, cells: &[[u32; N]]) {
    // VTK keeps 64-bit indices, and would convert others while reading.
    let connectivity: Vec<i64> = cells.as_flattened().iter().map(|&i| i64::from(i)).collect();
    let offsets: Vec<i64> = (1..=cells.len() as i64).map(|n| N as i64 * n).collect();
    document.line(&format!("<{kind}>"));
    document.array("connectivity", 1, "Int64", bytemuck::cast_slice(&connectivity));
    document.array("offsets", 1, "Int64", bytemuck::cast_slice(&offsets));
    document.line(&format!("</{kind}>"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Values;
    use crate::vtk::read_back;

    #[test]
    fn a_mesh_comes_back_as_written() {
        let positions = [[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.3]];
        let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let speed = [1.0f32, 2.0, 3.0, 4.0];
        let surface = Surface {
            positions: &positions,
            triangles: &triangles,
            time: 2.0,
            fields: vec![Field { name: "speed [m/s]", components: 1, values: Values::F32(&speed) }],
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("surface.vtp");
        surface.write(&path).unwrap();

        let (xml, arrays) = read_back::arrays(&path);
        assert!(xml.contains("NumberOfPoints=\"4\"") && xml.contains("NumberOfPolys=\"4\""));
        assert_eq!(arrays["Points"], bytemuck::cast_slice::<[f64; 3], u8>(&positions));
        assert_eq!(arrays["speed [m/s]"], bytemuck::cast_slice::<f32, u8>(&speed));
        let connectivity = triangles.as_flattened().iter().map(|&i: &u32| i64::from(i)).collect::<Vec<_>>();
        assert_eq!(arrays["connectivity"], bytemuck::cast_slice::<i64, u8>(&connectivity));
        assert_eq!(arrays["offsets"], bytemuck::cast_slice::<i64, u8>(&[3, 6, 9, 12]));
    }

    #[test]
    fn points_and_lines_come_back_as_written() {
        let (points, lines) = ([[0.5; 3]], [[[0.0; 3], [0.1, 0.0, 0.0]], [[0.2; 3], [0.3; 3]]]);
        let length = [0.0f32, 0.1, 0.2];
        let fields = vec![Field { name: "length [m]", components: 1, values: Values::F32(&length) }];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("marks.vtp");
        Marks { points: &points, lines: &lines, time: 2.0, fields }.write(&path).unwrap();
        let (xml, arrays) = read_back::arrays(&path);
        assert!(xml.contains("NumberOfPoints=\"5\" NumberOfVerts=\"1\" NumberOfLines=\"2\""));
        assert_eq!(arrays["length [m]"], bytemuck::cast_slice::<f32, u8>(&length));
        assert_eq!(arrays["Points"][..24], bytemuck::cast_slice::<f64, u8>(&[0.5; 3])[..]);
    }

    #[test]
    fn a_missing_vertex_is_refused() {
        let surface =
            Surface { positions: &[[0.0; 3]; 3], triangles: &[[0, 1, 3]], time: 0.0, fields: Vec::new() };
        let folder = tempfile::tempdir().unwrap();
        let error = surface.write(&folder.path().join("a.vtp")).unwrap_err();
        assert!(matches!(error, Error::Vertex { index: 3, count: 3 }), "{error}");
    }
}
