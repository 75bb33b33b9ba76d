//! Which of several things is the first that is equal?
//!
//! Equal ones have equal digests, which are quicker to sort; only what has the same digest is compared. Cost: linear, but for many
//! different things of one digest, which are sorted.

use crate::radix;
use crate::random::GOLDEN;
use crate::source::Primitive;

/// For each vertex the first one that is equal in everything.
pub(super) fn first_equal_vertices(primitive: &Primitive) -> Vec<u32> {
    let count = primitive.positions.len();
    let stride = 3
        + if primitive.normals.is_empty() { 0 } else { 3 }
        + if primitive.tangents.is_empty() { 0 } else { 4 }
        + if primitive.colors.is_empty() { 0 } else { 4 }
        + 2 * primitive.uvs.iter().filter(|set| !set.is_empty()).count();
    let mut words = vec![0; stride * count];
    let mut first = 0;
    write_columns(&mut words, stride, &mut first, &primitive.positions);
    write_columns(&mut words, stride, &mut first, &primitive.normals);
    write_columns(&mut words, stride, &mut first, &primitive.tangents);
    write_columns(&mut words, stride, &mut first, &primitive.colors);
    for set in &primitive.uvs {
        write_columns(&mut words, stride, &mut first, set);
    }
    let row = |v: u32| &words[v as usize * stride..][..stride];
    first_equal(count, |v| digest(row(v)), row)
}

/// For each of so many things the first one that is equal. Equal ones have equal digests, which are quicker to sort.
pub(super) fn first_equal<T: Ord>(count: usize, digest: impl Fn(u32) -> u64, thing: impl Fn(u32) -> T) -> Vec<u32> {
    let mut order: Vec<(u64, u32)> = (0..count as u32).map(|i| (digest(i), i)).collect();
    radix::sort(&mut order);
    let mut first: Vec<u32> = (0..count as u32).collect();
    for alike in order.chunk_by_mut(|a, b| a.0 == b.0).filter(|alike| alike.len() > 1) {
        if alike.iter().any(|&(_, i)| thing(i) != thing(alike[0].1)) {
            alike.sort_unstable_by(|&(_, a), &(_, b)| thing(a).cmp(&thing(b)).then(a.cmp(&b)));
        }
        for equal in alike.chunk_by(|&(_, a), &(_, b)| thing(a) == thing(b)) {
            equal.iter().for_each(|&(_, i)| first[i as usize] = equal[0].1);
        }
    }
    first
}

/// Writes values into rows of so many words, from the `first` column on, which goes behind them; equal values as equal words.
fn write_columns<const N: usize>(words: &mut [u32], stride: usize, first: &mut usize, values: &[[f32; N]]) {
    if values.is_empty() {
        return;
    }
    for (row, values) in words.chunks_exact_mut(stride).zip(values) {
        for (word, value) in row[*first..].iter_mut().zip(values) {
            *word = (value + 0.0).to_bits();
        }
    }
    *first += N;
}

/// Mixes words, each by a multiplication and a rotation.
pub(super) fn digest(words: &[u32]) -> u64 {
    words.iter().fold(0, |mixed: u64, &word| {
        (mixed.rotate_left(29) ^ u64::from(word)).wrapping_mul(GOLDEN)
    })
}
