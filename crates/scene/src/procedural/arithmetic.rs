//! How is the same angle the same everywhere? Functions made of + − × ÷, square roots and rounding down only.
//!
//! IEEE 754 defines those to the last bit, and neither Rust nor JavaScript contracts or reorders them. The functions of a
//! machine's library differ in their last bits, so none of them is used: `viewer/core/procedural/arithmetic.ts` holds the
//! same steps in the same order. Angles are in degrees, so that quarter turns are exact.

const RADIANS: f64 = 0.017_453_292_519_943_295;

/// From 2⁵² on numbers have no place for halves: adding it rounds, and what is as large is whole.
const WHOLE: f64 = 4_503_599_627_370_496.0;

/// Rounded down, as IEEE 754 has it; without a call into the machine's library, which has one where processors of all
/// ages must do, and without a branch.
#[inline(always)]
#[must_use]
pub(super) fn floor(x: f64) -> f64 {
    let near = ((x.abs() + WHOLE) - WHOLE).copysign(x);
    let below = if near > x { near - 1.0 } else { near };
    if x.abs() < WHOLE { below } else { x }
}

/// Sine and cosine of an angle in degrees; multiples of 90 are exact.
#[must_use]
pub fn sin_cos(degrees: f64) -> (f64, f64) {
    let ([sin], [cos]) = sin_cos_of_each(&[degrees]);
    (sin, cos)
}

/// Sines and cosines of several angles side by side, which takes hardly longer than those of one.
#[inline(always)]
pub(super) fn sin_cos_of_each<const N: usize>(degrees: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut sin, mut cos, mut x, mut quarters) = ([1.0; N], [1.0; N], [0.0; N], [0; N]);
    for i in 0..N {
        let turned = degrees[i] - 360.0 * floor(degrees[i] / 360.0);
        let quarter = floor(turned / 90.0 + 0.5);
        x[i] = (turned - 90.0 * quarter) * RADIANS;
        // Of angles beyond 2⁵³, which have no turns left, the remainder is not small.
        quarters[i] = (quarter - 4.0 * floor(0.25 * quarter)) as i32;
    }
    // Taylor's series within an eighth of a turn; the first term left out is below 2⁻⁵³.
    for k in [8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0] {
        for i in 0..N {
            let z = x[i] * x[i];
            sin[i] = 1.0 - sin[i] * z / (2.0 * k * (2.0 * k + 1.0));
            cos[i] = 1.0 - cos[i] * z / (2.0 * k * (2.0 * k - 1.0));
        }
    }
    for i in 0..N {
        let (s, c) = (x[i] * sin[i], cos[i]);
        let (s, c) = if quarters[i] & 1 == 1 { (c, s) } else { (s, c) };
        sin[i] = if quarters[i] & 2 == 2 { -s } else { s };
        cos[i] = if (quarters[i] + 1) & 2 == 2 { -c } else { c };
    }
    (sin, cos)
}

/// The angle of the direction (x, y) in degrees, from −180 to 180; 0 for no direction.
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    let (across, along) = (y.abs(), x.abs());
    if across == 0.0 && along == 0.0 {
        return 0.0;
    }
    let acute = if across <= along {
        arc(across / along)
    } else {
        90.0 - arc(along / across)
    };
    let upper = if x < 0.0 { 180.0 - acute } else { acute };
    if y < 0.0 { -upper } else { upper }
}

/// Arc tangent from 0 to 1: halved three times, then the series.
fn arc(tangent: f64) -> f64 {
    let mut t = tangent;
    for _ in 0..3 {
        t /= 1.0 + (1.0 + t * t).sqrt();
    }
    let z = t * t;
    let mut sum = 0.0;
    for k in [17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0] {
        sum = 1.0 / k - z * sum;
    }
    8.0 * t * sum / RADIANS
}

/// A whole power, by squaring.
#[must_use]
pub fn power(base: f64, exponent: i32) -> f64 {
    let mut result = 1.0;
    let mut square = base;
    let mut left = exponent.unsigned_abs();
    while left > 0 {
        if left & 1 == 1 {
            result *= square;
        }
        square *= square;
        left >>= 1;
    }
    if exponent < 0 { 1.0 / result } else { result }
}

/// Linear light of an sRGB channel (IEC 61966-2-1), to four decimals: x^2.4 is x² times the fifth root of x².
#[must_use]
pub fn linear_light(channel: f64) -> f64 {
    let linear = if channel <= 0.04045 {
        channel / 12.92
    } else {
        let base = (channel + 0.055) / 1.055;
        base * base * fifth_root(base * base)
    };
    (linear * 1e4 + 0.5).floor() / 1e4
}

/// By Newton's method from above, for numbers from 0.001 to about 1.
fn fifth_root(x: f64) -> f64 {
    let mut root = 1.0;
    for _ in 0..24 {
        let fourth = root * root * root * root;
        root -= (root * fourth - x) / (5.0 * fourth);
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarter_turns_are_exact() {
        let quarters = [-450.0, -90.0, 0.0, 90.0, 180.0, 270.0, 720.0].map(sin_cos);
        let wanted = [
            (-1.0, 0.0),
            (-1.0, 0.0),
            (0.0, 1.0),
            (1.0, 0.0),
            (0.0, -1.0),
            (-1.0, 0.0),
            (0.0, 1.0),
        ];
        assert_eq!(quarters, wanted);
    }

    #[test]
    fn rounding_down_is_what_the_machine_calls_so() {
        let near = [
            0.0,
            0.3,
            0.5,
            1.0,
            1.5,
            2.5,
            1e-300,
            4.5e15,
            2.25e15,
            3e18,
            f64::MAX,
            f64::INFINITY,
        ];
        let beyond = near.map(|x| x * 1.000_000_1);
        for x in near.into_iter().chain(beyond).flat_map(|x| [x, -x]) {
            assert_eq!(floor(x).to_bits(), x.floor().to_bits(), "{x}");
        }
        assert!(floor(f64::NAN).is_nan());
    }

    #[test]
    fn they_are_what_they_are_called() {
        for i in -4000i32..4000 {
            let degrees = f64::from(i) * 0.377;
            let (sin, cos) = sin_cos(degrees);
            assert!((sin - degrees.to_radians().sin()).abs() < 1e-14, "{degrees}");
            assert!((cos - degrees.to_radians().cos()).abs() < 1e-14, "{degrees}");
            let (y, x) = (f64::from(i) * 0.01, f64::from(i % 77) - 38.0);
            assert!((atan2(y, x) - y.atan2(x).to_degrees()).abs() < 1e-12, "{y} {x}");
            let channel = f64::from(i.abs()) / 4000.0;
            let wanted = if channel <= 0.04045 {
                channel / 12.92
            } else {
                ((channel + 0.055) / 1.055).powf(2.4)
            };
            assert!((linear_light(channel) - wanted).abs() < 1e-4, "{channel}");
        }
        assert_eq!(
            (power(1.5, 7), power(2.0, -3), power(9.0, 0)),
            (1.5f64.powi(7), 0.125, 1.0)
        );
    }
}
