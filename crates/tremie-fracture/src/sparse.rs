//! Stiffness matrices of lattices, factorised front by front (Duff and Reid 1983), and what linear functionals of the displacements do to each other.
//!
//! Nested dissection (George 1973) orders the nodes: a set is split across its longest side at its middle, and the nodes on
//! one side with neighbours on the other come last. Nodes that are to be kept together form the root. A functional
//! b'u rides along as one more row of the matrix that is never eliminated: what is left at the end is -B' K^-1 B, the displacement that the
//! load of one causes at the other. So nothing is solved for, and jumps across hundreds of facets cost one dense block at the root.

use std::collections::BTreeSet;

use rayon::prelude::*;
use tremie_numerics::DVec3;

use crate::dense::{backward, dot, eliminate, forward};

/// Unknowns of a node: three displacements, three rotations.
pub(crate) const UNKNOWNS: usize = 6;
/// Sets no larger than this are not split.
const LEAF: usize = 12;

/// A matrix of two nodes' unknowns, the first's before the second's.
pub(crate) struct Element {
    pub(crate) nodes: [usize; 2],
    pub(crate) matrix: [[f64; 12]; 12],
}

/// A linear functional of displacements: nodes, and the weights of their unknowns. The same vector is a load.
pub(crate) type Functional = Vec<(usize, [f64; UNKNOWNS])>;

/// A matrix that cannot be factorised: something can move without a force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the lattice is not held: a part of it can move without a force")]
pub struct Singular;

/// A factorised stiffness matrix.
pub(crate) struct Factor {
    /// Each after its children.
    fronts: Vec<Front>,
    fixed: Vec<[bool; UNKNOWNS]>,
    /// B' K^-1 B of the functionals, row by row.
    pub(crate) compliance: Vec<f64>,
}

/// Unknowns that were eliminated together, and their columns of the factor.
struct Front {
    own: Vec<usize>,
    /// Where the unknowns of its outer nodes are among those of the front above.
    above: Vec<usize>,
    /// A row for each unknown, of as many numbers as were eliminated.
    columns: Vec<f64>,
    /// How many fronts are eliminated before it for its sake, and itself.
    count: usize,
}

/// What is left of a front: a symmetric matrix of some nodes and functionals.
struct Update {
    ids: Vec<usize>,
    matrix: Vec<f64>,
}

/// A set of nodes that is eliminated after those of its children.
struct Set {
    own: Vec<usize>,
    children: Vec<Set>,
}

impl Factor {
    /// Factorises the sum of `elements` over nodes at `places`, of which `fixed` unknowns are zero. The nodes `kept` come last.
    pub(crate) fn new(
        places: &[DVec3],
        elements: &[Element],
        fixed: Vec<[bool; UNKNOWNS]>,
        kept: &[usize],
        functionals: &[Functional],
    ) -> Result<Self, Singular> {
        let nodes = places.len();
        let mut neighbours = vec![Vec::new(); nodes];
        for element in elements {
            let [i, j] = element.nodes;
            neighbours[i].push(j);
            neighbours[j].push(i);
        }
        let kept: BTreeSet<usize> = kept.iter().copied().collect();
        let free = (0..nodes).filter(|n| !kept.contains(n)).collect();
        let mut root = Set { own: kept.into_iter().collect(), children: Vec::new() };
        root.children.extend(dissect(free, places, &neighbours));
        let mut rank = vec![0; nodes];
        let sets = root.number(0, &mut rank);
        let mut work = Work {
            nodes,
            fixed: &fixed,
            elements,
            functionals,
            rank: &rank,
            elements_of: vec![Vec::new(); sets],
            rows_of: vec![Vec::new(); sets],
        };
        for (n, element) in elements.iter().enumerate() {
            work.elements_of[element.nodes.map(|node| rank[node]).into_iter().min().unwrap_or(0)].push(n);
        }
        for (n, functional) in functionals.iter().enumerate() {
            for (entry, (node, _)) in functional.iter().enumerate() {
                work.rows_of[rank[*node]].push((n, entry));
            }
        }
        let (fronts, left) = work.factorise(&root)?;
        let count = functionals.len();
        let mut compliance = vec![0.0; count * count];
        let wide = left.ids.len();
        for (i, a) in left.ids.iter().enumerate() {
            for (j, b) in left.ids.iter().enumerate().take(i + 1) {
                let (a, b) = (a - nodes, b - nodes);
                compliance[a * count + b] = -left.matrix[i * wide + j];
                compliance[b * count + a] = -left.matrix[i * wide + j];
            }
        }
        Ok(Self { fronts, fixed, compliance })
    }

