//! What does a split do to the mesh? Laid out first, because the new position is predicted from it, and then done.

use super::fan::{Fan, Spoke, Star};
use super::mesh::{Mesh, NONE, add};
use super::runs::Runs;
use super::split::{Born, Move, Row, Split};

/// An opened edge, as it will be.
#[derive(Debug, Clone, Copy)]
pub struct Opened {
    /// The new triangle.
    pub born: Born,
    /// The triangle at the edge that is found in the third vertex's list, and whether the new one comes after it.
    neighbour: u32,
    after: bool,
}

/// What a split does, in detail: an intermediate between [`Split`] and the mesh.
#[derive(Debug, Clone, Default)]
pub struct Change {
    /// Triangles that will be the old vertex's; new ones have their future numbers.
    stay: Runs,
    /// … the new vertex's.
    go: Runs,
    /// Spokes that move, by index.
    pub(super) moved: Runs,
    /// Edges that open, in order of their new triangles' numbers.
    pub opened: Vec<Opened>,
}

impl Change {
    /// Lays out what a split does, without doing it. `next` is the number of the first new triangle.
    #[inline(always)]
    pub(super) fn lay_out(&mut self, star: &Star, split: &Split, next: u32) {
        let most = star.spokes.len() + 2 * star.fans.len() + split.extra.len();
        for runs in [&mut self.stay, &mut self.go, &mut self.moved] {
            runs.clear(most);
        }
        self.opened.clear();
        let mut torn = split.torn.iter();
        for (&fan, &moved) in star.fans.iter().zip(&split.moves) {
            let (begin, end) = (fan.first, fan.first + fan.length);
            match moved {
                Move::Stay => self.stay(star, begin, end),
                Move::Go => self.go(star, begin, end),
                Move::Torn => {
                    for spoke in begin..end {
                        if torn.next().copied().unwrap_or(false) {
                            self.go(star, spoke, spoke + 1);
                        } else {
                            self.stay(star, spoke, spoke + 1);
                        }
                    }
                }
                Move::Row(row) => self.lay_out_row(star, fan, row, next),
            }
        }
    }

    #[inline(always)]
    fn lay_out_row(&mut self, star: &Star, fan: Fan, Row { first, count, opens }: Row, next: u32) {
        let (begin, length) = (fan.first, fan.length);
        let (first, end) = (first as usize, (first + count) as usize);
        // A row that goes on at the beginning of the fan has two parts.
        let (end, rest) = (end.min(length), end.saturating_sub(length));
        self.stay(star, begin + rest, begin + first);
        self.go(star, begin + first, begin + end);
        self.go(star, begin, begin + rest);
        let around = if rest > 0 || fan.closed && end == length {
            rest
        } else {
            end
        };
        let spokes = star.of(fan);
        let start_born = opens[0].then(|| self.open(spokes, first, false, next));
        let end_born = opens[1].then(|| self.open(spokes, around, true, next));
        for born in end_born.into_iter().chain(start_born) {
            self.go.push(born);
        }
        for born in start_born.into_iter().chain(end_born) {
            self.stay.push(born);
        }
        self.stay(star, begin + end.max(rest), begin + length);
    }

    #[inline(always)]
    fn stay(&mut self, star: &Star, first: usize, end: usize) {
        self.stay.add_run(&star.triangles, first, end);
    }

    #[inline(always)]
    fn go(&mut self, star: &Star, first: usize, end: usize) {
        self.go.add_run(&star.triangles, first, end);
        self.moved.add_numbers(first, end);
    }

    /// Opens the edge before spoke `at`: gives the number of its new triangle.
    #[inline(always)]
    fn open(&mut self, spokes: &[Spoke], at: usize, old_first: bool, next: u32) -> u32 {
        let after = at < spokes.len();
        let spoke = spokes[at.min(spokes.len() - 1)];
        let third = if after { spoke.from } else { spoke.to };
        self.opened.push(Opened {
            born: Born { third, old_first },
            neighbour: spoke.triangle,
            after,
        });
        next + self.opened.len() as u32 - 1
    }

    /// Changes the mesh. `new` is the new vertex, without triangles.
    #[inline(always)]
    pub(super) fn apply(&mut self, mesh: &mut Mesh, star: &Star, split: &Split, old: u32, new: u32) {
        let p = mesh.points[old as usize].at();
        let q = mesh.points[new as usize].at();
        let step = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
        let mut lost = [0; 3];
        for &i in self.moved.all() {
            let Spoke { triangle, from, to } = star.spokes[i as usize];
            for corner in &mut mesh.triangles[triangle as usize] {
                *corner = if *corner == old { new } else { *corner };
            }
            for other in [from, to] {
                let point = &mut mesh.points[other as usize];
                add(&mut lost, point.at());
                add(&mut point.around, step);
            }
        }
        add(&mut mesh.points[new as usize].around, lost);
        add(&mut mesh.points[old as usize].around, lost.map(i32::wrapping_neg));
        for i in 0..self.opened.len() {
            let Opened { born, neighbour, after } = self.opened[i];
            let triangle = mesh.bear(born, old, new);
            let list = &mut mesh.points[born.third as usize].star;
            mesh.stars.insert(list, (neighbour, after), triangle);
        }
        for &born in &split.extra {
            let triangle = mesh.bear(born, old, new);
            mesh.stars
                .insert(&mut mesh.points[born.third as usize].star, (NONE, true), triangle);
            self.stay.push(triangle);
            self.go.push(triangle);
        }
        mesh.stars.set(&mut mesh.points[old as usize].star, &self.stay);
        mesh.stars.set(&mut mesh.points[new as usize].star, &self.go);
    }
}

impl Mesh {
    /// A new triangle, of which no list knows yet.
    #[inline(always)]
    fn bear(&mut self, born: Born, old: u32, new: u32) -> u32 {
        let triangle = self.triangles.len() as u32;
        self.triangles.push(if born.old_first {
            [old, new, born.third]
        } else {
            [new, old, born.third]
        });
        let [p, q, r] = [old, new, born.third].map(|v| self.points[v as usize].at());
        for (vertex, one, other) in [(old, q, r), (new, p, r), (born.third, p, q)] {
            let around = &mut self.points[vertex as usize].around;
            add(around, one);
            add(around, other);
        }
        triangle
    }
}
