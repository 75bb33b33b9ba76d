//! In which words is a problem told? Names, numbers and ways out as they stand in its sentences.

use std::borrow::Cow;

use super::error::MOST_SHOWN;

/// A number with few digits, as JavaScript writes it but for the `+` of large exponents.
pub(super) fn shown(number: f64) -> String {
    // Nothing below zero is nothing.
    let number = number + 0.0;
    let size = number.abs();
    if size >= 1e21 || (size > 0.0 && size < 1e-6) {
        return format!("{number:e}");
    }
    let shortest = number.to_string();
    // Where two such lie equally near, JavaScript takes the one that ends with an even digit; so does rounding to as many.
    let Some((_, decimals)) = shortest.split_once('.') else {
        return shortest;
    };
    let even = format!("{number:.*}", decimals.len());
    if even.parse() == Ok(number) { even } else { shortest }
}

/// A word of a text, which may be as long as the text: no more of it than of a line.
#[must_use]
pub fn cut(word: &str) -> Cow<'_, str> {
    match word.char_indices().nth(MOST_SHOWN) {
        None => word.into(),
        Some((end, _)) => format!("{}…", &word[..end]).into(),
    }
}

/// Most names that a message lists.
const MOST_LISTED: usize = 12;

/// A name that was meant, or all that there are.
pub(super) fn meant(suggestion: &Option<String>, takes: &str, known: &[String]) -> String {
    if let Some(name) = suggestion {
        return format!("did you mean `{name}`?");
    }
    if known.is_empty() {
        return format!("it {takes} none");
    }
    let names: Vec<_> = known.iter().take(MOST_LISTED).map(|name| quoted(name)).collect();
    let more = if known.len() > MOST_LISTED { ", …" } else { "" };
    format!("it {takes} {}{more}", names.join(", "))
}

/// How people name a character that is not seen, or looks like another.
fn number_of(character: char) -> String {
    format!("U+{:04X}", u32::from(character))
}

/// A character as it is, by its number where one would not see it, and both where it may look like one that the language has.
pub(super) fn character(character: char) -> String {
    if is_unseen(character) {
        number_of(character)
    } else if character.is_ascii() {
        format!("`{character}`")
    } else {
        format!("`{character}` ({})", number_of(character))
    }
}

/// The first letter of a name that names here do not have, by its number: it may look like one that they have.
pub(super) fn odd_in(name: &str) -> String {
    let odd = name.chars().find(|letter| !letter.is_ascii());
    odd.map_or_else(String::new, |odd| format!(", with {},", number_of(odd)))
}

/// Blanks that are none of the language, and what has no picture at all.
pub(super) fn is_unseen(character: char) -> bool {
    character.is_control()
        || is_hidden(character)
        || matches!(character, '\u{a0}' | '\u{61c}' | '\u{1680}' | '\u{180b}'..='\u{180f}' | '\u{2000}'..='\u{200f}' | '\u{2028}'..='\u{202f}'
            | '\u{205f}' | '\u{2800}' | '\u{3000}' | '\u{fe00}'..='\u{fe0f}' | '\u{e0100}'..='\u{e01ef}')
}

/// What leaves no trace in a name, which then looks like another: fillers, tags, marks of where a word may be broken, and the like. No
/// blanks, and neither joiners nor variation selectors, which scripts and emoji need.
pub(super) fn is_hidden(character: char) -> bool {
    matches!(character, '\u{ad}' | '\u{34f}' | '\u{115f}' | '\u{1160}' | '\u{17b4}' | '\u{17b5}' | '\u{180e}' | '\u{200b}' | '\u{2060}'..='\u{206f}'
        | '\u{3164}' | '\u{feff}' | '\u{ffa0}' | '\u{fff0}'..='\u{fffb}' | '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}'
        | '\u{e0000}'..='\u{e00ff}' | '\u{e01f0}'..='\u{e0fff}')
}

/// Of a parameter whose default is a list, or is none; of the file that is named, where another one gave it.
pub(super) fn given_instead(name: &str, is_list: bool, file: Option<&str>) -> String {
    let [given, default] = if is_list {
        ["number", "list"]
    } else {
        ["list", "number"]
    };
    let of = file.map_or_else(String::new, |file| format!(" of \"{}\"", cut(file)));
    format!("`{name}`{of} was given a {given}, and its default is a {default}")
}

