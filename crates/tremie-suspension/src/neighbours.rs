//! Which bodies may touch: a list of pairs that serves for several steps (Verlet 1967).
//!
//! A long thin fibre in a grid of cells of its own length finds hundreds of others that it will never meet. So fibres are cut into pieces
//! a few diameters long, every piece lies in the cell of its middle, and pieces in neighbouring cells are compared. Pieces of very
//! different sizes lie in different grids, each twice as coarse as the one before; a small body looks into the coarser grids,
//! never the other way. The pairs are those nearer than a skin. They serve until bodies may have moved against each other by as much,
//! which is known for each region, and the skin is as thick as the motion in the region asks for (module `regions`). Bodies that come later are compared with all
//! others.

use std::ops::RangeInclusive;

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::Periods;
use crate::distance::{Outline, nearest_of_segments};
use crate::regions::Regions;

/// Steps that a list of pairs lasts, if it may.
const LASTS: f64 = 64.0;

/// Bodies that come later are compared with all others as long as they are less than one in so many of them.
const FEW: usize = 64;

/// Bodies in one piece of parallel work.
pub(crate) const CHUNK: usize = 256;

/// Pairs of bodies that may touch.
#[derive(Debug, Clone, Default)]
pub(crate) struct Neighbours {
    /// What the list holds: pairs nearer than this, in m, when it was made, for a body of each region.
    skins: Vec<f64>,
    /// Centres and half segments when it was made.
    then: Vec<(DVec3, DVec3)>,
    /// How far centres have moved since, and ends against these, in m.
    moved: Vec<(DVec3, f64)>,
    regions: Regions,
    /// The bodies that it was made for.
    ids: Vec<u64>,
    /// Where the partners of each body start.
    starts: Vec<u32>,
    /// Partners, each pair once, with the body that has the smaller pieces or comes first; and how far away they were then, in m.
    partners: Vec<(u32, f64)>,
    /// How near in m partners count, of a body of each region.
    ranges: Vec<f64>,
}

impl Neighbours {
    /// Number of bodies.
    pub(crate) fn len(&self) -> usize {
        self.ids.len()
    }

    /// Partners of a body that can be within range.
    pub(crate) fn of(&self, n: usize) -> impl Iterator<Item = u32> {
        let partners = &self.partners[self.starts[n] as usize..self.starts[n + 1] as usize];
        let (way, turn) = self.moved[n];
        let range = self.ranges[self.regions.homes[n] as usize];
        partners.iter().filter_map(move |&(partner, away)| {
            let (other, turned) = self.moved[partner as usize];
            let near = range + turn + turned;
            (away < near || away < near + (way - other).length()).then_some(partner)
        })
    }

    /// Makes the list hold all pairs nearer than `range` + the halos of both + the way they may approach each other: by the `ways` of both,
    /// and what comes to these by turning. When it must be made anew, it is made to last for some such ways, as far as `spare` allows.
    ///
    /// `halo` is in m and for spheres only: how far they feel each other. All is in m.
    #[expect(clippy::too_many_arguments)]
    pub(crate) fn update(
        &mut self,
        ids: &[u64],
        outlines: &[Outline],
        periods: &Periods,
        halo: f64,
        range: f64,
        spare: RangeInclusive<f64>,
        ways: impl Fn(usize) -> (DVec3, f64) + Sync,
    ) {
        let known = self.ids.len();
        if known > 0 && ids.starts_with(&self.ids) && (ids.len() - known) * FEW <= known {
            (outlines[..known].par_iter(), &self.then)
                .into_par_iter()
                .with_min_len(CHUNK)
                .map(|(now, then)| {
                    // Ellipsoids are found by their outer sphere, which does not turn.
                    (periods.shortest(now.centre - then.0), (now.half - then.1).length())
                })
                .collect_into_vec(&mut self.moved);
            for n in known..ids.len() {
                self.add(n, outlines, periods, halo);
            }
            self.ids.extend_from_slice(&ids[known..]);
            let furthest = self.moved.iter().map(|moved| moved.0.length() + moved.1).fold(0.0, f64::max);
            if furthest < self.regions.allowed {
                self.ranges = self.regions.against_each_other(&ways);
                self.ranges.iter_mut().for_each(|own| *own += range);
                let moved = self.regions.against_each_other(|n| self.moved[n]);
                let mut all = self.ranges.iter().zip(&moved).zip(&self.skins);
                if all.all(|((range, moved), skin)| range + moved <= *skin) {
                    return;
                }
            }
        }
        let furthest =
            (0..outlines.len()).map(&ways).map(|(way, turn)| way.length() + turn).fold(0.0, f64::max);
        let widest = range + 2.0 * furthest + spare.end();
        // The list will hardly last longer than this.
        let allowed = (LASTS * furthest).max(*spare.end());
        self.regions = Regions::new(outlines, periods, widest + 2.0 * halo, allowed);
        let ways = self.regions.against_each_other(ways);
        self.ranges = ways.iter().map(|way| range + way).collect();
        let skin = |way: &f64| range + way + (LASTS * way).clamp(*spare.start(), *spare.end());
        self.skins = ways.iter().map(skin).collect();
        self.ids.clear();
        self.ids.extend_from_slice(ids);
        self.then.clear();
        self.then.extend(outlines.iter().map(|outline| (outline.centre, outline.half)));
        self.moved.clear();
        self.moved.resize(outlines.len(), (DVec3::ZERO, 0.0));
        self.search(outlines, periods, halo);
    }

