//! What triangles does a cut of the cluster tree give? Those that came with the splits that are made, each corner in the
//! cluster that holds it.
//!
//! A split can be made when the one before it in the tree is, and undone when none after it is. What it does is found from
//! the finest triangles alone, whatever else is made: a corner moves to the new vertex if the vertex that it has in
//! the end came from that; and a triangle that came with the split has two corners at its two vertices, and the third in a
//! cluster that was told apart from them before, so no triangle ever has a corner twice.

use super::super::mesh::NONE;
use super::tree::ClusterTree;

/// One cut. All lists are in an order that only the splits so far tell.
#[derive(Debug, Default)]
pub(super) struct Front {
    /// The clusters, by vertex.
    pub(super) active: Vec<u32>,
    active_place: Vec<u32>,
    /// Of each cluster: the split that comes next.
    pub(super) next: Vec<u32>,
    /// Numbers of the triangles that are drawn.
    pub(super) drawn: Vec<u32>,
    drawn_place: Vec<u32>,
    /// Where the corners of drawn triangles are, and their wedges.
    pub(super) corners: Vec<[u32; 3]>,
    pub(super) wedges: Vec<[u32; 3]>,
    /// The corners in each cluster, 3 · triangle + side, as lists with links both ways.
    heads: Vec<u32>,
    after: Vec<u32>,
    before: Vec<u32>,
}

impl Front {
    /// Nothing but the root.
    pub(super) fn new(tree: &ClusterTree) -> Self {
        let (vertices, triangles) = (tree.vertices(), tree.triangles.len());
        let mut front = Self {
            active: Vec::new(),
            active_place: vec![NONE; vertices],
            next: tree.first_child.clone(),
            drawn: Vec::new(),
            drawn_place: vec![NONE; triangles],
            corners: vec![[NONE; 3]; triangles],
            wedges: vec![[NONE; 3]; tree.corners.len()],
            heads: vec![NONE; vertices],
            after: vec![NONE; 3 * triangles],
            before: vec![NONE; 3 * triangles],
        };
        if vertices > 0 {
            put(&mut front.active, &mut front.active_place, 0);
        }
        front
    }

    /// Whether a vertex is told from the one that it was split from.
    pub(super) fn is_made(&self, vertex: u32) -> bool {
        self.active_place[vertex as usize] != NONE
    }

    /// Whether a made split is the last of its row on both sides, so that it can be undone.
    pub(super) fn is_last(&self, tree: &ClusterTree, vertex: u32) -> bool {
        let unmade = |split: u32| split == NONE || !self.is_made(split);
        unmade(tree.next_sibling[vertex as usize]) && unmade(tree.first_child[vertex as usize])
    }

    /// Shows the triangles in a cluster.
    pub(super) fn around(&self, cluster: u32, mut show: impl FnMut([u32; 3])) {
        let mut corner = self.heads[cluster as usize];
        while corner != NONE {
            show(self.corners[corner as usize / 3]);
            corner = self.after[corner as usize];
        }
    }

    /// Makes the next split of a cluster. Gives how many corners it looked at.
    pub(super) fn split(&mut self, tree: &ClusterTree, new: u32) -> usize {
        let old = tree.parent[new as usize];
        let mut work = 0;
        let mut corner = self.heads[old as usize];
        while corner != NONE {
            let next = self.after[corner as usize];
            let (triangle, side) = place_of(corner);
            if tree.holds(new, tree.triangles[triangle][side]) {
                self.take_out(old, corner);
                self.put_in(tree, new, corner);
            }
            corner = next;
            work += 1;
        }
        put(&mut self.active, &mut self.active_place, new);
        self.next[old as usize] = tree.next_sibling[new as usize];
        for triangle in tree.born[new as usize]..tree.born[new as usize + 1] {
            put(&mut self.drawn, &mut self.drawn_place, triangle);
            for (side, &vertex) in tree.triangles[triangle as usize].iter().enumerate() {
                let mut cluster = vertex;
                while !self.is_made(cluster) {
                    cluster = tree.parent[cluster as usize];
                }
                self.put_in(tree, cluster, 3 * triangle + side as u32);
            }
            work += 3;
        }
        work
    }

    /// Undoes a split after which none is made. Gives how many corners it looked at.
    pub(super) fn merge(&mut self, tree: &ClusterTree, new: u32) -> usize {
        let old = tree.parent[new as usize];
        let mut work = 0;
        for triangle in (tree.born[new as usize]..tree.born[new as usize + 1]).rev() {
            for side in 0..3 {
                let cluster = self.corners[triangle as usize][side];
                self.take_out(cluster, 3 * triangle + side as u32);
            }
            take(&mut self.drawn, &mut self.drawn_place, triangle);
            work += 3;
        }
        let mut corner = self.heads[new as usize];
        while corner != NONE {
            let next = self.after[corner as usize];
            self.take_out(new, corner);
            self.put_in(tree, old, corner);
            corner = next;
            work += 1;
        }
        take(&mut self.active, &mut self.active_place, new);
        self.next[old as usize] = new;
        work
    }

    fn put_in(&mut self, tree: &ClusterTree, cluster: u32, corner: u32) {
        let head = std::mem::replace(&mut self.heads[cluster as usize], corner);
        self.after[corner as usize] = head;
        self.before[corner as usize] = NONE;
        if let Some(before) = self.before.get_mut(head as usize) {
            *before = corner;
        }
        let (triangle, side) = place_of(corner);
        self.corners[triangle][side] = cluster;
        if let Some(wedges) = self.wedges.get_mut(triangle) {
            wedges[side] = tree.wedge_in(cluster, tree.corners[triangle][side]);
        }
    }

    fn take_out(&mut self, cluster: u32, corner: u32) {
        let (before, after) = (self.before[corner as usize], self.after[corner as usize]);
        match self.after.get_mut(before as usize) {
            Some(next) => *next = after,
            None => self.heads[cluster as usize] = after,
        }
        if let Some(last) = self.before.get_mut(after as usize) {
            *last = before;
        }
    }
}

fn place_of(corner: u32) -> (usize, usize) {
    (corner as usize / 3, corner as usize % 3)
}

/// Puts a number at the end of a list.
fn put(list: &mut Vec<u32>, places: &mut [u32], number: u32) {
    places[number as usize] = list.len() as u32;
    list.push(number);
}

/// Takes a number out of a list; the last one gets its place.
fn take(list: &mut Vec<u32>, places: &mut [u32], number: u32) {
    let place = std::mem::replace(&mut places[number as usize], NONE);
    list.swap_remove(place as usize);
    if let Some(&moved) = list.get(place as usize) {
        places[moved as usize] = place;
    }
}
