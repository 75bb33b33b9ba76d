//! Which random number belongs to a place? A hash of the seed and of the way that led there.
//!
//! A *path* is 32 bits. It starts as the seed and takes in each call, turn of a loop and, for parts, each parameter. So a
//! number depends on where it is asked for and not on what was evaluated before; parts may be grown in any order, or not
//! at all. All of it is 32-bit integer arithmetic, which JavaScript does with `Math.imul`.
//!
//! The hash is MurmurHash3's (Appleby 2011), one word at a time.

use super::arithmetic::floor;

/// The path after one more word.
#[inline(always)]
#[must_use]
pub fn step(path: u32, word: u32) -> u32 {
    let scrambled = word.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    (path ^ scrambled)
        .rotate_left(13)
        .wrapping_mul(5)
        .wrapping_add(0xe654_6b64)
}

/// The path after the bits of a number: the low word first.
#[must_use]
pub fn step_number(path: u32, number: f64) -> u32 {
    let bits = number.to_bits();
    step(step(path, bits as u32), (bits >> 32) as u32)
}

/// The path after a name.
#[must_use]
pub fn step_name(path: u32, name: &str) -> u32 {
    name.bytes().fold(path, |path, byte| step(path, byte.into()))
}

/// 32 well mixed bits of a path.
#[inline(always)]
#[must_use]
pub fn mixed(path: u32) -> u32 {
    let mut hash = path;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

/// A number from 0 up to, not including, 1.
#[inline(always)]
#[must_use]
pub fn fraction(path: u32) -> f64 {
    share(mixed(path))
}

/// 32 bits as a number from 0 up to 1. Processors convert numbers with a sign; this one lies bit by bit beside 2⁵².
#[inline(always)]
pub(super) fn share(bits: u32) -> f64 {
    (f64::from_bits(0x4330_0000_0000_0000 | u64::from(bits)) - 4_503_599_627_370_496.0) / 4_294_967_296.0
}

/// Smooth noise over the plane, between −1 and 1, about one hill for each unit (Perlin 1985, with his later fade). For
/// coordinates up to 2⁵⁰.
#[must_use]
pub fn noise(seed: u32, x: f64, z: f64) -> f64 {
    let [noise] = noise_of_each(seed, &[x], &[z]);
    noise
}

/// The same at several places side by side. Neighbours often lie between the same four corners of the lattice: then those are
/// looked up once.
#[inline(always)]
pub(super) fn noise_of_each<const N: usize>(seed: u32, x: &[f64; N], z: &[f64; N]) -> [f64; N] {
    let (mut u, mut v, mut corners, mut found) = ([0.0; N], [0.0; N], [[0; N]; 4], [0.0; N]);
    let (mut columns, mut rows) = ([0; N], [0; N]);
    for i in 0..N {
        // Adding 0 turns −0 into 0.
        let (column, row) = (floor(x[i]) + 0.0, floor(z[i]) + 0.0);
        (u[i], v[i]) = (x[i] - column, z[i] - row);
        (columns[i], rows[i]) = (word(column), word(row));
    }
    for i in 0..N {
        let is_new = i == 0 || (columns[i], rows[i]) != (columns[i - 1], rows[i - 1]);
        let [a, b, c, d] = &mut corners;
        (a[i], b[i], c[i], d[i]) = if is_new {
            let (left, right) = (step(seed, columns[i]), step(seed, columns[i].wrapping_add(1)));
            let next = rows[i].wrapping_add(1);
            let hash = |side: u32, along: u32| mixed(step(side, along));
            (
                hash(left, rows[i]),
                hash(right, rows[i]),
                hash(left, next),
                hash(right, next),
            )
        } else {
            (a[i - 1], b[i - 1], c[i - 1], d[i - 1])
        };
    }
    for i in 0..N {
        let dot = |hash: u32, u: f64, v: f64| component(hash & 0xffff) * u + component(hash >> 16) * v;
        let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
        let (u, v) = (u[i], v[i]);
        let (s, t) = (fade(u), fade(v));
        let (a, b) = (dot(corners[0][i], u, v), dot(corners[1][i], u - 1.0, v));
        let (c, d) = (dot(corners[2][i], u, v - 1.0), dot(corners[3][i], u - 1.0, v - 1.0));
        let near = a + (b - a) * s;
        let far = c + (d - c) * s;
        found[i] = near + (far - near) * t;
    }
    found
}

/// The low 32 bits of a whole number: what is above wraps around.
#[inline(always)]
fn word(whole: f64) -> u32 {
    // From 2⁵² to 2⁵³ the last bit of a number is its one, and the sum stays in there.
    (whole + 6_755_399_441_055_744.0).to_bits() as u32
}

/// 16 bits as a number from −1 to 1: `bits / 32767.5 - 1`, to the last bit, without a division. Their product with the upper
/// bits of 1 / 32767.5 is exact, so that only the sum with the rest is rounded.
#[inline(always)]
fn component(bits: u32) -> f64 {
    const UPPER: f64 = 1.0 / 32_768.0 + 1.0 / 2_147_483_648.0;
    const REST: f64 = 1.0 / 32_767.5 / 4_294_967_296.0;
    // As signed numbers they are known to every processor.
    let bits = f64::from(bits as i32);
    bits * UPPER + bits * REST - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_fill_their_range_evenly() {
        let mut counts = [0; 16];
        for i in 0..16_000 {
            counts[(fraction(step(7, i)) * 16.0) as usize] += 1;
        }
        assert!(counts.iter().all(|&n| (850..1150).contains(&n)), "{counts:?}");
    }

    #[test]
    fn components_are_divided_to_the_last_bit() {
        for bits in 0..=0xffff {
            assert_eq!(
                component(bits).to_bits(),
                (f64::from(bits) / 32_767.5 - 1.0).to_bits(),
                "{bits}"
            );
        }
    }

    #[test]
    fn words_are_the_low_bits_of_whole_numbers() {
        for whole in [0_i64, 1, -1, 1_000_000_007, -1_000_000_007, 1 << 40, -(1 << 40) - 3] {
            assert_eq!(word(whole as f64), whole as u32, "{whole}");
        }
    }

    #[test]
    fn noise_is_bounded_and_zero_where_the_lattice_is() {
        let values = (0..10_000).map(|i| noise(3, f64::from(i) * 0.137 - 500.0, f64::from(i % 97) * 0.31));
        assert!(values.into_iter().all(|v| v.abs() <= 1.0));
        assert_eq!(noise(3, -4.0, 17.0), 0.0);
    }
}
