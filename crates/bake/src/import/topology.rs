//! Which points, lines and triangles does a primitive draw? Strips, fans and loops are unrolled here.
//!
//! glTF 2.0 §3.7.2.1. The winding of each triangle is that of the specification: triangle `i` of a strip is
//! `(i, i + 1 + i%2, i + 2 − i%2)`, of a fan `(i + 1, i + 2, 0)`.

use crate::defect::Defects;
use crate::source::Topology;

/// How many shapes a list of `len` indices makes in a mode, and how many indices are left over.
fn shapes(mode: usize, len: usize) -> Option<(Topology, usize, usize)> {
    Some(match mode {
        0 => (Topology::Points, len, 0),
        1 => (Topology::Lines, len / 2, len % 2),
        2 => (Topology::Lines, if len < 2 { 0 } else { len }, if len < 2 { len } else { 0 }),
        3 => (Topology::Lines, len.saturating_sub(1), usize::from(len == 1)),
        4 => (Topology::Triangles, len / 3, len % 3),
        5 | 6 => (Topology::Triangles, len.saturating_sub(2), if len < 3 { len } else { 0 }),
        _ => return None,
    })
}

/// The topology that a mode unrolls to, and how many indices it will have; `None` for a mode that does not exist.
pub(super) fn unrolled(mode: usize, len: usize) -> Option<(Topology, usize)> {
    shapes(mode, len).map(|(topology, count, _)| (topology, count * topology.arity()))
}

/// Unrolls a primitive of `len` indices. `vertex` reads each, or says what is wrong with it: then its shapes are left
/// out and counted. `place` names the primitive.
pub(super) fn unroll(
    mode: usize,
    len: usize,
    vertex: impl Fn(usize) -> Result<u32, &'static str>,
    (defects, place): (&mut Defects, &str),
) -> Vec<u32> {
    let Some((topology, count, left_over)) = shapes(mode, len) else {
        return Vec::new();
    };
    defects.note("indices left over after the last whole shape: dropped", left_over as u64, || {
        format!("{place}: {len} of them in mode {mode}")
    });
    let corner = |shape: usize, corner: usize| match (mode, corner) {
        (0, _) => shape,
        (1, c) => 2 * shape + c,
        (2 | 3, c) => (shape + c) % len,
        (4, c) => 3 * shape + c,
        (5, 0) => shape,
        (5, 1) => shape + 1 + shape % 2,
        (5, _) => shape + 2 - shape % 2,
        (_, 2) => 0,
        (_, c) => shape + 1 + c,
    };
    let mut indices = Vec::with_capacity(count * topology.arity());
    for shape in 0..count {
        let start = indices.len();
        for c in 0..topology.arity() {
            match vertex(corner(shape, c)) {
                Ok(i) => indices.push(i),
                Err(kind) => {
                    defects.note(kind, 1, || format!("{place}, shape {shape}"));
                    indices.truncate(start);
                    break;
                }
            }
        }
    }
    indices
}

/// Numbers the used vertices anew in rising order. Returns the used ones; `indices` then point into that list.
pub(super) fn compact(indices: &mut [u32]) -> Vec<u32> {
    const UNUSED: u32 = u32::MAX;
    let span = indices.iter().max().map_or(0, |i| *i as usize + 1);
    let mut used: Vec<u32>;
    if span <= 16 * indices.len() {
        let mut new_of_old = vec![UNUSED; span];
        for &index in &*indices {
            new_of_old[index as usize] = 0;
        }
        used = Vec::new();
        for (old, new) in new_of_old.iter_mut().enumerate().filter(|(_, new)| **new != UNUSED) {
            *new = used.len() as u32;
            used.push(old as u32);
        }
        for index in indices {
            *index = new_of_old[*index as usize];
        }
    } else {
        // Few shapes of a huge shared vertex buffer: do not touch all of it.
        used = indices.to_vec();
        used.sort_unstable();
        used.dedup();
        for index in indices {
            *index = used.partition_point(|u| u < index) as u32;
        }
    }
    used
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(mode: usize, len: usize) -> Vec<u32> {
        unroll(mode, len, |i| Ok(i as u32), (&mut Defects::default(), "p"))
    }

    #[test]
    fn every_mode_unrolls_with_the_winding_of_the_specification() {
        assert_eq!(run(0, 2), [0, 1]);
        assert_eq!(run(1, 5), [0, 1, 2, 3]);
        assert_eq!(run(2, 3), [0, 1, 1, 2, 2, 0]);
        assert_eq!(run(3, 3), [0, 1, 1, 2]);
        assert_eq!(run(4, 7), [0, 1, 2, 3, 4, 5]);
        assert_eq!(run(5, 5), [0, 1, 2, 1, 3, 2, 2, 3, 4]);
        assert_eq!(run(6, 5), [1, 2, 0, 2, 3, 0, 3, 4, 0]);
        assert!(run(7, 9).is_empty());
    }

    #[test]
    fn too_few_indices_make_no_shape() {
        for mode in 0..=6 {
            assert!(run(mode, 0).is_empty(), "mode {mode}");
        }
        for mode in [1, 2, 3, 4, 5, 6] {
            assert!(run(mode, 1).is_empty(), "mode {mode}");
        }
        assert!(run(5, 2).is_empty());
        assert!(run(6, 2).is_empty());
    }

    #[test]
    fn a_refused_vertex_drops_its_shapes_only() {
        let mut defects = Defects::default();
        let vertex = |i| if i == 4 { Err("bad") } else { Ok(i as u32) };
        let indices = unroll(4, 9, vertex, (&mut defects, "p"));
        assert_eq!(indices, [0, 1, 2, 6, 7, 8]);
        assert_eq!(defects.count("bad"), 1);
        assert_eq!(defects.iter().next().unwrap().first, "p, shape 1");
    }

    #[test]
    fn compacting_gives_the_same_by_table_and_by_sorting() {
        let mut dense = [7, 3, 3, 9];
        assert_eq!(compact(&mut dense), [3, 7, 9]);
        assert_eq!(dense, [1, 0, 0, 2]);
        let mut sparse = [1_000_000, 5, u32::MAX - 1];
        assert_eq!(compact(&mut sparse), [5, 1_000_000, u32::MAX - 1]);
        assert_eq!(sparse, [1, 0, 2]);
        assert_eq!(compact(&mut []), [] as [u32; 0]);
    }
}
