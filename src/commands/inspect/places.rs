//! How are places in a scene written for a person? With as many digits as its size calls for.

use belvedere_scene::Bounds;

/// A place is told to about this share of the scene's diagonal.
const SHARE: f64 = 1e-6;
/// No more digits than this stand behind the point.
const MOST_DIGITS: f64 = 9.0;

/// Places in a scene of one size.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places {
    /// Digits behind the point.
    digits: i32,
}

impl Places {
    /// Those in a scene within these bounds.
    pub(super) fn within(bounds: &Bounds) -> Self {
        let step_m = SHARE * bounds.diagonal_m();
        let digits = if step_m > 0.0 { -step_m.log10() } else { MOST_DIGITS };
        Self {
            digits: digits.ceil().clamp(0.0, MOST_DIGITS) as i32,
        }
    }

    /// A length in metres.
    pub(super) fn length(self, metres: f64) -> String {
        rounded(metres, self.digits)
    }

    /// A point, in metres.
    pub(super) fn point(self, point: [f64; 3]) -> String {
        three(point, self.digits)
    }

    /// A box from its least corner to its most.
    pub(super) fn span(self, bounds: &Bounds) -> String {
        format!("from {} to {}", self.point(bounds.min), self.point(bounds.max))
    }
}

/// A direction of length 1.
pub(super) fn direction(unit: [f64; 3]) -> String {
    three(unit, 6)
}

fn three(numbers: [f64; 3], digits: i32) -> String {
    format!("[{}]", numbers.map(|x| rounded(x, digits)).join(", "))
}

fn rounded(number: f64, digits: i32) -> String {
    let scale = 10f64.powi(digits);
    // Adding 0 makes −0 to 0.
    ((number * scale).round() / scale + 0.0).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_has_the_digits_that_tell_a_slit_in_a_room_and_no_more_in_a_city() {
        let within = |edge_m: f64| {
            Places::within(&Bounds {
                min: [0.0; 3],
                max: [edge_m; 3],
            })
        };
        let place = [-0.199_999_809_265_136_72, 1.000_512_34, -1e-12];
        assert_eq!(within(4.0).point(place), "[-0.2, 1.000512, 0]");
        assert_eq!(within(4.0).length(0.002), "0.002");
        assert_eq!(within(20_000.0).point(place), "[-0.2, 1, 0]");
        assert_eq!(direction([0.0, -0.6, 0.8]), "[0, -0.6, 0.8]");
    }
}
