//! How is the same angle the same everywhere? Functions made of + − × ÷, square roots and rounding down only.
//!
//! IEEE 754 defines those to the last bit, and neither Rust nor JavaScript contracts or reorders them. The functions of a
//! machine's library differ in their last bits, so none of them is used: `viewer/core/procedural/arithmetic.ts` holds the
//! same steps in the same order. Angles are in degrees, so that quarter turns are exact.

const RADIANS: f64 = 0.017_453_292_519_943_295;

/// Sine and cosine of an angle in degrees; multiples of 90 are exact.
#[must_use]
pub fn sin_cos(degrees: f64) -> (f64, f64) {
    let turned = degrees - 360.0 * (degrees / 360.0).floor();
    let quarter = (turned / 90.0 + 0.5).floor();
    let x = (turned - 90.0 * quarter) * RADIANS;
    let (sin, cos) = near_zero(x);
    match quarter as i32 & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Taylor's series within an eighth of a turn; the first term left out is below 2⁻⁵³.
fn near_zero(x: f64) -> (f64, f64) {
    let z = x * x;
    let mut sin = 1.0;
    let mut cos = 1.0;
    for k in [8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0] {
        sin = 1.0 - sin * z / (2.0 * k * (2.0 * k + 1.0));
        cos = 1.0 - cos * z / (2.0 * k * (2.0 * k - 1.0));
    }
    (x * sin, cos)
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
