//! In what order are things with numbers? Sorted digit by digit, last digit first (Knuth, *The art of computer
//! programming* 3, §5.2.5): a few passes through memory, whatever the numbers are. Three digits below the first bit in which
//! numbers differ tell nearly all apart; the few that they do not are compared.

/// Bits of a digit: as many as keep the counts in the first cache.
const DIGIT_BITS: u32 = 11;
const DIGITS: u32 = 3;
const VALUES: usize = 1 << DIGIT_BITS;
/// Fewer rows are sorted sooner by comparing them.
const LEAST_ROWS: usize = 2048;

/// Sorts rows by their first number. Rows of one number must stand in the order of their second, and stay in it.
pub(crate) fn sort(rows: &mut Vec<(u64, u32)>) {
    if rows.len() < LEAST_ROWS {
        rows.sort_unstable();
        return;
    }
    let first = rows[0].0;
    let differing = rows.iter().fold(0, |all, (number, _)| all | (number ^ first));
    let lowest = (u64::BITS - differing.leading_zeros()).saturating_sub(DIGITS * DIGIT_BITS);
    let digit = |number: u64, place: usize| (number >> (lowest + DIGIT_BITS * place as u32)) as usize & (VALUES - 1);
    let mut counts = [[0u32; VALUES]; DIGITS as usize];
    for (number, _) in rows.iter() {
        for (place, counts) in counts.iter_mut().enumerate() {
            counts[digit(*number, place)] += 1;
        }
    }
    let mut sorted = vec![(0, 0); rows.len()];
    for (place, counts) in counts.iter_mut().enumerate() {
        if counts[digit(first, place)] as usize == rows.len() {
            continue;
        }
        let mut next = 0;
        for count in counts.iter_mut() {
            next += std::mem::replace(count, next);
        }
        for row in rows.iter() {
            let place = &mut counts[digit(row.0, place)];
            sorted[*place as usize] = *row;
            *place += 1;
        }
        std::mem::swap(rows, &mut sorted);
    }
    if lowest > 0 {
        let alike = rows.chunk_by_mut(|a, b| a.0 >> lowest == b.0 >> lowest);
        alike.filter(|alike| alike.len() > 1).for_each(<[_]>::sort_unstable);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_sorted_as_by_comparing_them() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            state >> 7
        };
        for (count, mask) in [
            (0, 0),
            (1, 7),
            (100, 3),
            (5000, u64::MAX),
            (5000, 0xff00),
            (3000, 0),
            (4000, 1 << 56),
        ] {
            let mut rows: Vec<(u64, u32)> = (0..count).map(|i| (random() << 7 & mask, i)).collect();
            let mut expected = rows.clone();
            expected.sort_unstable();
            sort(&mut rows);
            assert_eq!(rows, expected, "{count} rows of {mask:x}");
        }
    }
}