/// Behind `there`.
pub(super) fn of_points(count: usize) -> String {
    match count {
        1 => "is 1 point".to_owned(),
        _ => format!("are {count} points"),
    }
}

pub(super) fn counted(arguments: usize) -> String {
    match arguments {
        0 => "no arguments".to_owned(),
        1 => "1 argument".to_owned(),
        _ => format!("{arguments} arguments"),
    }
}

pub(super) fn with_article(kind: &str) -> String {
    let article = if kind.starts_with(['a', 'e', 'i', 'o', 'u']) {
        "an"
    } else {
        "a"
    };
    format!("{article} {kind}")
}

pub(super) fn quoted(name: &str) -> String {
    format!("`{name}`")
}

const ELSE_IF: &str = "write `else if`, as in `if a > 1 box(1, 1, 1) else if a > 0 sphere(1)`";

/// What other languages have and this one has not, and what to write instead.
const ABSENT: [(&str, &str, &str); 14] = [
    ("value", "true", "truth is a number: write `1`"),
    ("value", "false", "truth is a number: write `0`"),
    ("statement", "elif", ELSE_IF),
    ("statement", "elsif", ELSE_IF),
    ("statement", "elseif", ELSE_IF),
    ("rule", "elif", ELSE_IF),
    ("rule", "elsif", ELSE_IF),
    ("rule", "elseif", ELSE_IF),
    ("value", "pi", "angles are degrees, and half a turn is 180"),
    ("value", "PI", "angles are degrees, and half a turn is 180"),
    ("function", "tan", "write `sin(x) / cos(x)`"),
    ("function", "atan", "write `atan2(y, x)`, which gives degrees"),
    ("function", "asin", "write `atan2(x, sqrt(1 - x * x))`"),
    ("function", "acos", "write `atan2(sqrt(1 - x * x), x)`"),
];

/// Colours by their names elsewhere.
const COLOURS: [(&str, &str); 9] = [
    ("red", "#f00"),
    ("green", "#080"),
    ("blue", "#00f"),
    ("yellow", "#ff0"),
    ("white", "#fff"),
    ("black", "#000"),
    ("grey", "#888"),
    ("gray", "#888"),
    ("brown", "#853"),
];

/// What to write in place of what this language has not.
pub(super) fn absent(kind: &str, name: &str) -> Option<&'static str> {
    let known = ABSENT.iter().find(|absent| (absent.0, absent.1) == (kind, name));
    known.map(|(.., instead)| *instead)
}

/// A colour as one gives it from outside: a list of its channels. It may be named, or lack its sign, which ends what a shell reads.
pub(super) fn list_of_colour(text: &str) -> Option<String> {
    let named = COLOURS.iter().find(|(name, _)| *name == text);
    let text = named.map_or(text, |(_, colour)| colour);
    let digits = text.strip_prefix('#').unwrap_or(text).chars();
    let digits: Option<Vec<u32>> = digits.map(|c| c.to_digit(16)).collect();
    let channels = match digits?[..] {
        [r, g, b] => [17 * r, 17 * g, 17 * b],
        [r, s, g, h, b, c] => [16 * r + s, 16 * g + h, 16 * b + c],
        _ => return None,
    };
    let channels = channels.map(|channel| shown((f64::from(channel) / 255.0 * 1e3).round() / 1e3));
    Some(format!("[{}]", channels.join(",")))
}

/// A name that was meant, or how such a one is given.
pub(super) fn suggested(suggestion: &Option<String>, kind: &str, name: &str) -> String {
    if let Some(instead) = absent(kind, name) {
        return format!("; {instead}");
    }
    if let Some(name) = suggestion {
        return format!("; did you mean `{name}`?");
    }
    let colour = COLOURS
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, colour)| *colour);
    if let ("value", Some(colour)) = (kind, colour) {
        return format!("; colours have no names, write `{colour}`");
    }
    let declaration = match kind {
        "rule" => format!("rule {name}() {{ … }}"),
        "function" => format!("function {name}(x) = …"),
        "material" => format!("material {name} {{ colour = {} }}", colour.unwrap_or("#888")),
        "imported file" => format!("import \"{name}.dcg\" as {name}"),
        _ => format!("let {name} = …"),
    };
    format!("; declare it, as in `{declaration}`")
}