    /// Adds a body after those that are there, by comparing it with all of them.
    ///
    /// It counts as having moved as the nearest of them has: so what it moves against those that it came with stays little.
    fn add(&mut self, n: usize, outlines: &[Outline], periods: &Periods, halo: f64) {
        let new = &outlines[n];
        let way = |other: usize| periods.shortest(outlines[other].centre - new.centre);
        let nearest = (0..n).min_by(|a, b| way(*a).length_squared().total_cmp(&way(*b).length_squared()));
        let way_before = nearest.map_or(DVec3::ZERO, |other| self.moved[other].0);
        self.then.push((new.centre - way_before, new.half));
        self.moved.push((way_before, 0.0));
        self.regions.add(&outlines[n..=n]);
        let skin = self.skins[self.regions.homes[n] as usize];
        let reach = new.reach() + halo + skin;
        for other in 0..n {
            let q = &outlines[other];
            let way = way(other);
            let (before, turned) = self.moved[other];
            // As if it had been there from the beginning, and they had come towards each other ever since.
            let since = (before - way_before).length() + turned;
            if way.length_squared() < (reach + q.reach() + halo + since).powi(2) {
                let away = between(new, q, way, halo) - since;
                if away < skin {
                    self.partners.push((other as u32, away));
                }
            }
        }
        self.starts.push(self.partners.len() as u32);
    }

    fn search(&mut self, outlines: &[Outline], periods: &Periods, halo: f64) {
        // Grids are as fine as the cubic mean asks for, and bodies with a thicker skin look further: fewer take longer then, and by about that.
        let skins = |n: usize| self.skins[self.regions.homes[n] as usize];
        let cubes: f64 = (0..outlines.len()).map(|n| skins(n).powi(3)).sum();
        let skin = (cubes / outlines.len().max(1) as f64).cbrt();
        let cuts: Vec<Cut> =
            outlines.par_iter().with_min_len(CHUNK).map(|outline| Cut::of(outline, halo, skin)).collect();
        let smallest = cuts.iter().map(|cut| cut.reach).fold(f64::INFINITY, f64::min);
        let level = |cut: &Cut| (cut.reach / smallest).log2().clamp(0.0, 40.0) as usize;
        let levels: Vec<u8> = cuts.par_iter().with_min_len(CHUNK).map(|cut| level(cut) as u8).collect();
        let coarsest = levels.iter().copied().max().unwrap_or(0);
        let grids: Vec<Option<Grid>> = (0..=coarsest)
            .map(|level| {
                let members: Vec<u32> =
                    (0..outlines.len() as u32).filter(|&n| levels[n as usize] == level).collect();
                (!members.is_empty()).then(|| Grid::new(&members, outlines, &cuts, skin, periods))
            })
            .collect();
        let found: Vec<_> = (0..outlines.len().div_ceil(CHUNK))
            .into_par_iter()
            .map_init(
                // For whom each body was met last: most are met by several pieces.
                || vec![u32::MAX; outlines.len()],
                |met, chunk| {
                    let (mut counts, mut partners) = (Vec::new(), Vec::new());
                    for n in chunk * CHUNK..((chunk + 1) * CHUNK).min(outlines.len()) {
                        let (before, skin) = (partners.len(), skins(n));
                        let (outline, cut) = (&outlines[n], &cuts[n]);
                        for piece in cut.pieces(outline) {
                            for (coarse, grid) in grids.iter().enumerate().skip(usize::from(levels[n])) {
                                let Some(grid) = grid else { continue };
                                let after = if coarse == usize::from(levels[n]) { n as i64 } else { -1 };
                                let away = cut.reach + skin + grid.reach;
                                grid.around(piece, away, |other| {
                                    let seen = &mut met[other.body as usize];
                                    if i64::from(other.body) <= after
                                        || *seen == n as u32
                                        || periods.shortest(other.at - piece).length_squared() >= away * away
                                    {
                                        return;
                                    }
                                    *seen = n as u32;
                                    let q = &outlines[other.body as usize];
                                    let way = periods.shortest(q.centre - outline.centre);
                                    let away = between(outline, q, way, halo);
                                    if away < skin {
                                        partners.push((other.body, away));
                                    }
                                });
                            }
                        }
                        counts.push((partners.len() - before) as u32);
                    }
                    (counts, partners)
                },
            )
            .collect();
        self.starts.clear();
        self.starts.push(0);
        self.partners.clear();
        let mut end = 0;
        for (counts, partners) in found {
            for count in counts {
                end += count;
                self.starts.push(end);
            }
            self.partners.extend::<Vec<(u32, f64)>>(partners);
        }
    }
}

