//! What a run writes of bodies beside the bodies themselves: how fibres lie, what goes through sections, and how bodies have segregated.
//!
//! Regions and layers are written with the snapshots of the fields, or once at the end if the case wants none; sections with the readings of
//! the gauges. All are series by time, so that a run which was interrupted goes on in them.

use std::path::Path;

use tremie_case::Case;
use tremie_numerics::DMat3;
use tremie_output::pvd::Collection;
use tremie_output::series::Series;
use tremie_output::vtp::Marks;
use tremie_output::{Error, Field, Values};
use tremie_suspension::Inclusions;
use tremie_suspension::orientation::components;

use crate::folder::RunFolder;
use crate::gauges::{Half, Region, layers, regions, through};
use crate::{Cells, Fluid, Snapshot};

/// The columns of `orientation.csv`. The half is 0 for the lower and 1 for the upper.
const ORIENTATION: [&str; 14] = [
    "time_s",
    "x_m",
    "y_m",
    "z_m",
    "half",
    "number",
    "length_m",
    "a11",
    "a22",
    "a33",
    "a12",
    "a13",
    "a23",
    "volume_share",
];

/// The files of a run.
pub(crate) struct Records {
    /// Of bodies, if there are any.
    segregation: Option<Series>,
    fibres: Option<Fibres>,
}

/// Those of fibres.
struct Fibres {
    /// Edge of the squares in m.
    size: f64,
    orientation: Series,
    /// Points for ParaView, if the case wants snapshots.
    points: Option<Collection>,
    /// Sections, if the case has any.
    sections: Option<Series>,
}

impl Records {
    /// Begins the files, or goes on with them after `time` in s; none where there are no bodies.
    pub(crate) fn begin(
        case: &Case,
        bodies: &Inclusions,
        folder: &RunFolder,
        time: Option<f64>,
    ) -> Result<Option<Self>, Error> {
        let (any, region) = (!bodies.kinds.is_empty(), case.fibre_region());
        if !any && region.is_none() {
            return Ok(None);
        }
        let series = |path: &Path, columns: &[&str]| match time {
            Some(time) => Series::resume(path, columns, time),
            None => Series::create(path, columns),
        };
        let shares = shares(bodies);
        let columns = ["time_s", "layer", "low_m", "high_m", "fluid_m3"].into_iter();
        let columns: Vec<&str> = columns.chain(shares.iter().map(String::as_str)).collect();
        let segregation = any.then(|| series(&folder.segregation(), &columns)).transpose()?;
        let fibres = match region {
            Some(size) => {
                let [table, collection] = folder.orientation();
                let points = match (case.output.snapshot_interval, time) {
                    (None, _) => None,
                    (Some(_), Some(time)) => Some(Collection::resume(&collection, time)?),
                    (Some(_), None) => Some(Collection::create(&collection)?),
                };
                let columns = sections(case);
                let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
                let sections = match columns.len() {
                    1 => None,
                    _ => Some(series(&folder.sections(), &columns)?),
                };
                Some(Fibres { size, orientation: series(&table, &ORIENTATION)?, points, sections })
            }
            None => None,
        };
        Ok(Some(Self { segregation, fibres }))
    }

    /// Writes what goes through sections at `time` in s.
    pub(crate) fn read(&mut self, view: &Snapshot, case: &Case, time: f64) -> Result<(), Error> {
        let Fluid::Cells(cells) = &view.fluid;
        let Some(series) = self.fibres.as_mut().and_then(|fibres| fibres.sections.as_mut()) else {
            return Ok(());
        };
        let values = case.following.sections.iter().flat_map(|section| {
            let through = through(cells, &view.inclusions, section);
            [through.count as f64, through.factor, through.density(), through.area]
        });
        let row: Vec<f64> = std::iter::once(time).chain(values).collect();
        series.append(&row)
    }

