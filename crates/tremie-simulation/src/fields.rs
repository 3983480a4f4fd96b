//! The fields of a snapshot as a file: the fluid's box, in single precision.

use std::path::Path;

use tremie_output::vti::Image;
use tremie_output::{Error, Field, Values};

use crate::Cells;
use crate::filling::Maps;

/// Writes the fill and the fields of the fluid, cropped to the smallest box that holds it.
///
/// The apparent viscosity, stress over shear rate, is 0 where the fluid does not shear; `yielded` tells the two apart.
pub(crate) fn write(cells: &Cells, time: f64, path: &Path) -> Result<(), Error> {
    let (first, count) = wet_box(cells);
    let numbers: Vec<usize> = (0..count[2])
        .flat_map(|k| (0..count[1]).map(move |j| (j, k)))
        .flat_map(|(j, k)| (0..count[0]).map(move |i| cells.index(first[0] + i, first[1] + j, first[2] + k)))
        .collect();
    let scalar =
        |value: &dyn Fn(usize) -> f64| numbers.iter().map(|n| value(*n) as f32).collect::<Vec<f32>>();
    let fill = scalar(&|n| cells.fill[n]);
    let pressure = scalar(&|n| cells.pressure[n]);
    let shear_rate = scalar(&|n| cells.shear_rate[n]);
    let stress = scalar(&|n| cells.stress[n]);
    let sheared = |n: usize| cells.shear_rate[n] > 0.0;
    let viscosity = scalar(&|n| if sheared(n) { cells.stress[n] / cells.shear_rate[n] } else { 0.0 });
    let velocity: Vec<f32> =
        numbers.iter().flat_map(|n| cells.velocity[*n].to_array()).map(|v| v as f32).collect();
    let yielded: Vec<u8> = numbers.iter().map(|n| u8::from(sheared(*n))).collect();
    let shares: Vec<(String, Vec<f32>)> = (cells.batches.iter())
        .map(|(name, shares)| (format!("share of batch {name}"), scalar(&|n| shares[n])))
        .collect();
    let batch: Vec<u8> = numbers.iter().map(|n| cells.batch(*n) as u8).collect();
    let structure = cells.structure.as_ref().map(|structure| scalar(&|n| structure[n]));
    let cage = cells.cage.as_ref().map(|cage| scalar(&|n| cage[n]));
    // VTK has 23 before 13.
    let of = |n: &usize| cells.lying.as_ref().map(|lying| lying.tensors[*n]);
    let tensors: Vec<f32> = (numbers.iter().filter_map(of))
        .flat_map(|[xx, yy, zz, xy, xz, yz]| [xx, yy, zz, xy, yz, xz])
        .map(|a| a as f32)
        .collect();
    let corner = cells.centre(first[0], first[1], first[2]) - 0.5 * cells.size;
    fn one<'a>(name: &'a str, values: &'a [f32]) -> Field<'a> {
        Field { name, components: 1, values: Values::F32(values) }
    }
    let mut fields = vec![
        one("fill", &fill),
        one("pressure [Pa]", &pressure),
        Field { name: "velocity [m/s]", components: 3, values: Values::F32(&velocity) },
        one("shear rate [1/s]", &shear_rate),
        one("stress [Pa]", &stress),
        one("apparent viscosity [Pa s]", &viscosity),
        Field { name: "yielded", components: 1, values: Values::U8(&yielded) },
    ];
    fields.extend(structure.iter().map(|values| one("structure", values)));
    fields.extend(cage.iter().map(|values| one("share in cages", values)));
    if cells.lying.is_some() {
        fields.push(Field { name: "orientation tensor", components: 6, values: Values::F32(&tensors) });
    }
    if !shares.is_empty() {
        fields.push(Field { name: "batch", components: 1, values: Values::U8(&batch) });
    }
    fields.extend(shares.iter().map(|(name, values)| one(name, values)));
    Image { origin: corner.to_array(), spacing: [cells.size; 3], cells: count, time, fields }.write(path)
}

/// Writes how the form has filled, over the whole box of the snapshot.
pub(crate) fn write_filling(cells: &Cells, maps: &Maps, time: f64, path: &Path) -> Result<(), Error> {
    let number = |name, values| Field { name, components: 1, values: Values::F32(values) };
    let flag = |name, values| Field { name, components: 1, values: Values::U8(values) };
    let fill: Vec<f32> = cells.fill.iter().map(|fill| *fill as f32).collect();
    let fields = vec![
        number("fill", &fill),
        number("time of filling [s]", &maps.time),
        number("largest shear rate since filled [1/s]", &maps.shear_rate),
        flag("fronts met", &maps.met),
        flag("dead zone", &maps.dead),
        flag("trapped air", &maps.pocket),
    ];
    Image { origin: cells.origin.to_array(), spacing: [cells.size; 3], cells: cells.count, time, fields }
        .write(path)
}

/// First cell and number of cells along each axis of the smallest box around all fluid.
fn wet_box(cells: &Cells) -> ([usize; 3], [usize; 3]) {
    let [nx, ny, _] = cells.count;
    let (mut first, mut end) = (cells.count, [0; 3]);
    for (n, fill) in cells.fill.iter().enumerate() {
        if *fill > 0.0 {
            let place = [n % nx, n / nx % ny, n / (nx * ny)];
            for a in 0..3 {
                first[a] = first[a].min(place[a]);
                end[a] = end[a].max(place[a] + 1);
            }
        }
    }
    if end[0] == 0 {
        return ([0; 3], [0; 3]);
    }
    (first, [0, 1, 2].map(|a| end[a] - first[a]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_is_cropped_to_the_fluid() {
        let mut cells = Cells { count: [5, 4, 3], fill: vec![0.0; 60], ..Cells::default() };
        assert_eq!(wet_box(&cells), ([0; 3], [0; 3]));
        let (a, b) = (cells.index(1, 2, 0), cells.index(3, 1, 1));
        cells.fill[a] = 0.1;
        cells.fill[b] = 1.0;
        assert_eq!(wet_box(&cells), ([1, 1, 0], [3, 2, 2]));
    }
}
