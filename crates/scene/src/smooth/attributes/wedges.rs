//! Which wedge has each corner? That of the corner beside it, or another of its vertex, or a new one.
//!
//! Where there is no seam all corners answer as expected, which one bit says of a whole split.

use super::super::looks::Looks;
use super::super::mesh::{Mesh, NONE};
use super::super::model::{Bit, Nibble};
use super::super::rans::Coder;
use super::super::script::Script;
use super::Done;

/// More wedges of one vertex cannot be named again.
const MOST_PRESENT: usize = 15;

/// A corner: triangle, which of its corners, and the wedge that it had before the split.
pub(super) type Corner = (u32, usize, u32);

/// Why a corner is asked for its wedge.
#[derive(Debug, Clone, Copy)]
enum Why {
    /// It moved, and had the same wedge as the one beside it.
    MovedSame = 0,
    /// It moved, and had another.
    MovedOther = 1,
    BornNew = 2,
    BornOld = 3,
    BornThird = 4,
}

/// A corner that is asked, and its vertex.
#[derive(Debug, Clone, Copy)]
struct Question {
    vertex: u32,
    corner: Corner,
    /// Where its triangle stands in its vertex's star, if that is known.
    place: u32,
    why: Why,
}

/// Wedges of corners while a mesh grows.
#[derive(Debug, Clone, Default)]
pub(super) struct Wedges {
    /// Of the triangles' corners.
    pub(super) corners: Vec<[u32; 3]>,
    /// The wedge that a vertex got last; by wedge, the one that its vertex got before it.
    latest: Vec<u32>,
    before: Vec<u32>,
    /// Whether all corners answer as expected; by what seams there are at the vertex that is split.
    usual: [Bit; 3],
    rank: [[Nibble; 4]; 5],
    questions: Vec<Question>,
    /// Of a writer: how many wedges there were to choose from, and which it is.
    answers: Vec<(usize, usize)>,
    present: Vec<u32>,
    /// Corners that have wedges that are still to be told, each with the place here of the next one that has the same.
    asked: Vec<(Corner, u32)>,
    /// The first and the last place of each of those wedges.
    pending: Vec<(u32, u32)>,
    /// How many wedges have been told.
    told: u32,
}

impl Wedges {
    /// Makes room for so many in all.
    pub(super) fn reserve(&mut self, vertices: usize, triangles: usize, wedges: usize) {
        self.corners.reserve(triangles.saturating_sub(self.corners.len()));
        self.latest.reserve(vertices.saturating_sub(self.latest.len()));
        self.before.reserve(wedges.saturating_sub(self.before.len()));
    }

    /// New wedges of the last split.
    pub(super) fn pending(&self) -> usize {
        self.pending.len()
    }

    /// The corners that have the `i`-th of them.
    pub(super) fn gather(&self, i: usize, corners: &mut Vec<Corner>) {
        corners.clear();
        let mut place = self.pending[i].0;
        while let Some(&(corner, next)) = self.asked.get(place as usize) {
            corners.push(corner);
            place = next;
        }
    }

