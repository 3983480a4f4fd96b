//! How a form filled: when each place did, where the fluid came last, where fronts met, where it has stood since, and where air is caught.
//!
//! Looked at whenever the gauges are read, so that times are known within their interval. A cell is filled from the reading at which it is
//! first at least half full; one that no fluid is left in is forgotten, as behind a splash. For each filled cell the largest shear rate of all later
//! readings is kept: a *dead zone* is where that has not been more than a limit (none at all: the place has not yielded since it was filled).

mod air;
mod meeting;

use rayon::prelude::*;
use serde_json::{Value, json};
use tremie_case::{Case, Outlet, Side};
use tremie_numerics::DVec3;
use tremie_numerics::sum::ordered_sum;
use tremie_output::state::Array;

use crate::Cells;

pub use air::Pocket;

/// Fill from which on a cell is filled.
const FILLED: f64 = 0.5;
/// Places that are told where the fluid came last, and how far they are apart, as a share of the form's longest side.
const LAST_PLACES: usize = 5;
const APART: f64 = 0.125;
/// Names of the arrays in a checkpoint.
const ARRAYS: [&str; 3] = ["time of filling", "shear rate since filled", "caught air"];

/// What a case asks for, and the domain as cells; what has been seen so far.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Filling {
    /// Shear rate in 1/s up to which a place is dead.
    dead_rate: f64,
    /// Through which sides air leaves, and in which boxes.
    open: [bool; 6],
    outlets: Vec<Outlet>,
    grid: Grid,
    /// Time in s at which each cell of the domain was filled; not a number where it is not.
    times: Vec<f32>,
    /// Largest shear rate in 1/s read in it since; not a number where there has been no reading.
    rates: Vec<f32>,
    /// Largest share of each cell that was air which was caught.
    caught: Vec<f32>,
}

/// The cells of the domain, and what lies beyond its sides.
#[derive(Debug, Clone, PartialEq)]
struct Grid {
    origin: DVec3,
    size: f64,
    count: [usize; 3],
    symmetry: [[bool; 2]; 3],
    periodic: [bool; 3],
    copies: f64,
}

/// The results.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FillingFigures {
    /// The places that were filled last, each well away from those before: time in s, and place in m.
    pub last: Vec<(f64, DVec3)>,
    /// Volume in m3 of the fluid that stands in dead zones.
    pub dead_volume: f64,
    /// Where air was caught at any time, the largest pocket first.
    pub pockets: Vec<Pocket>,
}

impl Grid {
    /// Number of the cell at a place, which may lie beyond a side where the body goes on.
    fn cell(&self, mut at: [isize; 3]) -> Option<usize> {
        for a in 0..3 {
            let n = self.count[a] as isize;
            if self.periodic[a] {
                at[a] = at[a].rem_euclid(n);
            } else if at[a] < 0 && self.symmetry[a][0] {
                at[a] = -1 - at[a];
            } else if at[a] >= n && self.symmetry[a][1] {
                at[a] = 2 * n - 1 - at[a];
            }
            if !(0..n).contains(&at[a]) {
                return None;
            }
        }
        let [i, j, k] = at.map(|i| i as usize);
        Some(i + self.count[0] * (j + self.count[1] * k))
    }

    fn place(&self, n: usize) -> [usize; 3] {
        let [nx, ny, _] = self.count;
        [n % nx, n / nx % ny, n / (nx * ny)]
    }

    fn centre(&self, n: usize) -> DVec3 {
        self.origin + self.size * (DVec3::from(self.place(n).map(|i| i as f64)) + 0.5)
    }

    fn cells(&self) -> usize {
        self.count.iter().product()
    }
}

/// Where the cells of a snapshot lie among those of the domain.
struct Window<'a> {
    cells: &'a Cells,
    first: [isize; 3],
}

impl<'a> Window<'a> {
    fn new(grid: &Grid, cells: &'a Cells) -> Self {
        let first = ((cells.origin - grid.origin) / grid.size).round();
        Self { cells, first: first.to_array().map(|n| n as isize) }
    }

    /// Number in the snapshot of a cell of the domain, if it is there.
    fn cell(&self, place: [usize; 3]) -> Option<usize> {
        let mut at = [0; 3];
        for a in 0..3 {
            at[a] = place[a].checked_add_signed(-self.first[a])?;
            if at[a] >= self.cells.count[a] {
                return None;
            }
        }
        Some(self.cells.index(at[0], at[1], at[2]))
    }
}

