//! How do participants and simulators speak to a scene? `docs/LIVE.md` is the page for them.
//!
//! Handlers read a body, check its shape, ask the room `live` and answer; every rule is there.

mod avatar;
pub(super) mod doors;
pub(super) mod movers;
pub(super) mod sessions;

use belvedere_live::{Ms, world::Sent};
use serde::Deserialize;

/// A time in whole milliseconds, ±(2⁵³ − 1): every one of them stands apart from its neighbours in the doubles that JSON's
/// numbers are read into. To JSON Schema 10.0 is an integer.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "f64")]
struct Time(Ms);

impl TryFrom<f64> for Time {
    type Error = &'static str;

    fn try_from(ms: f64) -> Result<Self, Self::Error> {
        const MOST: f64 = ((1u64 << 53) - 1) as f64;
        if ms.fract() == 0.0 && ms.abs() <= MOST {
            Ok(Self(ms as Ms))
        } else {
            Err("a time is a whole number of milliseconds, at most 9007199254740991 from zero")
        }
    }
}

/// A pose as it is sent.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Pose {
    t_ms: Option<Time>,
    position: [f64; 3],
    orientation: Option<[f64; 4]>,
    velocity: Option<[f64; 3]>,
    acceleration: Option<[f64; 3]>,
}

const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

impl Pose {
    const SHAPE: &str = r#"{"t_ms": 0, "position": [x, y, z], "orientation": [x, y, z, w], "velocity": [x, y, z]}"#;

    fn sent(&self) -> Sent {
        Sent {
            t_ms: self.t_ms.map(|Time(t_ms)| t_ms),
            position: self.position,
            orientation: self.orientation.unwrap_or(UPRIGHT),
            velocity: self.velocity,
            acceleration: self.acceleration,
        }
    }
}