/// Distance in m between two bodies whose centres are `way` apart, or between what others feel of them.
fn between(p: &Outline, q: &Outline, way: DVec3, halo: f64) -> f64 {
    let (s, t) = nearest_of_segments(p.half, q.half, way);
    (way + t * q.half - s * p.half).length() - size(p, halo) - size(q, halo)
}

/// Distance in m from a body's segment or centre at which others feel it.
fn size(outline: &Outline, halo: f64) -> f64 {
    if outline.ellipsoid.is_some() {
        outline.reach()
    } else {
        outline.radius + if outline.is_sphere() { halo } else { 0.0 }
    }
}

/// How a body is cut into pieces.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cut {
    /// Number of pieces.
    pieces: u32,
    /// Radius in m of a sphere about the middle of a piece that holds it.
    pub(crate) reach: f64,
}

impl Cut {
    pub(crate) fn of(outline: &Outline, halo: f64, skin: f64) -> Self {
        let (length, size) = (2.0 * outline.half.length(), size(outline, halo));
        // Found by trial, at 1 % of fibres eighty diameters long.
        let pieces = (length / (4.0 * size + 0.8 * skin)).round().clamp(1.0, 64.0);
        Self { pieces: pieces as u32, reach: 0.5 * length / pieces + size }
    }

    /// Middles of the pieces.
    pub(crate) fn pieces(self, outline: &Outline) -> impl Iterator<Item = DVec3> + use<> {
        let (centre, half, pieces) = (outline.centre, outline.half, f64::from(self.pieces));
        (0..self.pieces).map(move |k| centre + half * ((2.0 * f64::from(k) + 1.0) / pieces - 1.0))
    }
}

/// A piece in a grid.
#[derive(Debug, Clone, Copy, Default)]
struct Piece {
    at: DVec3,
    body: u32,
}

/// Pieces sorted by cells.
#[derive(Debug)]
struct Grid {
    /// Largest reach of a piece in m.
    reach: f64,
    origin: DVec3,
    periods: Periods,
    /// One over the size of a cell, in 1/m.
    inverse: DVec3,
    cells: [usize; 3],
    starts: Vec<u32>,
    pieces: Vec<Piece>,
}