impl Filling {
    /// Nothing seen yet; none if the case does not ask for it. `cells` is any snapshot of the case.
    pub(crate) fn new(case: &Case, cells: &Cells) -> Option<Self> {
        let gauge = case.gauges.filling?;
        let side = |n: usize| case.domain.sides[n];
        let count = ((cells.domain[1] - cells.domain[0]) / cells.size).round();
        let grid = Grid {
            origin: cells.domain[0],
            size: cells.size,
            count: count.to_array().map(|n| n as usize),
            symmetry: cells.symmetry,
            periodic: [0, 1, 2].map(|a| side(2 * a) == Side::Periodic),
            copies: cells.copies(),
        };
        let nothing = vec![f32::NAN; grid.cells()];
        Some(Self {
            dead_rate: gauge.dead_shear_rate,
            // Air is not computed: it leaves upwards in any case.
            open: std::array::from_fn(|n| n == 5 || side(n) == Side::Open),
            outlets: case.outlets.clone(),
            grid,
            times: nothing.clone(),
            caught: vec![0.0; nothing.len()],
            rates: nothing,
        })
    }

    /// Looks at the fluid at a time in s.
    pub(crate) fn see(&mut self, cells: &Cells, time: f64) {
        let Self { grid, times, rates, .. } = self;
        let window = Window::new(grid, cells);
        let layer = grid.count[0] * grid.count[1];
        times.par_chunks_mut(layer).zip(rates.par_chunks_mut(layer)).enumerate().for_each(
            |(k, (times, rates))| {
                for (n, (filled, sheared)) in times.iter_mut().zip(rates).enumerate() {
                    let seen = window.cell(grid.place(k * layer + n)).filter(|n| cells.fill[*n] > 0.0);
                    match seen {
                        None => (*filled, *sheared) = (f32::NAN, f32::NAN),
                        Some(n) if !filled.is_nan() => *sheared = sheared.max(cells.shear_rate[n] as f32),
                        Some(n) if cells.fill[n] >= FILLED => *filled = time as f32,
                        Some(_) => {}
                    }
                }
            },
        );
        let now = air::caught(self, &Window::new(&self.grid, cells));
        for (most, now) in self.caught.iter_mut().zip(now) {
            *most = most.max(now);
        }
    }

    fn is_filled(&self, n: usize) -> bool {
        !self.times[n].is_nan()
    }

    fn is_dead(&self, n: usize) -> bool {
        f64::from(self.rates[n]) <= self.dead_rate
    }

    /// The results for the fluid as it is now.
    pub(crate) fn figures(&self, cells: &Cells) -> FillingFigures {
        let window = Window::new(&self.grid, cells);
        let fill = |n: usize| window.cell(self.grid.place(n)).map_or(0.0, |n| cells.fill[n]);
        let dead: Vec<usize> = (0..self.times.len()).filter(|n| self.is_dead(*n)).collect();
        let cell = self.grid.size.powi(3) * self.grid.copies;
        FillingFigures {
            last: self.last(),
            dead_volume: cell * ordered_sum(&dead, |n| fill(*n)),
            pockets: air::pockets(&self.grid, &self.caught).1,
        }
    }

    /// The places that were filled last. At the start nothing fills.
    fn last(&self) -> Vec<(f64, DVec3)> {
        let longest = self.grid.count.iter().max().copied().unwrap_or(0) as f64 * self.grid.size;
        let mut latest: Vec<usize> = (0..self.times.len()).filter(|n| self.times[*n] > 0.0).collect();
        latest.sort_by(|a, b| self.times[*b].total_cmp(&self.times[*a]).then(a.cmp(b)));
        let mut last: Vec<(f64, DVec3)> = Vec::new();
        for n in latest {
            let place = self.grid.centre(n);
            if last.iter().all(|(_, other)| other.distance(place) > APART * longest) {
                last.push((f64::from(self.times[n]), place));
                if last.len() == LAST_PLACES {
                    break;
                }
            }
        }
        last
    }

    /// What is shown of each cell of a snapshot.
    pub(crate) fn maps(&self, cells: &Cells) -> Maps {
        let window = Window::new(&self.grid, cells);
        let pockets = air::pockets(&self.grid, &self.caught).0;
        let all: Vec<Option<usize>> = (0..cells.fill.len())
            .map(|n| {
                let [nx, ny, _] = cells.count;
                let at = [n % nx, n / nx % ny, n / (nx * ny)];
                let at = [0, 1, 2].map(|a| at[a] as isize + window.first[a]);
                self.grid.cell(at)
            })
            .collect();
        let of = |values: &[f32]| all.iter().map(|n| n.map_or(f32::NAN, |n| values[n])).collect();
        let flags = |holds: &(dyn Fn(usize) -> bool + Sync)| -> Vec<u8> {
            all.par_iter().map(|n| u8::from(n.is_some_and(holds))).collect()
        };
        Maps {
            time: of(&self.times),
            shear_rate: of(&self.rates),
            met: flags(&|n| self.fronts_meet(n)),
            dead: flags(&|n| self.is_dead(n)),
            pocket: all.iter().map(|n| n.map_or(0, |n| pockets[n])).collect(),
        }
    }

