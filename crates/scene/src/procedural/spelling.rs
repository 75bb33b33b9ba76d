//! Which known name was meant?

/// What other languages call something, and what it is called here.
const ELSEWHERE: [(&str, &str); 16] = [
    ("cube", "box"),
    ("cuboid", "box"),
    ("ball", "sphere"),
    ("plane", "polygon"),
    ("extrude", "prism"),
    ("translate", "move"),
    ("rotate", "turn"),
    ("repeat", "for"),
    ("while", "for"),
    ("switch", "choose"),
    ("pow", "power"),
    ("lerp", "mix"),
    ("len", "count"),
    ("length", "count"),
    ("color", "paint"),
    ("colour", "paint"),
];

/// The known name that is most like this one, when one is like it: of the letters of the longer one at most a third differ, or
/// one, or all by their case only; or the one that means what this means elsewhere. Never the very same.
#[must_use]
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let known: Vec<_> = known.into_iter().filter(|known| *known != name).collect();
    let here = ELSEWHERE.iter().find(|(elsewhere, _)| *elsewhere == name);
    if let Some((_, here)) = here.filter(|(_, here)| known.contains(here)) {
        return Some((*here).to_owned());
    }
    let letters = name.chars().count();
    let most = |known: &str| (letters.max(known.chars().count()) / 3).max(1);
    // Letters to insert, delete, replace or swap with the next.
    let far = |known: &str| match known.eq_ignore_ascii_case(name) {
        true => 0,
        false => strsim::osa_distance(name, known),
    };
    let distances = known.into_iter().map(|known| (far(known), known));
    distances
        .filter(|&(distance, known)| distance <= most(known))
        .min()
        .map(|(_, known)| known.to_owned())
}