impl Grid {
    /// Of the pieces of some bodies. A cell is about as wide as pieces of this size and a skin reach.
    fn new(members: &[u32], outlines: &[Outline], cuts: &[Cut], skin: f64, periods: &Periods) -> Self {
        let loose: Vec<Piece> = members
            .iter()
            .flat_map(|&body| {
                cuts[body as usize].pieces(&outlines[body as usize]).map(move |at| Piece { at, body })
            })
            .collect();
        let reach = members.iter().map(|&n| cuts[n as usize].reach).fold(0.0, f64::max);
        let low = loose.iter().fold(DVec3::INFINITY, |low, piece| low.min(piece.at));
        let high = loose.iter().fold(DVec3::NEG_INFINITY, |high, piece| high.max(piece.at));
        let mut size = 2.0 * reach + skin;
        let mut extent = high - low;
        for axis in 0..3 {
            if let Some(period) = periods.0[axis] {
                extent[axis] = period;
            }
        }
        // Bodies that are far between get larger cells: memory follows the bodies, not the space between.
        let number =
            |size: f64| extent.to_array().map(|e| (e / size).floor() + 1.0).into_iter().product::<f64>();
        while number(size) > 4.0 * loose.len() as f64 + 64.0 {
            size *= 1.25;
        }
        let (mut cells, mut sizes) = ([1; 3], DVec3::splat(size));
        for axis in 0..3 {
            if periods.0[axis].is_some() {
                cells[axis] = ((extent[axis] / size) as usize).max(1);
                sizes[axis] = extent[axis] / cells[axis] as f64;
            } else {
                cells[axis] = (extent[axis] / size) as usize + 1;
            }
        }
        let total: usize = cells.iter().product();
        let mut grid = Self {
            reach,
            origin: low,
            periods: *periods,
            inverse: sizes.recip(),
            cells,
            starts: vec![0; total + 1],
            pieces: vec![],
        };
        let places: Vec<u32> = loose
            .par_iter()
            .with_min_len(CHUNK)
            .map(|piece| {
                let place =
                    |axis: usize| grid.place(axis, piece.at[axis]).clamp(0, grid.cells[axis] as i64 - 1);
                let (x, y, z) = (place(0) as usize, place(1) as usize, place(2) as usize);
                (x + grid.cells[0] * (y + grid.cells[1] * z)) as u32
            })
            .collect();
        for &place in &places {
            grid.starts[place as usize + 1] += 1;
        }
        for cell in 0..total {
            grid.starts[cell + 1] += grid.starts[cell];
        }
        let mut next = grid.starts.clone();
        grid.pieces = vec![Piece::default(); loose.len()];
        for (piece, &place) in loose.iter().zip(&places) {
            let at = &mut next[place as usize];
            grid.pieces[*at as usize] = *piece;
            *at += 1;
        }
        grid
    }

    /// Number of the cell along an axis in which a coordinate lies.
    fn place(&self, axis: usize, at: f64) -> i64 {
        // Rounds down; a library's `floor` and divisions would take longer than all else here.
        let cells = (at - self.origin[axis]) * self.inverse[axis];
        let cell = cells as i64 - i64::from(cells < 0.0);
        let inside = (0..self.cells[axis] as i64).contains(&cell);
        if inside || self.periods.0[axis].is_none() { cell } else { cell.rem_euclid(self.cells[axis] as i64) }
    }

    /// The cells that are nearer than `within` in m to a coordinate, as up to two ranges.
    fn beside(&self, axis: usize, at: f64, within: f64) -> [std::ops::Range<usize>; 2] {
        let (cell, cells) = (self.place(axis, at), self.cells[axis] as i64);
        let far = ((within * self.inverse[axis]) as i64).min(cells) + 1;
        let range = |low: i64, high: i64| low.clamp(0, cells) as usize..high.clamp(0, cells) as usize;
        let (low, high) = (cell.saturating_sub(far), cell.saturating_add(far + 1));
        if self.periods.0[axis].is_none() {
            [range(low, high), 0..0]
        } else if cells <= 2 * far + 1 {
            [range(0, cells), 0..0]
        } else if low < 0 {
            [range(0, high), range(cells + low, cells)]
        } else {
            [range(low, high), range(0, high - cells)]
        }
    }

    /// All pieces that are nearer than `within` in m to a point, and others around it.
    fn around(&self, at: DVec3, within: f64, mut visit: impl FnMut(&Piece)) {
        let rows = self.beside(0, at.x, within);
        for z in self.beside(2, at.z, within).into_iter().flatten() {
            for y in self.beside(1, at.y, within).into_iter().flatten() {
                let row = self.cells[0] * (y + self.cells[1] * z);
                for x in &rows {
                    let (from, to) = (self.starts[row + x.start], self.starts[row + x.end.max(x.start)]);
                    self.pieces[from as usize..to as usize].iter().for_each(&mut visit);
                }
            }
        }
    }
}
