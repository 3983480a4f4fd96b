//! Fields on a uniform grid as VTK ImageData (`.vti`), readable by ParaView.

use std::path::Path;

use crate::Error;
use crate::vtk::{Document, Field};

/// Fields over the cells of a uniform grid at one moment.
#[derive(Debug, Clone)]
pub struct Image<'a> {
    /// Lower corner of the first cell in metres.
    pub origin: [f64; 3],
    /// Edges of a cell in metres.
    pub spacing: [f64; 3],
    /// Number of cells along each axis.
    pub cells: [usize; 3],
    /// Time in seconds.
    pub time: f64,
    /// The fields, one value or vector a cell, x running fastest.
    pub fields: Vec<Field<'a>>,
}

impl Image<'_> {
    /// Writes the file.
    ///
    /// # Errors
    /// If a field has not as many values as the grid has cells, or the file system refuses.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let [nx, ny, nz] = self.cells;
        let extent = format!("0 {nx} 0 {ny} 0 {nz}");
        let list = |v: [f64; 3]| format!("{:?} {:?} {:?}", v[0], v[1], v[2]);
        let attributes = format!(
            " WholeExtent=\"{extent}\" Origin=\"{}\" Spacing=\"{}\"",
            list(self.origin),
            list(self.spacing)
        );
        let mut document = Document::new("ImageData", &attributes, self.time);
        document.line(&format!("<Piece Extent=\"{extent}\">"));
        document.section("CellData", nx * ny * nz, &self.fields)?;
        document.line("</Piece>");
        document.write(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Values;
    use crate::vtk::read_back;

    #[test]
    fn fields_come_back_as_written() {
        let cells = [70, 40, 30];
        let count = cells.iter().product::<usize>();
        // More than one compressed block for the vectors.
        let pressure: Vec<f32> = (0..count).map(|n| (n as f32 * 0.37).sin()).collect();
        let velocity: Vec<f64> = (0..3 * count).map(|n| n as f64 / 7.0).collect();
        let kind: Vec<u8> = (0..count).map(|n| (n % 5) as u8).collect();
        let image = Image {
            origin: [-0.1, 0.25, 1e-9],
            spacing: [0.005, 0.005, 0.0025],
            cells,
            time: 0.1 + 0.2,
            fields: vec![
                Field { name: "pressure [Pa]", components: 1, values: Values::F32(&pressure) },
                Field { name: "velocity [m/s]", components: 3, values: Values::F64(&velocity) },
                Field { name: "kind", components: 1, values: Values::U8(&kind) },
            ],
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fields.vti");
        image.write(&path).unwrap();

        let (xml, arrays) = read_back::arrays(&path);
        assert_eq!(arrays["pressure [Pa]"], bytemuck::cast_slice::<f32, u8>(&pressure));
        assert_eq!(arrays["velocity [m/s]"], bytemuck::cast_slice::<f64, u8>(&velocity));
        assert_eq!(arrays["kind"], kind);
        let document = roxmltree::Document::parse(&xml).unwrap();
        let tag = |name: &str| document.descendants().find(|n| n.has_tag_name(name)).unwrap();
        let numbers = |text: &str| text.split(' ').map(|t| t.parse().unwrap()).collect::<Vec<f64>>();
        assert_eq!(tag("Piece").attribute("Extent"), Some("0 70 0 40 0 30"));
        assert_eq!(numbers(tag("ImageData").attribute("Origin").unwrap()), image.origin);
        assert_eq!(numbers(tag("ImageData").attribute("Spacing").unwrap()), image.spacing);
        let time = document.descendants().find(|n| n.attribute("Name") == Some("TimeValue")).unwrap();
        assert_eq!(numbers(time.text().unwrap()), [image.time]);
    }

    #[test]
    fn a_field_of_the_wrong_length_is_refused() {
        let values = [0.0f32; 11];
        let image = Image {
            origin: [0.0; 3],
            spacing: [1.0; 3],
            cells: [2, 2, 3],
            time: 0.0,
            fields: vec![Field { name: "fill", components: 1, values: Values::F32(&values) }],
        };
        let folder = tempfile::tempdir().unwrap();
        let error = image.write(&folder.path().join("a.vti")).unwrap_err();
        assert!(matches!(error, Error::Length { expected: 12, found: 11, .. }), "{error}");
    }
}
