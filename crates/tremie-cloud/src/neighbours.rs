//! Who is near whom: the nodes within a radius of each, found by cells of half that size.
//!
//! Nodes are sorted by their cells in the box around them, x counting fastest, so that what lies in five cells side by side along x stands together; 25 such runs (five in a plane) hold all
//! that can be near. Where nodes are few for their box, cells are larger. Lists are in the order of the cells, and in each of the nodes' numbers, whatever the threads do.

use std::ops::Range;

use rayon::prelude::*;
use tremie_numerics::DVec3;

/// Nodes that one thread takes at a time.
const CHUNK: usize = 256;

/// The neighbours of all nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Neighbours {
    /// Where the list of each node begins, and the end of all.
    firsts: Vec<usize>,
    of: Vec<u32>,
}

/// Cells for each node at most.
const CELLS: f64 = 8.0;

/// Nodes in cells.
struct Grid {
    low: DVec3,
    size: f64,
    /// Cells on each side in which neighbours may be.
    reach: usize,
    count: [usize; 3],
    /// Where the nodes of each cell begin, and the end of all.
    starts: Vec<u32>,
    /// Numbers of nodes by their cells, and where they are.
    sorted: Vec<(u32, DVec3)>,
}

impl Grid {
    fn new(positions: &[DVec3], radius: f64) -> Self {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for at in positions.iter().filter(|at| at.is_finite()) {
            (low, high) = (low.min(*at), high.max(*at));
        }
        let extent = (high - low).max(DVec3::ZERO);
        let cells = |size: f64| (extent / size).floor() + 1.0;
        let mut size = 0.5 * radius;
        while cells(size).element_product() > (CELLS * positions.len() as f64).max(1.0) {
            size *= 2.0;
        }
        let count = cells(size).to_array().map(|n| n as usize);
        let mut new = Self {
            low,
            size,
            reach: (radius / size).ceil() as usize,
            count,
            starts: vec![0; count.iter().product::<usize>() + 1],
            sorted: Vec::new(),
        };
        let cells: Vec<usize> = positions.iter().map(|at| new.index(new.cell(*at))).collect();
        cells.iter().for_each(|cell| new.starts[cell + 1] += 1);
        (1..new.starts.len()).for_each(|n| new.starts[n] += new.starts[n - 1]);
        let mut next = new.starts.clone();
        new.sorted = vec![(0, DVec3::ZERO); positions.len()];
        for ((n, at), cell) in (0..).zip(positions).zip(cells) {
            new.sorted[next[cell] as usize] = (n, *at);
            next[cell] += 1;
        }
        new
    }

