//! How is a direction two small numbers? As a point on an octahedron that is unfolded into a square.
//!
//! Meyer et al., *On floating-point normal vectors* (2010). Numbers go from −127 to 127; integers throughout.

use super::quotient::quotient;

/// The sum of the sizes of a direction's components.
const REACH: i32 = 127;

/// The direction of a point, not of unit length: the sizes of its components add up to 127.
#[must_use]
pub fn direction([x, y]: [i32; 2]) -> [i32; 3] {
    let [x, y] = [x, y].map(|v| v.clamp(-REACH, REACH));
    let z = REACH - x.abs() - y.abs();
    if z >= 0 { [x, y, z] } else { [fold(x, y), fold(y, x), z] }
}

/// The point of a direction of any length; that of +z for none.
#[must_use]
pub fn nearest([x, y, z]: [i32; 3]) -> [i32; 2] {
    let [x, y, z] = [x, y, z].map(i64::from);
    let reach = x.abs() + y.abs() + z.abs();
    if reach == 0 {
        return [0; 2];
    }
    let round = |v: i64| {
        let scaled = 2 * v.abs() * i64::from(REACH) + reach;
        (v.signum() * quotient(scaled, 2 * reach)) as i32
    };
    let [x, y] = [round(x), round(y)];
    if z >= 0 { [x, y] } else { [fold(x, y), fold(y, x)] }
}

/// Folds the lower half over an edge: the sign of 0 is +.
fn fold(x: i32, y: i32) -> i32 {
    let far = REACH - y.abs();
    if x < 0 { -far } else { far }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_that_of_its_direction() {
        for x in -REACH..=REACH {
            for y in -REACH..=REACH {
                let found = direction(nearest(direction([x, y])));
                assert_eq!(found, direction([x, y]), "{x} {y}");
            }
        }
    }
}