    /// The displacements under a load; both hold six numbers for each node.
    pub(crate) fn solve(&self, load: &[f64]) -> Vec<f64> {
        let mut x = load.to_vec();
        for (node, fixed) in self.fixed.iter().enumerate() {
            for (k, fixed) in fixed.iter().enumerate() {
                if *fixed {
                    x[UNKNOWNS * node + k] = 0.0;
                }
            }
        }
        let mut parts = vec![Vec::new(); self.fronts.len()];
        forward_through(&self.fronts, &x, &mut parts);
        backward_through(&self.fronts, &[], &mut parts);
        for (front, part) in self.fronts.iter().zip(&parts) {
            for (node, values) in front.own.iter().zip(part.as_chunks::<UNKNOWNS>().0) {
                x[UNKNOWNS * node..][..UNKNOWNS].copy_from_slice(values);
            }
        }
        x
    }
}

/// Splits fronts, of which the last belongs to all before it, and their parts, into those of its children.
fn children<'a, 'b>(
    fronts: &'a [Front],
    parts: &'b mut [Vec<f64>],
) -> Vec<(&'a [Front], &'b mut [Vec<f64>])> {
    let (mut fronts, mut parts) = (fronts, parts);
    let mut children = Vec::new();
    while let Some(last) = fronts.last() {
        let (before, own) = fronts.split_at(fronts.len() - last.count);
        let (others, mine) = parts.split_at_mut(before.len());
        children.push((own, mine));
        (fronts, parts) = (before, others);
    }
    children
}

/// Solves L y = b in fronts of which the last belongs to all before it; what is left for its outer unknowns.
fn forward_through(fronts: &[Front], load: &[f64], parts: &mut [Vec<f64>]) -> Vec<f64> {
    let (Some((front, below)), Some((part, others))) = (fronts.split_last(), parts.split_last_mut()) else {
        return Vec::new();
    };
    let width = UNKNOWNS * front.own.len();
    let mut own: Vec<f64> =
        front.own.iter().flat_map(|node| &load[UNKNOWNS * node..][..UNKNOWNS]).copied().collect();
    let mut outer = vec![0.0; front.above.len()];
    let passed: Vec<(&[Front], Vec<f64>)> = children(below, others)
        .into_par_iter()
        .map(|(fronts, parts)| (fronts, forward_through(fronts, load, parts)))
        .collect();
    for (child, passed) in passed {
        let above = child.last().map_or(&[][..], |child| &child.above);
        for (place, value) in above.iter().zip(passed) {
            *(if *place < width { &mut own[*place] } else { &mut outer[place - width] }) += value;
        }
    }
    forward(&front.columns, width, &mut own);
    for (row, value) in outer.iter_mut().enumerate() {
        *value -= dot(&front.columns[(width + row) * width..][..width], &own);
    }
    *part = own;
    outer
}

