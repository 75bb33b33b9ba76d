//! Which of the edges that bound a patch are beside a piece?

use glam::DVec2;

/// A bounding edge, and how many more triangles have it in this direction than in the other.
#[derive(Clone, Copy)]
pub(super) struct Edge {
    pub(super) from: DVec2,
    pub(super) to: DVec2,
    pub(super) times: i32,
}

/// Rows of equal height over some edges.
pub(super) struct Rows {
    low: f64,
    height: f64,
    /// Where the edges of each row begin.
    first: Vec<u32>,
    pub(super) edges: Vec<u32>,
}

impl Edge {
    pub(super) fn length(&self) -> f64 {
        self.from.distance(self.to)
    }

    /// Whether it meets a triangle: no line separates them.
    pub(super) fn meets(&self, triangle: &[DVec2; 3]) -> bool {
        let [a, b, c] = *triangle;
        let separates = |axis: DVec2| {
            let [mine, other] = [&[self.from, self.to][..], &triangle[..]].map(|points| {
                let heights = points.iter().map(|p| p.dot(axis));
                heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| {
                    [low.min(h), high.max(h)]
                })
            });
            mine[1] < other[0] || other[1] < mine[0]
        };
        let axes = [b - a, c - b, a - c, self.to - self.from].map(DVec2::perp);
        !axes.into_iter().any(separates)
    }
}

impl Rows {
    /// Rows of a few edges.
    pub(super) fn of(edges: &[Edge]) -> Self {
        let ends = || edges.iter().flat_map(|edge| [edge.from.y, edge.to.y]);
        let low = ends().fold(f64::INFINITY, f64::min);
        let high = ends().fold(f64::NEG_INFINITY, f64::max);
        // Long edges stand in many rows: fewer then, so that an edge stands in three of them in the mean.
        let passed: f64 = edges.iter().map(|edge| (edge.to.y - edge.from.y).abs()).sum();
        let most = 2.0 * edges.len() as f64 * (high - low) / passed;
        let count = (edges.len() / 4).min(most as usize).max(1);
        let mut rows = Self {
            low,
            height: (high - low) / count as f64,
            first: vec![0; count + 1],
            edges: Vec::new(),
        };
        let mut held: Vec<Vec<u32>> = vec![Vec::new(); count];
        for (edge, number) in edges.iter().zip(0..) {
            let range = rows.range(edge.from.y.min(edge.to.y), edge.from.y.max(edge.to.y));
            held[range].iter_mut().for_each(|row| row.push(number));
        }
        for (row, numbers) in held.iter().enumerate() {
            rows.edges.extend(numbers);
            rows.first[row + 1] = rows.edges.len() as u32;
        }
        rows
    }

    /// Rows that heights lie in; those below and above all are in the first and the last.
    fn range(&self, low: f64, high: f64) -> std::ops::Range<usize> {
        let last = self.first.len() - 2;
        // NaN, where there is no height, becomes 0.
        let row = |height: f64| (((height - self.low) / self.height) as usize).min(last);
        row(low)..row(high) + 1
    }

    /// The edges of these rows, some of them several times.
    pub(super) fn between(&self, low: f64, high: f64) -> &[u32] {
        let range = self.range(low, high);
        &self.edges[self.first[range.start] as usize..self.first[range.end] as usize]
    }
}
