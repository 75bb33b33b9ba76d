//! How much is `128k`, `3km/h`, `50ms` or `95%`, and what is no such amount?

/// Seconds of a day.
pub(super) const DAY_S: f64 = 86_400.0;
/// The most visitors at once.
const MOST_SESSIONS: u32 = 10_000;

/// `128k`, `1.5M`, `56000`: bits a second.
pub(super) fn bits_per_s(text: &str) -> Result<f64, String> {
    let units = [("k", 1e3), ("M", 1e6), ("G", 1e9), ("", 1.0)];
    above_zero(text, &units, "a bandwidth in bits a second, such as 128k or 5M")
}

/// `64M`, `500k`, `1000000`: bytes, and no fractions of one.
pub(super) fn bytes(text: &str) -> Result<u64, String> {
    let units = [("k", 1e3), ("M", 1e6), ("G", 1e9), ("", 1.0)];
    let what = "an amount of memory in whole bytes from 1 to 1000000G, such as 64M or 500k";
    let bytes = above_zero(text, &units, what)?;
    let is_whole = (bytes - bytes.round()).abs() <= bytes * f64::EPSILON && (1.0..=1e15).contains(&bytes);
    is_whole
        .then_some(bytes.round() as u64)
        .ok_or_else(|| format!("expected {what}"))
}

/// `120`, `0.5`: seconds of a walk.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    quantity(text, &[("", 1.0)])
        .filter(|seconds| *seconds > 0.0 && *seconds <= DAY_S)
        .ok_or_else(|| format!("expected a number of seconds above 0 and at most {DAY_S}, a day"))
}

/// `500`: visitors.
pub(super) fn sessions(text: &str) -> Result<u32, String> {
    let number = text.parse().ok().filter(|number| (1..=MOST_SESSIONS).contains(number));
    number.ok_or_else(|| format!("expected a whole number from 1 to {MOST_SESSIONS}"))
}

/// `7`: which of all made-up walks.
pub(super) fn seed(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| format!("expected a whole number from 0 to {}", u64::MAX))
}

/// `3km/h`, `1.5m/s`: metres a second.
pub(super) fn metres_per_s(text: &str) -> Result<f64, String> {
    let units = [("km/h", 1.0 / 3.6), ("m/s", 1.0)];
    above_zero(text, &units, "a speed, such as 3km/h or 1.5m/s")
}

/// `50ms`, `0.2s`: milliseconds.
pub(super) fn milliseconds(text: &str) -> Result<f64, String> {
    quantity(text, &[("ms", 1.0), ("s", 1000.0)])
        .filter(|ms| *ms >= 0.0)
        .ok_or_else(|| "expected a time, such as 50ms or 0.2s".to_owned())
}

/// `95%`, `0.95`: a share.
pub(super) fn share(text: &str) -> Result<f64, String> {
    let percent = quantity(text, &[("%", 1.0)]).map(|percent| percent / 100.0);
    percent
        .or_else(|| quantity(text, &[("", 1.0)]))
        .filter(|share| (0.0..=1.0).contains(share))
        .ok_or_else(|| "expected a share, such as 95% or 0.95".to_owned())
}

fn above_zero(text: &str, units: &[(&str, f64)], what: &str) -> Result<f64, String> {
    quantity(text, units)
        .filter(|value| *value > 0.0)
        .ok_or_else(|| format!("expected {what}"))
}

/// A number with the first of these units that it ends with.
fn quantity(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let (number, scale) = units
        .iter()
        .find_map(|(unit, scale)| Some((text.trim().strip_suffix(unit)?, scale)))?;
    let value = number.trim().parse::<f64>().ok()? * scale;
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_have_units() {
        assert_eq!(bits_per_s("128k"), Ok(128e3));
        assert_eq!(bits_per_s("56000"), Ok(56e3));
        assert_eq!(bytes("64M"), Ok(64_000_000));
        assert_eq!((bytes("1.1k"), bytes("0.3M")), (Ok(1100), Ok(300_000)));
        assert_eq!(
            (seconds("0.5"), sessions("10000"), seed("0")),
            (Ok(0.5), Ok(10_000), Ok(0))
        );
        assert_eq!(metres_per_s("36 km/h"), Ok(10.0));
        assert_eq!(milliseconds("0.2s"), Ok(200.0));
        assert_eq!(share("95%"), Ok(0.95));
    }

    #[test]
    fn what_is_none_is_told_what_would_be() {
        for wrong in ["", "fast", "3", "-3km/h", "NaNm/s", "infm/s"] {
            assert_eq!(
                metres_per_s(wrong),
                Err("expected a speed, such as 3km/h or 1.5m/s".to_owned()),
                "{wrong}"
            );
        }
        for wrong in ["-1", "0", "nan", "inf", "86401", "1m", ""] {
            assert_eq!(
                seconds(wrong),
                Err("expected a number of seconds above 0 and at most 86400, a day".to_owned()),
                "{wrong}"
            );
        }
        for wrong in ["0.5", "1.5", "0.0001k", "0", "-1", "1e20"] {
            assert!(bytes(wrong).is_err(), "{wrong} bytes");
        }
        for wrong in ["1.5", "0", "-1", "10001", "1e3", "many"] {
            assert_eq!(
                sessions(wrong),
                Err("expected a whole number from 1 to 10000".to_owned()),
                "{wrong}"
            );
        }
        for wrong in ["1.5", "-1", "18446744073709551616"] {
            assert!(seed(wrong).is_err_and(|told| told.contains("a whole number from 0 to 18446744073709551615")));
        }
        assert!(share("195%").is_err() && bits_per_s("0").is_err() && milliseconds("-1ms").is_err());
    }
}