    /// The cell of a place along each axis.
    fn cell(&self, at: DVec3) -> [usize; 3] {
        let place = ((at - self.low) / self.size).to_array();
        [0, 1, 2].map(|axis| (place[axis] as usize).min(self.count[axis] - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.count[0] * (y + self.count[1] * z)
    }

    /// What lies in a cell or near it, run by run.
    fn around(&self, [x, y, z]: [usize; 3]) -> impl Iterator<Item = &[(u32, DVec3)]> {
        let range = |at: usize, axis: usize| {
            at.saturating_sub(self.reach)..(at + self.reach + 1).min(self.count[axis])
        };
        let along = range(x, 0);
        let rows = range(z, 2).flat_map(move |z| range(y, 1).map(move |y| (y, z)));
        rows.map(move |(y, z)| {
            let first = self.starts[self.index([along.start, y, z])];
            let end = self.starts[self.index([along.end - 1, y, z]) + 1];
            &self.sorted[first as usize..end as usize]
        })
    }
}

impl Neighbours {
    /// Of nodes at `positions`, all others nearer than `radius`; both in m.
    ///
    /// # Panics
    /// If there are more than 2^32 nodes.
    pub fn within(positions: &[DVec3], radius: f64) -> Self {
        Self::of_first(positions.len(), positions, radius)
    }

    /// The same for the first `number` nodes; the others are only their neighbours.
    ///
    /// # Panics
    /// If there are more than 2^32 nodes.
    pub fn of_first(number: usize, positions: &[DVec3], radius: f64) -> Self {
        assert!(u32::try_from(positions.len()).is_ok(), "so many nodes have no numbers");
        let grid = Grid::new(positions, radius);
        Self::listed(number, |n, list| {
            let at = positions[n];
            for run in grid.around(grid.cell(at)) {
                // All are written down, one over the other until one is near: nothing can be foretold.
                let mut end = list.len();
                list.resize(end + run.len(), 0);
                for (other, place) in run {
                    list[end] = *other;
                    let near = place.distance_squared(at) < radius * radius;
                    end += usize::from(near & (*other as usize != n));
                }
                list.truncate(end);
            }
        })
    }

    /// By what makes the list of each of so many nodes longer.
    fn listed(number: usize, list: impl Fn(usize, &mut Vec<u32>) + Sync) -> Self {
        let chunks: Vec<Range<usize>> =
            (0..number).step_by(CHUNK).map(|begin| begin..(begin + CHUNK).min(number)).collect();
        let lists: Vec<(Vec<usize>, Vec<u32>)> = chunks
            .into_par_iter()
            .map(|nodes| {
                let (mut ends, mut all) = (Vec::new(), Vec::new());
                for n in nodes {
                    list(n, &mut all);
                    ends.push(all.len());
                }
                (ends, all)
            })
            .collect();
        let mut new = Self { firsts: vec![0], of: Vec::new() };
        new.of.reserve_exact(lists.iter().map(|(_, list)| list.len()).sum());
        for (ends, list) in lists {
            let begin = new.of.len();
            new.firsts.extend(ends.into_iter().map(|end| begin + end));
            new.of.extend(list);
        }
        new
    }

    /// Without the pairs that are not `good`, given by the node and its neighbour, and in the order of numbers.
    #[must_use]
    pub fn only(&self, good: impl Fn(usize, usize) -> bool + Sync) -> Self {
        Self::listed(self.len(), |n, list| {
            let begin = list.len();
            list.extend(self.of(n).iter().filter(|other| good(n, **other as usize)));
            list[begin..].sort_unstable();
        })
    }

    /// Those nearer than `radius` to nodes at `positions`, both in m, in the order of numbers.
    #[must_use]
    pub fn nearer(&self, positions: &[DVec3], radius: f64) -> Self {
        Self::listed(self.len(), |n, list| {
            let (at, begin) = (positions[n], list.len());
            let mut end = begin;
            list.resize(begin + self.of(n).len(), 0);
            for other in self.of(n) {
                list[end] = *other;
                end += usize::from(positions[*other as usize].distance_squared(at) < radius * radius);
            }
            list.truncate(end);
            list[begin..].sort_unstable();
        })
    }

    /// What is told of each node and, in the same breath, of each of its neighbours, which stand in their order.
    pub fn told<T: Send, P: Clone + Default + Send>(
        &self,
        of: impl Fn(usize, &mut [P]) -> T + Sync,
    ) -> (Vec<T>, Vec<P>) {
        let mut pairs = vec![P::default(); self.pairs()];
        let (mut rest, mut pieces) = (&mut pairs[..], Vec::new());
        for begin in (0..self.len()).step_by(CHUNK) {
            let nodes = begin..(begin + CHUNK).min(self.len());
            let (piece, after) = rest.split_at_mut(self.firsts[nodes.end] - self.firsts[begin]);
            pieces.push((nodes, piece));
            rest = after;
        }
        let piece = |(nodes, mut pairs): (Range<usize>, &mut [P])| -> Vec<T> {
            let mut node = |node: usize| {
                let (own, after) = std::mem::take(&mut pairs).split_at_mut(self.of(node).len());
                pairs = after;
                of(node, own)
            };
            nodes.map(&mut node).collect()
        };
        let mut told = Vec::with_capacity(self.len());
        pieces
            .into_par_iter()
            .map(piece)
            .collect::<Vec<_>>()
            .into_iter()
            .for_each(|piece| told.extend(piece));
        (told, pairs)
    }

    /// Number of nodes that have lists.
    pub fn len(&self) -> usize {
        self.firsts.len().saturating_sub(1)
    }

    /// Whether there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of all pairs, each counted from both sides.
    pub fn pairs(&self) -> usize {
        self.of.len()
    }

    /// Where those of a node stand among all pairs.
    pub fn range(&self, node: usize) -> Range<usize> {
        self.firsts[node]..self.firsts[node + 1]
    }

    /// The neighbours of a node, by their numbers.
    pub fn of(&self, node: usize) -> &[u32] {
        &self.of[self.range(node)]
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    fn scattered(number: usize, flat: bool) -> Vec<DVec3> {
        let mut random = Pcg64Mcg::seed_from_u64(7);
        let mut coordinate = || random.random_range(-1.0..1.0);
        (0..number)
            .map(|_| DVec3::new(coordinate(), coordinate(), if flat { 0.0 } else { coordinate() }))
            .collect()
    }

    #[test]
    fn neighbours_are_those_of_a_search_through_all_pairs() {
        for (flat, radius) in [(true, 0.11), (false, 0.3), (false, 5.0)] {
            let nodes = scattered(700, flat);
            let found = Neighbours::within(&nodes, radius);
            assert_eq!(found.len(), nodes.len());
            let first = Neighbours::of_first(3, &nodes, radius);
            assert_eq!((first.len(), first.of(2)), (3, found.of(2)));
            let even = found.only(|_, m| m % 2 == 0);
            for (n, at) in nodes.iter().enumerate() {
                let near = |m: &u32| *m as usize != n && nodes[*m as usize].distance(*at) < radius;
                let all: Vec<u32> = (0..700).filter(near).collect();
                let sorted = |of: &[u32]| {
                    let mut of = of.to_vec();
                    of.sort_unstable();
                    of
                };
                assert_eq!(sorted(found.of(n)), all);
                let all: Vec<u32> = all.into_iter().filter(|m| m % 2 == 0).collect();
                assert_eq!(sorted(even.of(n)), all);
            }
        }
        assert!(Neighbours::within(&[], 1.0).is_empty());
    }

    #[test]
    fn the_same_on_any_number_of_threads() {
        let nodes = scattered(3000, false);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Neighbours::within(&nodes, 0.2))
        };
        assert_eq!(with(1), with(3));
    }
}