    /// Arrays for a checkpoint.
    pub(crate) fn save(&self) -> Vec<(String, Array)> {
        let values = [&self.times, &self.rates, &self.caught];
        ARRAYS.into_iter().zip(values).map(|(name, v)| (name.to_owned(), Array::F32(v.clone()))).collect()
    }

    /// Goes on from the arrays of a checkpoint; the name of one that does not fit otherwise.
    pub(crate) fn restore(&mut self, arrays: &[(String, Array)]) -> Result<(), String> {
        for (name, values) in ARRAYS.into_iter().zip([&mut self.times, &mut self.rates, &mut self.caught]) {
            let saved = arrays.iter().find(|(found, _)| found == name);
            match saved {
                Some((_, Array::F32(saved))) if saved.len() == values.len() => values.clone_from(saved),
                _ => return Err(name.to_owned()),
            }
        }
        Ok(())
    }

    /// Whether this is the name of one of its arrays.
    pub(crate) fn owns(array: &str) -> bool {
        ARRAYS.contains(&array)
    }
}

/// What is shown of each cell of a snapshot.
pub(crate) struct Maps {
    /// Time in s at which it was filled; not a number where it is not.
    pub(crate) time: Vec<f32>,
    /// Largest shear rate in 1/s since.
    pub(crate) shear_rate: Vec<f32>,
    /// 1 where fronts met.
    pub(crate) met: Vec<u8>,
    /// 1 in dead zones.
    pub(crate) dead: Vec<u8>,
    /// Number of the pocket of caught air that it belonged to, from 1, 255 for all from there on; 0 elsewhere.
    pub(crate) pocket: Vec<u8>,
}

impl FillingFigures {
    /// As they stand in `summary.json`.
    pub(crate) fn json(&self) -> Value {
        let place = |p: DVec3| json!(p.to_array());
        let last = self.last.iter().map(|(time, p)| json!({ "time_s": time, "place_m": place(*p) }));
        let pockets = self
            .pockets
            .iter()
            .map(|pocket| json!({ "volume_m3": pocket.volume, "place_m": place(pocket.centre) }));
        json!({
            "last_filled": last.collect::<Vec<_>>(),
            "dead_volume_m3": self.dead_volume,
            "trapped_air": pockets.collect::<Vec<_>>(),
        })
    }

