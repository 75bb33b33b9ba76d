//! How wide are the processor's vectors? Programs are built for processors of all ages, which hold two numbers in a vector;
//! those of the last ten years hold four. Both do the same operations in the same order, so that no bit differs.

use super::code::{Code, Columns, Known};
use super::plan::Planned;
use crate::Bounds;

/// Computes a code, what is the same in every turn too when that is wanted, and places what is nothing but triangles, some of it
/// within `bounds`, with vectors as wide as there are; whether nothing is to be said about any turn.
pub(super) fn compute<const N: usize>(
    columns: &mut Columns<N>,
    (code, with_shared): (&Code, bool),
    known: &Known,
    (solids, bounds): (&mut [Planned], &Bounds),
) -> bool {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        #[expect(unsafe_code, reason = "the processor was asked whether it has these vectors")]
        return unsafe { compute_with_avx2(columns, (code, with_shared), known, (solids, bounds)) };
    }
    compute_inlined(columns, (code, with_shared), known, (solids, bounds))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn compute_with_avx2<const N: usize>(
    columns: &mut Columns<N>,
    code: (&Code, bool),
    known: &Known,
    (solids, bounds): (&mut [Planned], &Bounds),
) -> bool {
    compute_inlined(columns, code, known, (solids, bounds))
}

#[inline(always)]
fn compute_inlined<const N: usize>(
    columns: &mut Columns<N>,
    (code, with_shared): (&Code, bool),
    known: &Known,
    (solids, bounds): (&mut [Planned], &Bounds),
) -> bool {
    if !columns.compute(code, with_shared, known) {
        return false;
    }
    for planned in solids {
        planned.place(columns.numbers, bounds);
    }
    true
}
