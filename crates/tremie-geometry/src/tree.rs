//! Tree of boxes over things in space, such as triangles: which of them are near a point or meet a box, in O(log n).

use tremie_numerics::DVec3;

/// Things in a leaf at most.
const LEAF: usize = 4;

/// A binary tree of axis-parallel boxes, halved at the median along the longest axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tree {
    /// Depth first: the first child of a node follows it.
    nodes: Vec<Node>,
    /// Numbers of the things, in the order of the leaves.
    order: Vec<u32>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    min: DVec3,
    max: DVec3,
    /// Where its things begin and end in `order`.
    first: usize,
    last: usize,
    /// The second child; none for a leaf.
    second: Option<usize>,
}

impl Node {
    /// Square of the distance of a point.
    fn distance_squared(&self, p: DVec3) -> f64 {
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length_squared()
    }
}

impl Tree {
    /// Over the things with these corners: those of triangles, or the lower and the upper one of boxes; at least one thing.
    pub(crate) fn new<const N: usize>(things: &[[DVec3; N]]) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..things.len() as u32).collect() };
        tree.split(things, 0, things.len());
        tree
    }

    fn split<const N: usize>(&mut self, things: &[[DVec3; N]], first: usize, last: usize) -> usize {
        let members = &mut self.order[first..last];
        let corners = members.iter().flat_map(|&n| things[n as usize]);
        let (min, max) =
            corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
        let at = self.nodes.len();
        self.nodes.push(Node { min, max, first, last, second: None });
        if last - first > LEAF {
            let axis = (max - min).max_position();
            let centre = |n: u32| things[n as usize].iter().map(|p| p[axis]).sum::<f64>();
            let half = (last - first) / 2;
            members.select_nth_unstable_by(half, |&a, &b| centre(a).total_cmp(&centre(b)).then(a.cmp(&b)));
            self.split(things, first, first + half);
            self.nodes[at].second = Some(self.split(things, first + half, last));
        }
        at
    }

    /// Corners of the box around all.
    pub(crate) fn bounds(&self) -> (DVec3, DVec3) {
        (self.nodes[0].min, self.nodes[0].max)
    }

    /// Calls `visit` with everything whose leaf meets the box from `min` to `max`.
    pub(crate) fn within(&self, min: DVec3, max: DVec3, visit: &mut impl FnMut(usize)) {
        self.descend(0, &mut |node| node.min.cmple(max).all() && node.max.cmpge(min).all(), visit);
    }

    fn descend(&self, at: usize, meets: &mut impl FnMut(&Node) -> bool, visit: &mut impl FnMut(usize)) {
        let node = &self.nodes[at];
        if !meets(node) {
            return;
        }
        match node.second {
            Some(second) => {
                self.descend(at + 1, meets, visit);
                self.descend(second, meets, visit);
            }
            None => self.order[node.first..node.last].iter().for_each(|&n| visit(n as usize)),
        }
    }

    /// The smallest of the squares of distances from `p` that `distance` tells of things, with what it tells besides. Inside of things it
    /// may be negative.
    pub(crate) fn nearest<T>(
        &self,
        p: DVec3,
        mut distance: impl FnMut(usize) -> (f64, T),
    ) -> Option<(f64, T)> {
        let mut best = None;
        self.approach(0, p, &mut distance, &mut best);
        best
    }

    fn approach<T>(
        &self,
        at: usize,
        p: DVec3,
        distance: &mut impl FnMut(usize) -> (f64, T),
        best: &mut Option<(f64, T)>,
    ) {
        let node = &self.nodes[at];
        let away = node.distance_squared(p);
        // Within its box a thing may be deeper than the best so far.
        if away > 0.0 && best.as_ref().is_some_and(|(least, _)| away >= *least) {
            return;
        }
        let Some(second) = node.second else {
            for &n in &self.order[node.first..node.last] {
                let found = distance(n as usize);
                if best.as_ref().is_none_or(|(least, _)| found.0 < *least) {
                    *best = Some(found);
                }
            }
            return;
        };
        let far_first = self.nodes[second].distance_squared(p) < self.nodes[at + 1].distance_squared(p);
        for child in if far_first { [second, at + 1] } else { [at + 1, second] } {
            self.approach(child, p, distance, best);
        }
    }
}