    /// After a split: tells which wedges the new vertex's corners and those of new triangles have. `told` were there before.
    pub(super) fn code<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        mesh: &Mesh,
        script: Option<&mut S>,
        (split, told): (Done, u32),
        looks: &mut Looks,
    ) {
        self.corners.resize(mesh.triangles.len(), [NONE; 3]);
        self.latest.resize(mesh.points.len(), NONE);
        self.asked.clear();
        self.pending.clear();
        self.told = told;
        let seams = self.ask(mesh, split);
        if self.questions.is_empty() {
            return;
        }
        if let Some(script) = script {
            self.answer(coder, mesh, script, (seams, looks));
            return;
        }
        let is_usual = coder.bit(&mut self.usual[seams], false);
        let own = mesh.valence(split.new);
        let shared = if is_usual { self.share(split.new, own) } else { 0 };
        for i in shared..self.questions.len() {
            let question = self.questions[i];
            let count = self.count_present(question.vertex);
            let rank = if is_usual || count == 0 {
                0
            } else {
                let models = &mut self.rank[question.why as usize];
                coder.symbol(&mut models[count.min(3)], 0).min(count)
            };
            let wedge = (rank < count).then(|| {
                self.find_present(mesh, question, rank + 1, looks);
                self.present[rank.min(self.present.len() - 1)]
            });
            self.settle(question, wedge);
        }
    }

    /// Gives all corners of the new vertex, which are asked first, one new wedge. Says how many they are.
    fn share(&mut self, new: u32, count: usize) -> usize {
        let Some(last) = count.checked_sub(1) else { return 0 };
        for (i, question) in self.questions[..count].iter().enumerate() {
            let (triangle, side, _) = question.corner;
            self.corners[triangle as usize][side] = self.told;
            self.asked
                .push((question.corner, if i < last { i as u32 + 1 } else { NONE }));
        }
        self.pending.push((0, last as u32));
        self.before.push(NONE);
        self.latest[new as usize] = self.told;
        count
    }

    /// A writer's answers. Each depends on those before, so all are found before they are told.
    fn answer<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        mesh: &Mesh,
        script: &mut S,
        (seams, looks): (usize, &mut Looks),
    ) {
        self.answers.clear();
        for i in 0..self.questions.len() {
            let question = self.questions[i];
            let Question { vertex, corner, .. } = question;
            let count = self.count_present(vertex);
            self.find_present(mesh, question, count, looks);
            let rank = script.wedge(vertex, corner.0, &self.present).unwrap_or(count);
            self.answers.push((count, rank));
            self.settle(question, self.present.get(rank).copied());
        }
        let is_usual = self.answers.iter().all(|&(_, rank)| rank == 0);
        coder.bit(&mut self.usual[seams], is_usual);
        if is_usual {
            return;
        }
        for (question, &(count, rank)) in self.questions.iter().zip(&self.answers) {
            if count > 0 {
                coder.symbol(&mut self.rank[question.why as usize][count.min(3)], rank);
            }
        }
    }

    /// Which corners are asked. Gives 0 if the old vertex has no seam, 1 if none parts the corners that moved, 2 else.
    fn ask(&mut self, mesh: &Mesh, split: Done) -> usize {
        self.questions.clear();
        let mut seams = usize::from(self.count_present(split.old) > 1);
        let mut beside = NONE;
        for (place, &triangle) in (0..).zip(mesh.stars.of(mesh.points[split.new as usize].star)) {
            let side = side_of(mesh, triangle, split.new);
            // The corners of moved triangles still hold wedges of the old vertex.
            let was = std::mem::replace(&mut self.corners[triangle as usize][side], NONE);
            let why = match was {
                NONE => Why::BornNew,
                wedge if wedge == beside => Why::MovedSame,
                _ => Why::MovedOther,
            };
            if was != NONE && beside != NONE && was != beside {
                seams = 2;
            }
            beside = was;
            self.questions.push(Question {
                vertex: split.new,
                corner: (triangle, side, was),
                place,
                why,
            });
        }
        for triangle in split.first..mesh.triangles.len() as u32 {
            for (side, vertex) in mesh.triangles[triangle as usize].into_iter().enumerate() {
                if vertex != split.new {
                    let why = if vertex == split.old {
                        Why::BornOld
                    } else {
                        Why::BornThird
                    };
                    self.questions.push(Question {
                        vertex,
                        corner: (triangle, side, NONE),
                        place: NONE,
                        why,
                    });
                }
            }
        }
        seams
    }

    /// Gives a corner a wedge, or a new one.
    fn settle(&mut self, question: Question, present: Option<u32>) {
        let Question { vertex, corner, .. } = question;
        let (triangle, side, _) = corner;
        let wedge = present.unwrap_or_else(|| {
            let latest = &mut self.latest[vertex as usize];
            self.pending.push((NONE, NONE));
            self.before.push(*latest);
            *latest = self.before.len() as u32 - 1;
            self.told + self.pending.len() as u32 - 1
        });
        self.corners[triangle as usize][side] = wedge;
        if wedge >= self.told {
            let place = self.asked.len() as u32;
            self.asked.push((corner, NONE));
            let (first, last) = &mut self.pending[(wedge - self.told) as usize];
            match self.asked.get_mut(*last as usize) {
                Some((_, next)) => *next = place,
                None => *first = place,
            }
            *last = place;
        }
    }

    /// How many wedges a vertex got. Its corners have no others, so this tells their number before any is looked at.
    fn count_present(&self, vertex: u32) -> usize {
        let mut count = 0;
        let mut wedge = self.latest[vertex as usize];
        while wedge != NONE && count < MOST_PRESENT {
            count += 1;
            wedge = self.before[wedge as usize];
        }
        count
    }

    /// The first `count` wedges of a question's vertex: from its triangle's place in the star to both sides in turn, then
    /// any others, latest first. Just the latest when nothing more may be looked at.
    fn find_present(&mut self, mesh: &Mesh, question: Question, count: usize, looks: &mut Looks) {
        self.present.clear();
        let latest = self.latest[question.vertex as usize];
        // Nearly always there is one at most.
        let is_one = self.before.get(latest as usize).is_none_or(|&before| before == NONE);
        if is_one || looks.are_used_up() {
            self.add_present(latest);
            return;
        }
        let vertex = question.vertex;
        let star = mesh.stars.of(mesh.points[vertex as usize].star);
        let at = if question.place == NONE {
            looks.take_for_search(star.len());
            star.iter().position(|&t| t == question.corner.0).unwrap_or(0)
        } else {
            question.place as usize
        };
        let (mut behind, mut ahead) = (at, at + 1);
        while self.present.len() < count && (behind > 0 || ahead < star.len()) {
            if behind > 0 {
                behind -= 1;
                let t = star[behind];
                self.add_present(self.corners[t as usize][side_of(mesh, t, vertex)]);
            }
            if let Some(&t) = star.get(ahead) {
                ahead += 1;
                self.add_present(self.corners[t as usize][side_of(mesh, t, vertex)]);
            }
        }
        looks.take(ahead - behind);
        // A wedge that no corner has at the moment may come back.
        let mut wedge = latest;
        while wedge != NONE && self.present.len() < count {
            self.add_present(wedge);
            wedge = self.before[wedge as usize];
        }
    }

    #[inline(always)]
    fn add_present(&mut self, wedge: u32) {
        if wedge != NONE && self.present.len() < MOST_PRESENT && !self.present.contains(&wedge) {
            self.present.push(wedge);
        }
    }
}

/// Which corner of a triangle a vertex is.
#[inline(always)]
fn side_of(mesh: &Mesh, triangle: u32, vertex: u32) -> usize {
    let [a, b, c] = mesh.triangles[triangle as usize];
    usize::from(a != vertex && b == vertex) + 2 * usize::from(a != vertex && b != vertex && c == vertex)
}
