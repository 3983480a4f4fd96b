//! Writes one VTK file of each kind, with values known by formula, into the folder given as the only argument;
//! `tests/vtk_read_back.py` reads them with VTK itself.

use std::error::Error;
use std::path::PathBuf;

use tremie_output::pvd::Collection;
use tremie_output::vti::Image;
use tremie_output::vtp::Surface;
use tremie_output::{Field, Values};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: vtk_files FOLDER")?);
    std::fs::create_dir_all(&folder)?;

    let cells = [60, 50, 40];
    let (origin, spacing) = ([-0.3, 0.0, 0.1], [0.01, 0.02, 0.005]);
    let mut collection = Collection::create(&folder.join("fields.pvd"))?;
    for (step, time) in [0.0, 0.25, 0.5].into_iter().enumerate() {
        let mut pressure = Vec::new();
        let mut velocity = Vec::new();
        let mut kind = Vec::new();
        for k in 0..cells[2] {
            for j in 0..cells[1] {
                for i in 0..cells[0] {
                    let centre = |d: usize, n: usize| origin[d] + spacing[d] * (n as f64 + 0.5);
                    let [x, y, z] = [centre(0, i), centre(1, j), centre(2, k)];
                    // pressure = x + 10 y + 100 z + 1000 t, velocity = (x, y, z), kind = layer
                    pressure.push((x + 10.0 * y + 100.0 * z + 1000.0 * time) as f32);
                    velocity.extend([x, y, z]);
                    kind.push(k as u8);
                }
            }
        }
        let image = Image {
            origin,
            spacing,
            cells,
            time,
            fields: vec![
                Field { name: "pressure [Pa]", components: 1, values: Values::F32(&pressure) },
                Field { name: "velocity [m/s]", components: 3, values: Values::F64(&velocity) },
                Field { name: "kind", components: 1, values: Values::U8(&kind) },
            ],
        };
        let name = format!("fields_{step}.vti");
        image.write(&folder.join(&name))?;
        collection.push(time, &name)?;
    }

    // Tetrahedron of volume 0.1 * 0.2 * 0.3 / 6 = 0.001.
    let positions = [[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.3]];
    let surface = Surface {
        positions: &positions,
        triangles: &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        time: 0.5,
        fields: vec![Field {
            name: "speed [m/s]",
            components: 1,
            values: Values::F32(&[1.0, 2.0, 3.0, 4.0]),
        }],
    };
    surface.write(&folder.join("surface.vtp"))?;
    Ok(())
}
