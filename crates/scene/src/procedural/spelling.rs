//! Which known name was meant?

/// What other languages call something, and what it is called here.
const ELSEWHERE: [(&str, &str); 14] = [
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
];

/// The known name that is most like this one, when one is like it: at most a third of its letters differ, or all do by
/// their case only; or the one that means what this means elsewhere.
#[must_use]
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let known: Vec<_> = known.into_iter().collect();
    let here = ELSEWHERE.iter().find(|(elsewhere, _)| *elsewhere == name);
    if let Some((_, here)) = here.filter(|(_, here)| known.contains(here)) {
        return Some((*here).to_owned());
    }
    let most = name.chars().count().div_ceil(3);
    let far = |known: &str| usize::from(!known.eq_ignore_ascii_case(name)) * distance(name, known);
    let distances = known.into_iter().map(|known| (far(known), known));
    distances
        .filter(|(distance, _)| *distance <= most)
        .min()
        .map(|(_, known)| known.to_owned())
}

/// Letters to insert, delete, replace or swap with the next (optimal string alignment).
fn distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.chars().collect();
    let b: Vec<char> = b.chars().collect();
    let mut rows = vec![(0..=b.len()).collect::<Vec<_>>()];
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let differs = usize::from(a[i - 1] != b[j - 1]);
            row[j] = (rows[i - 1][j] + 1)
                .min(row[j - 1] + 1)
                .min(rows[i - 1][j - 1] + differs);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(rows[i - 2][j - 2] + 1);
            }
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}