    /// Writes regions and layers at `time` in s, the regions for ParaView under this number.
    pub(crate) fn write(
        &mut self,
        view: &Snapshot,
        folder: &RunFolder,
        time: f64,
        number: u64,
    ) -> Result<(), Error> {
        let Fluid::Cells(cells) = &view.fluid;
        let names = names(&view.inclusions);
        let layers = if self.segregation.is_some() { layers(cells, &view.inclusions) } else { Vec::new() };
        for (n, layer) in layers.iter().enumerate() {
            let mut row = vec![time, n as f64, layer.span[0], layer.span[1], layer.fluid];
            row.extend(names.iter().map(|name| {
                let kinds = view.inclusions.kinds.iter().zip(&layer.shares);
                kinds.filter(|(kind, _)| kind.name == *name).map(|(_, share)| share).sum::<f64>()
            }));
            row.push(layer.shares.iter().sum());
            if let Some(segregation) = &mut self.segregation {
                segregation.append(&row)?;
            }
        }
        match &mut self.fibres {
            Some(fibres) => fibres.write(cells, &view.inclusions, folder, time, number),
            None => Ok(()),
        }
    }
}

/// The names of the kinds; kinds of different sizes may have one.
fn names(bodies: &Inclusions) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for kind in &bodies.kinds {
        if !names.contains(&kind.name.as_str()) {
            names.push(&kind.name);
        }
    }
    names
}

/// The columns of the shares in `segregation.csv`: each name, and all together.
fn shares(bodies: &Inclusions) -> Vec<String> {
    names(bodies).into_iter().map(|name| format!("{name}_share")).chain(["bodies_share".to_owned()]).collect()
}

/// The columns of `sections.csv`.
fn sections(case: &Case) -> Vec<String> {
    let columns = case.following.sections.iter().flat_map(|section| {
        ["count", "orientation_factor", "fibres_per_m2", "area_m2"]
            .map(|what| format!("{}_{what}", section.name))
    });
    std::iter::once("time_s".to_owned()).chain(columns).collect()
}

impl Fibres {
    fn write(
        &mut self,
        cells: &Cells,
        bodies: &Inclusions,
        folder: &RunFolder,
        time: f64,
        number: u64,
    ) -> Result<(), Error> {
        let regions = regions(cells, bodies, self.size);
        for region in &regions {
            let half = f64::from(u8::from(region.half == Half::Upper));
            let [x, y, z] = region.centre.to_array();
            let (number, length) = (region.fibres.number as f64, region.fibres.length);
            let tensor = region.tensor().map_or([f64::NAN; 6], |a| components(&a));
            let mut row = vec![time, x, y, z, half, number, length];
            row.extend(tensor);
            row.push(region.share());
            self.orientation.append(&row)?;
        }
        if let Some(points) = &mut self.points {
            let name = format!("orientation_{number:06}.vtp");
            write_points(&regions, time, &folder.path().join(&name))?;
            points.push(time, &name)?;
        }
        Ok(())
    }
}

/// Writes the regions with fibres as points.
fn write_points(regions: &[Region], time: f64, path: &Path) -> Result<(), Error> {
    let known: Vec<(&Region, DMat3)> =
        regions.iter().filter_map(|region| Some((region, region.tensor()?))).collect();
    let points: Vec<[f64; 3]> = known.iter().map(|(region, _)| region.centre.to_array()).collect();
    // VTK has 23 before 13.
    let vtk = |a: &DMat3| {
        let [xx, yy, zz, xy, xz, yz] = components(a);
        [xx, yy, zz, xy, yz, xz]
    };
    let tensors: Vec<f64> = known.iter().flat_map(|(_, a)| vtk(a)).collect();
    let half: Vec<u8> = known.iter().map(|(region, _)| region.half as u8).collect();
    let number: Vec<u32> = known.iter().map(|(region, _)| region.fibres.number as u32).collect();
    let share: Vec<f64> = known.iter().map(|(region, _)| region.share()).collect();
    let one = |name, values| Field { name, components: 1, values };
    let fields = vec![
        Field { name: "orientation tensor", components: 6, values: Values::F64(&tensors) },
        one("half", Values::U8(&half)),
        one("number", Values::U32(&number)),
        one("volume share", Values::F64(&share)),
    ];
    Marks { points: &points, lines: &[], time, fields }.write(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_stand_in_the_order_of_their_names() {
        let a = DMat3::from_cols_array(&[11.0, 12.0, 13.0, 12.0, 22.0, 23.0, 13.0, 23.0, 33.0]);
        assert_eq!(components(&a), [11.0, 22.0, 33.0, 12.0, 13.0, 23.0]);
        let names: Vec<f64> = ORIENTATION[7..13].iter().map(|name| name[1..].parse().unwrap()).collect();
        assert_eq!(components(&a), names[..]);
    }
}
