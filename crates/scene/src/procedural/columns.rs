//! How many columns of a terminal does a letter take? East Asian wide ones two (Unicode, *UAX #11*), marks upon others and what is not
//! seen none (M. Kuhn, *wcwidth*, 2007), all others one. By blocks, so that both languages know the same whatever Unicode theirs is of.

use std::ops::RangeInclusive;

const NONE: [RangeInclusive<char>; 23] = [
    '\u{300}'..='\u{36f}',
    '\u{483}'..='\u{489}',
    '\u{591}'..='\u{5bd}',
    '\u{610}'..='\u{61a}',
    '\u{64b}'..='\u{65f}',
    '\u{941}'..='\u{948}',
    '\u{94d}'..='\u{94d}',
    '\u{e31}'..='\u{e31}',
    '\u{e34}'..='\u{e3a}',
    '\u{e47}'..='\u{e4e}',
    '\u{1160}'..='\u{11ff}',
    '\u{1ab0}'..='\u{1aff}',
    '\u{1dc0}'..='\u{1dff}',
    '\u{200b}'..='\u{200f}',
    '\u{202a}'..='\u{202e}',
    '\u{2060}'..='\u{206f}',
    '\u{20d0}'..='\u{20ff}',
    '\u{302a}'..='\u{302d}',
    '\u{3099}'..='\u{309a}',
    '\u{fe00}'..='\u{fe0f}',
    '\u{fe20}'..='\u{fe2f}',
    '\u{feff}'..='\u{feff}',
    '\u{e0000}'..='\u{e0fff}',
];

const TWO: [RangeInclusive<char>; 15] = [
    '\u{1100}'..='\u{115f}',
    '\u{2e80}'..='\u{303e}',
    '\u{3041}'..='\u{4dbf}',
    '\u{4e00}'..='\u{a4cf}',
    '\u{a960}'..='\u{a97f}',
    '\u{ac00}'..='\u{d7a3}',
    '\u{f900}'..='\u{faff}',
    '\u{fe30}'..='\u{fe6f}',
    '\u{ff01}'..='\u{ff60}',
    '\u{ffe0}'..='\u{ffe6}',
    '\u{1b000}'..='\u{1b2ff}',
    '\u{1f300}'..='\u{1f64f}',
    '\u{1f680}'..='\u{1f6ff}',
    '\u{1f900}'..='\u{1f9ff}',
    '\u{20000}'..='\u{3fffd}',
];

fn columns_of(letter: char) -> usize {
    let is_in = |ranges: &[RangeInclusive<char>]| ranges.iter().any(|range| range.contains(&letter));
    if is_in(&NONE) {
        0
    } else if is_in(&TWO) {
        2
    } else {
        1
    }
}

/// Blanks as wide as so many letters of a text, so that what stands behind them is below the next one.
pub(super) fn columns_before(text: &str, letters: usize) -> String {
    let before = text.chars().take(letters);
    before
        .map(|letter| match letter {
            '\t' => "\t",
            _ => &"  "[..columns_of(letter)],
        })
        .collect()
}
