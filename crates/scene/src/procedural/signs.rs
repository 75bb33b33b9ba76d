//! What to write in place of a character that means nothing here? Many look like one that does, and some are of other languages.

use std::borrow::Cow;

use super::wording::is_unseen;

/// Signs and what to write for them.
const WRITTEN: [(&str, &str); 30] = [
    ("−‐‑‒–—―﹣➖", "-"),
    ("×⋅·∙∗✕✖⨯﹡", "*"),
    ("÷∕⁄➗", "/"),
    ("﹢➕", "+"),
    ("≤≦⩽", "<="),
    ("≥≧⩾", ">="),
    ("≠", "!="),
    ("≡", "=="),
    ("﹦", "="),
    ("‹〈﹤", "<"),
    ("›〉﹥", ">"),
    ("﹙❨", "("),
    ("﹚❩", ")"),
    ("【〔", "["),
    ("】〕", "]"),
    ("﹛❴", "{"),
    ("﹜❵", "}"),
    ("、､﹐", ","),
    ("。｡", "."),
    ("&∧⋀", "and"),
    ("|∨⋁", "or"),
    ("¬", "not"),
    ("^", "power(x, whole)"),
    ("%", "mod(a, b)"),
    ("√", "sqrt(x)"),
    ("²", "power(x, 2)"),
    ("³", "power(x, 3)"),
    ("½", "0.5"),
    ("¼", "0.25"),
    ("¾", "0.75"),
];

/// Signs for which there is nothing to write, and why.
const UNWRITTEN: [(&str, &str); 6] = [
    (";", "nothing stands between statements, and `,` between arguments"),
    (":", "arguments and properties are named with `=`"),
    ("!", "write `not`, or `!=` between what should differ"),
    ("?", "write `if … then … else …`"),
    ("°", "angles are degrees anyway"),
    ("'“”„‟«»″‘’‚′", "texts stand between `\"`"),
];

/// Those of which the language is made, besides letters and digits.
const OWN: &str = "()[]{},=<>+-*/.#_\"";

pub(super) fn in_place_of(character: char) -> Cow<'static, str> {
    // As wide as what stands in a column of Chinese or Japanese.
    let narrow = match character {
        '\u{ff01}'..='\u{ff5e}' => char::from_u32(u32::from(character) - 0xfee0).unwrap_or(character),
        _ => character,
    };
    if narrow != character && (narrow.is_ascii_alphanumeric() || OWN.contains(narrow)) {
        return format!("write `{narrow}`").into();
    }
    let of = |signs: &[(&str, &'static str)]| {
        let found = signs.iter().find(|(signs, _)| signs.contains(narrow));
        found.map(|(_, written)| *written)
    };
    if let Some(written) = of(&WRITTEN) {
        return format!("write `{written}`").into();
    }
    if let Some(why) = of(&UNWRITTEN) {
        return why.into();
    }
    let told = match character {
        _ if is_unseen(character) => "write a space in its place, or nothing",
        _ if character.is_alphabetic() => "names are made of the letters a to z, digits and `_`",
        _ if character.is_numeric() => "numbers are made of the digits 0 to 9",
        _ if character.is_ascii() => "comments begin with `//`, colours with `#`",
        _ => "such signs stand in texts between `\"` and in comments behind `//`, and nowhere else",
    };
    told.into()
}
