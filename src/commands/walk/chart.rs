//! What does a tour look like? Quality and bytes over time, as an SVG (after Marvie & Bouatouch 2004, fig. 9).

use std::fmt::Write;

use belvedere_client::tour::{Frame, Line, Tour};
use belvedere_scene::SceneName;

use crate::commands::output::bytes;

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 320.0;
const LEFT: f64 = 60.0;
const RIGHT: f64 = 80.0;
const TOP: f64 = 50.0;
const BOTTOM: f64 = 40.0;

/// What is drawn: which scene, over which line.
pub(super) fn title(scene: &SceneName, line: &Line) -> String {
    let mut title = format!("{scene}: what a visitor sees");
    if line.bits_per_s.is_finite() {
        _ = write!(title, ", {} kbit/s", line.bits_per_s / 1000.0);
    }
    if line.latency_ms > 0.0 {
        _ = write!(title, ", {} ms", line.latency_ms);
    }
    title
}

/// Draws a tour under a title.
pub(super) fn draw(title: &str, tour: &Tour) -> String {
    let last_ms = tour.frames.last().map_or(1.0, |frame| frame.t_ms).max(1.0);
    let most_bytes = tour.frames.last().map_or(1, |frame| frame.bytes).max(1);
    let x = |t_ms: f64| LEFT + (WIDTH - LEFT - RIGHT) * t_ms / last_ms;
    let y = |share: f64| HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share;
    let curve = |of: &dyn Fn(&Frame) -> f64| {
        let mut points = String::new();
        for frame in &tour.frames {
            // A string takes whatever it is given.
            _ = write!(points, "{:.1},{:.1} ", x(frame.t_ms), y(of(frame)));
        }
        points
    };
    let quality = curve(&|frame| frame.quality);
    let fetched = curve(&|frame| frame.bytes as f64 / most_bytes as f64);
    let mut grid = String::new();
    for step in 0..=4 {
        let share = f64::from(step) / 4.0;
        _ = write!(
            grid,
            r##"<path d="M{LEFT} {y:.1}H{right}" stroke="#ddd"/><text x="{}" y="{:.1}" text-anchor="end">{:.0} %</text><text x="{}" y="{:.1}" fill="#b5651d">{}</text><text x="{:.1}" y="{}" text-anchor="middle">{:.0} s</text>"##,
            LEFT - 6.0,
            y(share) + 4.0,
            100.0 * share,
            WIDTH - RIGHT + 6.0,
            y(share) + 4.0,
            bytes((most_bytes as f64 * share) as u64),
            x(last_ms * share),
            HEIGHT - BOTTOM + 18.0,
            last_ms * share / 1000.0,
            y = y(share),
            right = WIDTH - RIGHT,
        );
    }
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12" fill="#333">
<title>{title}</title>
<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>
{grid}
<polyline points="{fetched}" fill="none" stroke="#b5651d" stroke-width="1.5"/>
<polyline points="{quality}" fill="none" stroke="#1f6f8b" stroke-width="2"/>
<text x="{LEFT}" y="20" font-size="15">{title}</text>
<text x="{LEFT}" y="40" fill="#1f6f8b">objects in sight that are there</text>
<text x="{}" y="40" fill="#b5651d" text-anchor="end">bytes fetched</text>
</svg>
"##,
        WIDTH - RIGHT,
    )
}
