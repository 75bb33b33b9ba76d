//! How do the triangles around a vertex hang together? In fans: rows of triangles that share edges at the vertex.
//!
//! Where the surface is manifold there is one fan, closed inside and open on a border. Anywhere else there are several.

use super::mesh::Mesh;
use super::runs::Runs;

/// A triangle seen from one of its corners.
#[derive(Debug, Clone, Copy)]
pub struct Spoke {
    /// Its number, in order of birth.
    pub triangle: u32,
    /// The next corner in its sense of rotation.
    pub from: u32,
    /// The one after.
    pub to: u32,
}

/// A row of spokes, each beginning where the one before ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fan {
    /// Index of its first spoke.
    pub first: usize,
    /// How many spokes.
    pub length: usize,
    /// Whether its last spoke ends where its first begins.
    pub closed: bool,
}

impl Fan {
    #[inline(always)]
    fn new(begin: usize, length: usize, first: &Spoke, last: &Spoke) -> Self {
        Self {
            first: begin,
            length,
            closed: length > 1 && last.to == first.from,
        }
    }
}

/// No star with more fans is put in order: it would take too long.
const MOST_FANS: usize = 24;

/// All triangles around one vertex.
#[derive(Debug, Clone, Default)]
pub struct Star {
    /// Fan by fan.
    pub spokes: Vec<Spoke>,
    /// Where each fan is.
    pub fans: Vec<Fan>,
    /// The triangles of the spokes.
    pub(super) triangles: Runs,
    scratch: Vec<Spoke>,
}

impl Star {
    /// Reads the star of a vertex, joins fans that fit together.
    #[inline(always)]
    pub(super) fn read(&mut self, mesh: &Mesh, vertex: u32) {
        self.spokes.clear();
        let list = mesh.points[vertex as usize].star;
        let triangles = mesh.stars.of(list);
        self.spokes.extend(triangles.iter().map(|&triangle| {
            let (from, to) = mesh.others(triangle, vertex);
            Spoke { triangle, from, to }
        }));
        self.triangles.clear(triangles.len());
        mesh.stars.copy(list, &mut self.triangles);
        self.find_fans();
        if self.fans.len() > 1 && self.fans.len() <= MOST_FANS {
            self.join();
        }
    }

    #[inline(always)]
    fn find_fans(&mut self) {
        self.fans.clear();
        let Some(mut first) = self.spokes.first() else { return };
        let (mut begin, mut last) = (0, first);
        for (i, spoke) in self.spokes.iter().enumerate().skip(1) {
            if spoke.from != last.to {
                self.fans.push(Fan::new(begin, i - begin, first, last));
                (begin, first) = (i, spoke);
            }
            last = spoke;
        }
        let length = self.spokes.len() - begin;
        self.fans.push(Fan::new(begin, length, first, last));
    }

    /// Puts an open fan behind another that ends where it begins, as often as possible.
    #[cold]
    fn join(&mut self) {
        let mut left: Vec<Fan> = std::mem::take(&mut self.fans);
        self.scratch.clear();
        while !left.is_empty() {
            let mut fan = left.remove(0);
            // Begin where nothing comes before, if there is such a place on this row of fans.
            let mut steps = left.len();
            while !fan.closed && steps > 0 {
                let begins = self.spokes[fan.first].from;
                let before = left
                    .iter()
                    .position(|f| !f.closed && self.spokes[f.first + f.length - 1].to == begins);
                let Some(before) = before else { break };
                std::mem::swap(&mut left[before], &mut fan);
                steps -= 1;
            }
            loop {
                let spokes = &self.spokes[fan.first..][..fan.length];
                self.scratch.extend_from_slice(spokes);
                let ends = spokes[fan.length - 1].to;
                let next = left.iter().position(|f| !f.closed && self.spokes[f.first].from == ends);
                match next {
                    Some(next) if !fan.closed => fan = left.remove(next),
                    _ => break,
                }
            }
        }
        std::mem::swap(&mut self.spokes, &mut self.scratch);
        self.triangles.clear(self.spokes.len());
        self.spokes.iter().for_each(|spoke| self.triangles.push(spoke.triangle));
        self.find_fans();
    }

    /// The spokes of a fan.
    #[inline(always)]
    pub fn of(&self, fan: Fan) -> &[Spoke] {
        &self.spokes[fan.first..][..fan.length]
    }
}
