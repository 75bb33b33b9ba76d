//! Where is the visitor going? Its velocity, smoothed as in `viewer/core/strategy/motion.ts`, so that one step aside is no turn.

/// How quickly a new velocity is believed, as a rate per second.
const RESPONSE_PER_S: f64 = 4.0;
/// Who moves faster than this was put somewhere else.
const FASTEST_MPS: f64 = 40.0;
/// Who moves more slowly stands.
const SLOWEST_MPS: f64 = 0.2;

/// Follows one visitor.
#[derive(Debug, Clone, Default)]
pub struct Motion {
    last: Option<(f64, [f64; 3])>,
    velocity_mps: [f64; 3],
}

impl Motion {
    /// The visitor is there at this time, in seconds from any beginning.
    pub fn observe(&mut self, time_s: f64, position: [f64; 3]) {
        if let Some((before_s, before)) = self.last.filter(|(before_s, _)| time_s > *before_s) {
            let passed_s = time_s - before_s;
            let now: [f64; 3] = std::array::from_fn(|a| (position[a] - before[a]) / passed_s);
            if length(now) > FASTEST_MPS {
                self.velocity_mps = [0.0; 3];
            } else {
                let blend = 1.0 - (-RESPONSE_PER_S * passed_s).exp();
                self.velocity_mps =
                    std::array::from_fn(|a| self.velocity_mps[a] + blend * (now[a] - self.velocity_mps[a]));
            }
        }
        self.last = Some((time_s, position));
    }

    /// Metres a second along each axis; nothing for who stands.
    #[must_use]
    pub fn velocity_mps(&self) -> [f64; 3] {
        if length(self.velocity_mps) < SLOWEST_MPS {
            [0.0; 3]
        } else {
            self.velocity_mps
        }
    }
}

pub(super) fn length(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_walks_has_a_direction_and_who_stands_or_jumps_has_none() {
        let mut motion = Motion::default();
        assert_eq!(motion.velocity_mps(), [0.0; 3]);
        for tick in 0..20 {
            motion.observe(f64::from(tick) * 0.1, [f64::from(tick) * 0.15, 1.5, 0.0]);
        }
        let [x, y, z] = motion.velocity_mps();
        assert!((x - 1.5).abs() < 0.01 && y == 0.0 && z == 0.0, "{x} {y} {z}");
        motion.observe(2.0, [900.0, 1.5, 0.0]);
        assert_eq!(motion.velocity_mps(), [0.0; 3]);
    }
}