    pub(crate) fn from_json(json: &Value) -> Option<Self> {
        let number = |value: &Value, name: &str| value.get(name)?.as_f64();
        let place = |value: &Value| {
            let place: [f64; 3] = serde_json::from_value(value.get("place_m")?.clone()).ok()?;
            Some(DVec3::from(place))
        };
        let list = |name: &str| json.get(name)?.as_array();
        Some(Self {
            last: list("last_filled")?
                .iter()
                .map(|last| Some((number(last, "time_s")?, place(last)?)))
                .collect::<Option<_>>()?,
            dead_volume: number(json, "dead_volume_m3")?,
            pockets: list("trapped_air")?
                .iter()
                .map(|pocket| Some(Pocket { volume: number(pocket, "volume_m3")?, centre: place(pocket)? }))
                .collect::<Option<_>>()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A form of so many cells of 0.1 m, at its corner the origin, without fluid.
    fn form(count: [usize; 3]) -> Cells {
        let number = count.iter().product();
        Cells {
            size: 0.1,
            count,
            fill: vec![0.0; number],
            shear_rate: vec![0.0; number],
            solid: vec![0; number],
            cage: None,
            domain: [DVec3::ZERO, 0.1 * DVec3::from(count.map(|n| n as f64))],
            ..Cells::default()
        }
    }

    fn watch(cells: &Cells) -> Filling {
        let count = cells.count;
        let grid = Grid {
            origin: DVec3::ZERO,
            size: cells.size,
            count,
            symmetry: cells.symmetry,
            periodic: [false; 3],
            copies: cells.copies(),
        };
        let nothing = vec![f32::NAN; grid.cells()];
        let open = std::array::from_fn(|n| n == 5);
        let caught = vec![0.0; nothing.len()];
        let times = nothing.clone();
        Filling { dead_rate: 0.0, open, outlets: Vec::new(), grid, times, rates: nothing, caught }
    }

    /// A form that has filled, each cell at the time that its place tells, read every second.
    fn filled(cells: &mut Cells, time: impl Fn([usize; 3]) -> f64) -> Filling {
        let mut filling = watch(cells);
        let times: Vec<f64> = (0..cells.fill.len()).map(|n| time(filling.grid.place(n))).collect();
        let last = times.iter().copied().fold(0.0, f64::max);
        for second in 0..=last as usize {
            for (fill, time) in cells.fill.iter_mut().zip(&times) {
                *fill = if *time <= second as f64 { 1.0 } else { 0.0 };
            }
            filling.see(cells, second as f64);
        }
        filling
    }

    /// Places along x at which fronts met, in the row at half the depth and height.
    fn met(cells: &Cells, filling: &Filling) -> Vec<usize> {
        let [nx, ny, nz] = cells.count;
        let met = filling.maps(cells).met;
        (0..nx).filter(|i| met[cells.index(*i, ny / 2, nz / 2)] == 1).collect()
    }

    #[test]
    fn a_front_leaves_the_time_at_which_it_came() {
        let mut cells = form([12, 3, 4]);
        let filling = filled(&mut cells, |[i, ..]| i as f64);
        let maps = filling.maps(&cells);
        assert!((0..12).all(|i| maps.time[cells.index(i, 1, 2)] == i as f32));
        assert!(maps.met.iter().all(|met| *met == 0));
        let last = filling.figures(&cells).last;
        assert_eq!((last[0].0, (10.0 * last[0].1.x - 0.5).round()), (11.0, 11.0));
        // The next are more than an eighth of 1.2 m away, and the form is no wider than that.
        assert!(last.windows(2).all(|pair| pair[0].0 >= pair[1].0 && pair[0].1.distance(pair[1].1) > 0.15));
    }

    #[test]
    fn fronts_from_both_ends_meet_in_the_middle() {
        let mut cells = form([12, 3, 3]);
        let both = filled(&mut cells, |[i, ..]| i.min(11 - i) as f64);
        assert_eq!(met(&cells, &both), [5, 6]);
        let mut odd = form([13, 3, 3]);
        let both = filled(&mut odd, |[i, ..]| i.min(12 - i) as f64);
        assert_eq!(met(&odd, &both), [6]);
    }

    #[test]
    fn a_front_meets_its_image_at_a_symmetry_plane() {
        let mut cells = form([6, 3, 3]);
        cells.symmetry[0][1] = true;
        let one = filled(&mut cells, |[i, ..]| i as f64);
        assert_eq!(met(&cells, &one), [5]);
    }

    #[test]
    fn fronts_meet_if_their_ways_are_more_than_a_right_angle_apart() {
        let ridge = |along: f64, onward: f64| {
            let mut cells = form([13, 9, 1]);
            let time = |[i, j, _]: [usize; 3]| along * i.min(12 - i) as f64 + onward * j as f64;
            let filling = filled(&mut cells, time);
            met(&cells, &filling)
        };
        assert_eq!(ridge(4.0, 2.0), [6]);
        assert!(ridge(2.0, 4.0).is_empty());
    }

    #[test]
    fn a_level_that_rises_unevenly_meets_nothing() {
        let mut cells = form([9, 9, 9]);
        let filling = filled(&mut cells, |[i, j, k]| (10 * k + (5 * i + 3 * j) % 4) as f64);
        assert!(filling.maps(&cells).met.iter().all(|met| *met == 0));
    }

    #[test]
    fn a_place_is_dead_until_it_is_sheared_and_forgotten_when_it_runs_dry() {
        let mut cells = form([3, 1, 1]);
        let mut filling = watch(&cells);
        let mut see = |time: f64, fill: [f64; 3], rate: [f64; 3]| {
            (cells.fill, cells.shear_rate) = (fill.to_vec(), rate.to_vec());
            filling.see(&cells, time);
            (filling.maps(&cells), filling.figures(&cells).dead_volume)
        };
        // It comes with shear; there has been no reading since.
        let (maps, dead) = see(0.0, [1.0, 0.8, 0.4], [2.0, 2.0, 2.0]);
        assert_eq!((maps.dead, dead), (vec![0; 3], 0.0));
        let (maps, dead) = see(1.0, [1.0, 0.8, 1.0], [0.0, 0.5, 1.0]);
        assert_eq!((maps.dead, &maps.time), (vec![1, 0, 0], &vec![0.0, 0.0, 1.0]));
        assert!((dead - 1e-3).abs() < 1e-12);
        let (maps, _) = see(2.0, [1.0, 0.0, 1.0], [0.1, 0.0, 0.0]);
        assert_eq!(maps.dead, [0, 0, 1]);
        assert!(maps.time[1].is_nan() && maps.shear_rate[1].is_nan());
        let (maps, _) = see(3.0, [1.0, 0.6, 1.0], [0.0; 3]);
        assert_eq!((maps.time, maps.shear_rate[0]), (vec![0.0, 3.0, 1.0], 0.1));
    }

    #[test]
    fn air_under_a_lid_is_caught() {
        // Fluid up to the third of five layers, over it a lid of solid with a hole, under which two cells and a half are air.
        let mut cells = form([4, 3, 5]);
        cells.symmetry[1][0] = true;
        for n in 0..cells.fill.len() {
            let k = n / 12;
            (cells.fill[n], cells.solid[n]) = (f64::from(u8::from(k < 3)), u8::from(k == 3));
        }
        let (a, b, c) = (cells.index(1, 1, 2), cells.index(2, 1, 2), cells.index(2, 2, 2));
        (cells.fill[a], cells.fill[b], cells.fill[c]) = (0.0, 0.0, 0.25);
        // The hole is over a corner of the pocket only: no way from face to face.
        let hole = cells.index(1, 2, 3);
        cells.solid[hole] = 0;
        let seen = |cells: &Cells, outlets: &[Outlet]| {
            let mut filling = Filling { outlets: outlets.to_vec(), ..watch(cells) };
            filling.see(cells, 0.0);
            filling
        };
        let mut filling = seen(&cells, &[]);
        let [pocket] = filling.figures(&cells).pockets[..] else { panic!("one pocket") };
        assert!((pocket.volume - 2.0 * 2.75e-3).abs() < 1e-12, "{pocket:?}");
        let x = (0.15 + 0.25 + 0.75 * 0.25) / 2.75;
        assert!((pocket.centre - DVec3::new(x, (2.0 * 0.15 + 0.75 * 0.25) / 2.75, 0.25)).length() < 1e-12);
        assert_eq!(filling.maps(&cells).pocket[b], 1);
        // There is a way up by an outlet at its side.
        let outlet = Outlet { min: DVec3::new(0.2, 0.1, 0.2), max: DVec3::new(0.3, 0.2, 0.3) };
        assert!(seen(&cells, &[outlet]).figures(&cells).pockets.is_empty());
        // Or once half of the cell under the hole empties.
        let under = cells.index(1, 2, 2);
        cells.fill[under] = 0.4;
        assert!(seen(&cells, &[]).figures(&cells).pockets.is_empty());
        // What has been caught stays told, though the fluid closes it.
        cells.fill.fill(1.0);
        filling.see(&cells, 1.0);
        assert_eq!(filling.figures(&cells).pockets, [pocket]);
    }

    #[test]
    fn the_snapshot_may_be_any_box_of_the_domain() {
        let mut cells = form([2, 2, 2]);
        let mut filling = watch(&form([5, 4, 3]));
        (cells.origin, cells.domain) = (DVec3::new(0.2, 0.1, 0.1), [DVec3::ZERO, DVec3::new(0.5, 0.4, 0.3)]);
        cells.fill.fill(1.0);
        filling.see(&cells, 1.0);
        let wet: Vec<usize> = (0..60).filter(|n| filling.is_filled(*n)).collect();
        let expected =
            [[2, 1, 1], [3, 1, 1], [2, 2, 1], [3, 2, 1], [2, 1, 2], [3, 1, 2], [2, 2, 2], [3, 2, 2]];
        assert_eq!(wet, expected.map(|[i, j, k]| i + 5 * (j + 4 * k)));
        assert_eq!(filling.maps(&cells).time, [1.0; 8]);
    }

    #[test]
    fn what_was_seen_is_saved_and_restored() {
        let mut cells = form([4, 3, 2]);
        let filling = filled(&mut cells, |[i, ..]| i as f64);
        let mut other = watch(&cells);
        other.restore(&filling.save()).unwrap();
        assert_eq!(format!("{other:?}"), format!("{filling:?}"));
        let mut small = watch(&form([3, 3, 2]));
        assert_eq!(small.restore(&filling.save()), Err("time of filling".to_owned()));
        assert_eq!(small.restore(&[]), Err("time of filling".to_owned()));
    }
}
