//! Which names look as if they marked something, and do not? `Door:front`, `cell :hall` or a name with letters of another script would
//! be lost as marks without a word.

use belvedere_scene::procedural::cut;

/// What marks nodes, of cameras too.
pub(super) const OF_NODES: &[&str] = &["avatar", "cell", "door", "occluder", "portal", "viewpoint"];

/// What marks in rules, which have a statement for viewpoints.
pub(super) const OF_RULES: &[&str] = &["cell", "door", "occluder", "portal"];

/// What looks like a colon.
const COLONS: [char; 7] = [':', '：', '∶', 'ː', '꞉', '﹕', '։'];

/// Letters of other scripts that look like these when they are small.
const LETTERS: [(char, &str); 10] = [
    ('a', "аα"),
    ('c', "сϲ"),
    ('d', "ԁ"),
    ('e', "еε"),
    ('i', "іι"),
    ('l', "ӏ"),
    ('o', "оοօ"),
    ('p', "рρ"),
    ('t', "тτ"),
    ('v', "ѵν"),
];

pub(super) const KIND: &str = "name that looks as if it marked something and does not: nothing but a name; a mark is written in small letters \
                               from a to z, with `:` at once behind it";

/// Which of these marks a name looks like and has not, with the name.
pub(super) fn told(name: &str, kinds: &[&str]) -> Option<String> {
    let (end, colon) = name.char_indices().find(|(_, c)| COLONS.contains(c))?;
    let stem = &name[..end];
    let folded: String = stem.chars().filter_map(folded).collect();
    let kind = *kinds.iter().find(|kind| **kind == folded)?;
    if stem == kind && colon == ':' {
        return None;
    }
    let beginning = &name[..end + colon.len_utf8()];
    let odd = beginning.chars().find(|c| !c.is_ascii());
    let odd = odd.map_or_else(String::new, |odd| format!(", with U+{:04X},", u32::from(odd)));
    Some(format!("{:?}{odd} looks like `{kind}:`", cut(name)))
}

/// The small letter that it looks like; nothing for what is a blank or leaves no trace.
fn folded(letter: char) -> Option<char> {
    let is_blank = letter.is_whitespace() || letter.is_control();
    let is_hidden = matches!(letter, '\u{ad}' | '\u{200b}'..='\u{200f}' | '\u{2060}'..='\u{2064}' | '\u{feff}');
    if is_blank || is_hidden {
        return None;
    }
    let narrow = match letter {
        // As wide as what stands in a column of Chinese or Japanese.
        '\u{ff21}'..='\u{ff5a}' => char::from_u32(u32::from(letter) - 0xfee0).unwrap_or(letter),
        _ => letter,
    };
    let small = narrow.to_lowercase().next().unwrap_or(narrow);
    let known = LETTERS.iter().find(|(_, alike)| alike.contains(small));
    Some(known.map_or(small, |(letter, _)| *letter))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_looks_like_a_mark_and_is_none_is_told() {
        for (name, wanted) in [
            ("Door:x", "\"Door:x\" looks like `door:`"),
            ("\u{441}ell:x", "\"\u{441}ell:x\", with U+0441, looks like `cell:`"),
            ("cell :x", "\"cell :x\" looks like `cell:`"),
            (
                "\u{ff43}ell:hall",
                "\"\u{ff43}ell:hall\", with U+FF43, looks like `cell:`",
            ),
            (
                "portal\u{ff1a}1",
                "\"portal\u{ff1a}1\", with U+FF1A, looks like `portal:`",
            ),
            (" OCCLUDER:", "\" OCCLUDER:\" looks like `occluder:`"),
            ("Viewpoint:Hall", "\"Viewpoint:Hall\" looks like `viewpoint:`"),
        ] {
            assert_eq!(told(name, OF_NODES).as_deref(), Some(wanted), "{name}");
        }
        for name in [
            "door:x",
            "cell:Door:y",
            "Door",
            "Doors:x",
            "floor:x",
            ":",
            "",
            "lamp: cell:x",
        ] {
            assert_eq!(told(name, OF_NODES), None, "{name}");
        }
    }
}
