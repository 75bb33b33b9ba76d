//! Which random number belongs to a place? A hash of the seed and of the way that led there.
//!
//! A *path* is 32 bits. It starts as the seed and takes in each call, turn of a loop and, for parts, each parameter. So a
//! number depends on where it is asked for and not on what was evaluated before; parts may be grown in any order, or not
//! at all. All of it is 32-bit integer arithmetic, which JavaScript does with `Math.imul`.
//!
//! The hash is MurmurHash3's (Appleby 2011), one word at a time.

/// The path after one more word.
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
#[must_use]
pub fn mixed(path: u32) -> u32 {
    let mut hash = path;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

/// A number from 0 up to, not including, 1.
#[must_use]
pub fn fraction(path: u32) -> f64 {
    f64::from(mixed(path)) / 4_294_967_296.0
}

/// Smooth noise over the plane, between −1 and 1, about one hill for each unit (Perlin 1985, with his later fade).
#[must_use]
pub fn noise(seed: u32, x: f64, z: f64) -> f64 {
    let (column, row) = (floor(x), floor(z));
    let (u, v) = (x - column as f64, z - row as f64);
    // What is above 32 bits wraps around.
    let left = step(seed, column as u32);
    let right = step(seed, (column + 1) as u32);
    let dot = |side: u32, along: i64, u: f64, v: f64| {
        let hash = mixed(step(side, along as u32));
        let component = |bits: u32| f64::from(bits) / 32_767.5 - 1.0;
        component(hash & 0xffff) * u + component(hash >> 16) * v
    };
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (s, t) = (fade(u), fade(v));
    let (a, b) = (dot(left, row, u, v), dot(right, row, u - 1.0, v));
    let (c, d) = (dot(left, row + 1, u, v - 1.0), dot(right, row + 1, u - 1.0, v - 1.0));
    let near = a + (b - a) * s;
    let far = c + (d - c) * s;
    near + (far - near) * t
}

/// Rounded down; without a call into the machine's library, which has one where processors of all ages must do.
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from((whole as f64) > x)
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
    fn noise_is_bounded_and_zero_where_the_lattice_is() {
        let values = (0..10_000).map(|i| noise(3, f64::from(i) * 0.137 - 500.0, f64::from(i % 97) * 0.31));
        assert!(values.into_iter().all(|v| v.abs() <= 1.0));
        assert_eq!(noise(3, -4.0, 17.0), 0.0);
    }
}