/// Solves L' x = y in fronts of which the last belongs to all before it; `above` are the unknowns of the front above that.
fn backward_through(fronts: &[Front], above: &[f64], parts: &mut [Vec<f64>]) {
    let (Some((front, below)), Some((part, others))) = (fronts.split_last(), parts.split_last_mut()) else {
        return;
    };
    let width = part.len();
    let outer: Vec<f64> = front.above.iter().map(|place| above[*place]).collect();
    for (row, value) in outer.iter().enumerate() {
        let along = &front.columns[(width + row) * width..][..width];
        part.iter_mut().zip(along).for_each(|(y, l)| *y -= l * value);
    }
    backward(&front.columns, width, part);
    let all: Vec<f64> = part.iter().copied().chain(outer).collect();
    children(below, others).into_par_iter().for_each(|(fronts, parts)| backward_through(fronts, &all, parts));
}

/// Splits a set across its longest side.
fn dissect(mut set: Vec<usize>, places: &[DVec3], neighbours: &[Vec<usize>]) -> Option<Set> {
    if set.len() <= LEAF {
        return (!set.is_empty()).then(|| Set { own: set, children: Vec::new() });
    }
    let low = set.iter().fold(DVec3::INFINITY, |low, n| low.min(places[*n]));
    let high = set.iter().fold(DVec3::NEG_INFINITY, |high, n| high.max(places[*n]));
    let axis = (0..3).fold(0, |most, k| if (high - low)[k] > (high - low)[most] { k } else { most });
    set.sort_by(|a, b| places[*a][axis].total_cmp(&places[*b][axis]).then(a.cmp(b)));
    let right = set.split_off(set.len() / 2);
    let beyond: BTreeSet<usize> = right.iter().copied().collect();
    let touches = |n: &usize| neighbours[*n].iter().any(|other| beyond.contains(other));
    let (own, left): (Vec<usize>, Vec<usize>) = set.into_iter().partition(touches);
    let children = [left, right].into_iter().filter_map(|part| dissect(part, places, neighbours));
    Some(Set { own, children: children.collect() })
}

impl Set {
    /// Numbers the sets, children first, from `next` on; the number after the last.
    fn number(&self, next: usize, rank: &mut [usize]) -> usize {
        let next = self.children.iter().fold(next, |next, child| child.number(next, rank));
        self.own.iter().for_each(|n| rank[*n] = next);
        next + 1
    }

    /// How many sets there are.
    fn count(&self) -> usize {
        1 + self.children.iter().map(Set::count).sum::<usize>()
    }
}

struct Work<'a> {
    nodes: usize,
    fixed: &'a [[bool; UNKNOWNS]],
    elements: &'a [Element],
    functionals: &'a [Functional],
    rank: &'a [usize],
    /// Elements by the set that is eliminated first.
    elements_of: Vec<Vec<usize>>,
    /// Entries of functionals by the set of their node.
    rows_of: Vec<Vec<(usize, usize)>>,
}

