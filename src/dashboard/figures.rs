//! What do two readings, one after the other, say to a person? A function from figures to lines, without a terminal.

use std::time::Duration;

use super::reading::{Bound, Reading};

/// The lines of a frame.
pub(super) fn lines(now: &Reading, before: &Reading, between: Duration, up: Duration) -> Vec<String> {
    let seconds = between.as_secs_f64().max(1e-3);
    // A counter never falls but when the server starts anew.
    let rate = |figure: fn(&Reading) -> f64| (figure(now) - figure(before)).max(0.0) / seconds;
    let requests = rate(|reading| reading.requests);
    let failed = rate(|reading| reading.failed);
    let asked = rate(|reading| reading.cache_hits + reading.cache_misses);
    let away = if now.catalogue_up { "" } else { " · catalogue away" };
    let failing = if failed > 0.0 {
        format!(" · {} failed/s", number(failed))
    } else {
        String::new()
    };
    let row = |name: &str, text: String| format!("  {name:<10}{text}");
    vec![
        format!("── belvedere · up {}{away} ──", clock(up)),
        row(
            "requests",
            format!(
                "{}/s · p99 {} · 304 {}{failing}",
                number(requests),
                p99(now, before),
                share(rate(|reading| reading.unchanged), requests),
            ),
        ),
        row(
            "sent",
            format!(
                "{}/s · {} connections",
                bytes(rate(|reading| reading.sent_bytes)),
                number(now.connections)
            ),
        ),
        row(
            "memory",
            format!(
                "{} of objects · {} of {}/s were there",
                bytes(now.cache_bytes),
                share(rate(|reading| reading.cache_hits), asked),
                number(asked)
            ),
        ),
        row(
            "live",
            format!(
                "{} sessions · {} movers · {} hidden at 0 B/s · {} events/s",
                number(now.sessions),
                number(now.movers),
                number(now.hushed),
                number(rate(|reading| reading.events))
            ),
        ),
        row(
            "quality",
            match now.reporting {
                0.0 => "nobody says".to_owned(),
                many => format!(
                    "{} of what is visible is there, mean of {}; worst {}",
                    share(now.quality_mean, 1.0),
                    number(many),
                    share(now.quality_worst, 1.0)
                ),
            },
        ),
        row(
            "uploads",
            format!("{} baking · {} waiting", number(now.bakes), number(now.waiting)),
        ),
    ]
}

/// The bound below which 99 of 100 answers were ready, as fine as the histogram is.
fn p99(now: &Reading, before: &Reading) -> String {
    let lately =
        |bound: &Bound| now.took.get(bound).copied().unwrap_or(0.0) - before.took.get(bound).copied().unwrap_or(0.0);
    let all = now.took.keys().next_back().map_or(0.0, lately);
    if all <= 0.0 {
        return "–".to_owned();
    }
    let bound = now.took.keys().find(|bound| lately(bound) >= 0.99 * all);
    match bound {
        Some(Bound(seconds)) if seconds.is_finite() => format!("≤ {} ms", decimals(seconds * 1e3)),
        _ => {
            let longest = now.took.keys().rev().find(|bound| bound.0.is_finite());
            format!("> {} ms", decimals(longest.map_or(0.0, |bound| bound.0) * 1e3))
        }
    }
}

fn share(part: f64, whole: f64) -> String {
    if whole > 0.0 {
        format!("{:.0} %", 100.0 * part / whole)
    } else {
        "– %".to_owned()
    }
}

/// Rates of less than ten have a decimal, if that is not 0.
fn number(value: f64) -> String {
    let tenths = (value * 10.0).round() / 10.0;
    if tenths.fract() != 0.0 && value < 10.0 {
        format!("{tenths:.1}")
    } else {
        format!("{value:.0}")
    }
}

fn decimals(value: f64) -> String {
    if value < 10.0 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    }
}

fn bytes(value: f64) -> String {
    let units = ["B", "kB", "MB", "GB"];
    let mut scaled = value;
    let mut unit = 0;
    while scaled >= 999.5 && unit + 1 < units.len() {
        scaled /= 1e3;
        unit += 1;
    }
    if unit == 0 {
        format!("{scaled:.0} B")
    } else {
        format!("{} {}", decimals(scaled), units[unit])
    }
}

fn clock(up: Duration) -> String {
    let s = up.as_secs();
    let (days, hours, minutes, seconds) = (s / 86_400, s / 3_600 % 24, s / 60 % 60, s % 60);
    if days > 0 {
        format!("{days} d {hours:02}:{minutes:02}:{seconds:02}")
    } else {
        format!("{hours:02}:{minutes:02}:{seconds:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(times: f64) -> Reading {
        Reading {
            requests: 100.0 * times,
            unchanged: 25.0 * times,
            sent_bytes: 3e6 * times,
            cache_hits: 90.0 * times,
            cache_misses: 10.0 * times,
            cache_bytes: 12_345_678.0,
            catalogue_up: true,
            connections: 4.0,
            sessions: 3.0,
            movers: 1_003.0,
            hushed: 990.0,
            events: 3.0 * times,
            reporting: 2.0,
            quality_mean: 0.98,
            quality_worst: 0.95,
            bakes: 1.0,
            took: [
                (0.0004, 98.0 * times),
                (0.0016, 99.0 * times),
                (f64::INFINITY, 100.0 * times),
            ]
            .map(|(bound, count)| (Bound(bound), count))
            .into(),
            ..Reading::default()
        }
    }

    #[test]
    fn rates_are_those_of_the_time_between_and_levels_those_of_now() {
        let lines = lines(
            &reading(3.0),
            &reading(1.0),
            Duration::from_secs(2),
            Duration::from_secs(3_725),
        );
        assert_eq!(
            lines,
            [
                "── belvedere · up 01:02:05 ──",
                "  requests  100/s · p99 ≤ 1.6 ms · 304 25 %",
                "  sent      3.0 MB/s · 4 connections",
                "  memory    12 MB of objects · 90 % of 100/s were there",
                "  live      3 sessions · 1003 movers · 990 hidden at 0 B/s · 3 events/s",
                "  quality   98 % of what is visible is there, mean of 2; worst 95 %",
                "  uploads   1 baking · 0 waiting",
            ]
        );
    }

    #[test]
    fn what_is_unknown_is_not_made_up_and_what_is_wrong_is_told() {
        let idle = Reading {
            catalogue_up: false,
            ..reading(1.0)
        };
        let quiet = lines(&idle, &idle, Duration::from_secs(1), Duration::from_secs(90_000));
        assert_eq!(quiet[0], "── belvedere · up 1 d 01:00:00 · catalogue away ──");
        assert_eq!(quiet[1], "  requests  0/s · p99 – · 304 – %");
        let failing = Reading {
            failed: 1.0,
            ..reading(2.0)
        };
        let failing = lines(&failing, &reading(1.0), Duration::from_secs(2), Duration::ZERO);
        assert!(failing[1].ends_with(" · 0.5 failed/s"), "{}", failing[1]);
        let slow = Reading {
            took: [(Bound(0.5), 1.0), (Bound(f64::INFINITY), 9.0)].into(),
            ..Reading::default()
        };
        assert_eq!(p99(&slow, &Reading::default()), "> 500 ms");
    }

    #[test]
    fn sizes_have_three_digits_at_most() {
        for (value, text) in [
            (0.0, "0 B"),
            (999.0, "999 B"),
            (999.6, "1.0 kB"),
            (12_345.0, "12 kB"),
            (5e12, "5000 GB"),
        ] {
            assert_eq!(bytes(value), text);
        }
    }
}
