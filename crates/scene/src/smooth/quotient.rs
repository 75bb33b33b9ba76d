//! How are whole numbers divided fast? In floating point, which is exact as long as numbers are below 2⁵³.

/// a / b, rounded towards zero, of numbers below 2⁵³ of which b is not 0.
///
/// What is not whole lies 1 / |b| or more below the next whole number, of which a rounded quotient below 2⁵³ / |b| is off by less.
#[inline(always)]
pub(super) fn quotient(a: i64, b: i64) -> i64 {
    debug_assert!(
        b != 0 && a.unsigned_abs() < MOST && b.unsigned_abs() < MOST,
        "{a} / {b}"
    );
    (a as f64 / b as f64) as i64
}

const MOST: u64 = 1 << 53;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Numbers of all sizes, most of them small or near to the ends.
    fn number() -> impl Strategy<Value = i64> {
        let limit = MOST as i64 - 1;
        (0u32..53, -limit..=limit).prop_map(|(shift, number)| number >> shift)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn it_is_that_of_a_division(a in number(), b in number().prop_filter("not by 0", |b| *b != 0)) {
            prop_assert_eq!(quotient(a, b), a / b);
        }

        #[test]
        fn it_is_that_beside_multiples_too(b in number().prop_filter("not by 0", |b| *b != 0), share in 0.0..1.0) {
            let most = (MOST as i64 - 2) / b.abs();
            let multiple = (most as f64 * share) as i64 * b;
            for a in [multiple - 1, multiple, multiple + 1] {
                prop_assert_eq!(quotient(a, b), a / b);
            }
        }
    }
}