impl Work<'_> {
    fn factorise(&self, root: &Set) -> Result<(Vec<Front>, Update), Singular> {
        self.set(root, root.count() - 1)
    }

    /// Unknowns of a node or functional.
    fn size(&self, id: usize) -> usize {
        if id < self.nodes { UNKNOWNS } else { 1 }
    }

    /// Eliminates a set, whose number is known, after its children.
    fn set(&self, set: &Set, number: usize) -> Result<(Vec<Front>, Update), Singular> {
        let results = match &set.children[..] {
            [left, right] => {
                let last = number - 1;
                let (left, right) =
                    rayon::join(|| self.set(left, last - right.count()), || self.set(right, last));
                vec![left?, right?]
            }
            children => {
                let mut last = number;
                let mut results = Vec::new();
                for child in children.iter().rev() {
                    results.push(self.set(child, last - 1)?);
                    last -= child.count();
                }
                results.reverse();
                results
            }
        };
        let (mut fronts, mut updates, mut ends) = (Vec::new(), Vec::new(), Vec::new());
        for (children, update) in results {
            fronts.extend(children);
            ends.push(fronts.len());
            updates.push(update);
        }
        let (mut front, update, places) = self.front(&set.own, number, &updates)?;
        for (end, places) in ends.into_iter().zip(places) {
            fronts[end - 1].above = places;
        }
        front.count = fronts.len() + 1;
        fronts.push(front);
        Ok((fronts, update))
    }

    /// Eliminates nodes; the places of the unknowns that were left of others among those of the front come third.
    fn front(
        &self,
        own: &[usize],
        number: usize,
        updates: &[Update],
    ) -> Result<(Front, Update, Vec<Vec<usize>>), Singular> {
        let (elements, rows) = match self.elements_of.get(number) {
            Some(elements) if !own.is_empty() => (&elements[..], &self.rows_of[number][..]),
            _ => (&[][..], &[][..]),
        };
        let mut outer: BTreeSet<usize> = BTreeSet::new();
        outer.extend(elements.iter().flat_map(|n| self.elements[*n].nodes));
        outer.extend(rows.iter().map(|(functional, _)| self.nodes + functional));
        outer.extend(updates.iter().flat_map(|update| update.ids.iter().copied()));
        outer.retain(|id| *id >= self.nodes || self.rank[*id] != number);
        let ids: Vec<usize> = own.iter().copied().chain(outer).collect();
        let mut starts = std::collections::BTreeMap::new();
        let mut n = 0;
        for id in &ids {
            starts.insert(*id, n);
            n += self.size(*id);
        }
        let mut a = vec![0.0; n * n];
        let mut add = |row: usize, column: usize, value: f64| {
            let (row, column) = if row < column { (column, row) } else { (row, column) };
            a[row * n + column] += value;
        };
        for element in elements.iter().map(|n| &self.elements[*n]) {
            for row in 0..12 {
                for column in 0..=row {
                    let [i, j] = [row, column].map(|k| (element.nodes[k / UNKNOWNS], k % UNKNOWNS));
                    if !self.fixed[i.0][i.1] && !self.fixed[j.0][j.1] {
                        add(starts[&i.0] + i.1, starts[&j.0] + j.1, element.matrix[row][column]);
                    }
                }
            }
        }
        for (functional, entry) in rows {
            let (node, weights) = self.functionals[*functional][*entry];
            for (k, weight) in weights.into_iter().enumerate() {
                if !self.fixed[node][k] {
                    add(starts[&(self.nodes + functional)], starts[&node] + k, weight);
                }
            }
        }
        for node in own {
            for k in (0..UNKNOWNS).filter(|k| self.fixed[*node][*k]) {
                add(starts[node] + k, starts[node] + k, 1.0);
            }
        }
        let mut of_nodes = Vec::new();
        for update in updates {
            let places: Vec<usize> =
                update.ids.iter().flat_map(|id| (0..self.size(*id)).map(|k| starts[id] + k)).collect();
            let wide = places.len();
            for (i, row) in places.iter().enumerate() {
                for (j, column) in places[..=i].iter().enumerate() {
                    add(*row, *column, update.matrix[i * wide + j]);
                }
            }
            let of_node = UNKNOWNS * update.ids.iter().filter(|id| **id < self.nodes).count();
            of_nodes.push(places[..of_node].to_vec());
        }
        let pivots = UNKNOWNS * own.len();
        eliminate(&mut a, n, pivots).map_err(|_| Singular)?;
        let wide = n - pivots;
        let mut matrix = Vec::with_capacity(wide * wide);
        (pivots..n).for_each(|row| matrix.extend_from_slice(&a[row * n + pivots..][..wide]));
        let mut columns = Vec::with_capacity(n * pivots);
        (0..n).for_each(|row| columns.extend_from_slice(&a[row * n..][..pivots]));
        let outer = ids[own.len()..].to_vec();
        let front = Front { own: own.to_vec(), above: Vec::new(), columns, count: 1 };
        Ok((front, Update { ids: outer, matrix }, of_nodes))
    }
}
