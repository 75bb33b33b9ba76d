//! Which names mark nothing? What is called `cell:`, `portal:`, `occluder:` or `door:` and draws nothing would be lost without a word, and
//! so would what is called almost so.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::procedural::{DcgError, Grown, Program, SaidInFile};

use crate::defect::Defects;
use crate::import::lookalike;
use crate::import::mark::Mark;
use crate::source::{Role, SourceModel};

const KIND: &str = "`cell:`, `portal:`, `occluder:` or `door:` without geometry: not used; it is for the one statement behind the name, as in \
                    `called \"cell:hall\" box(8, 3, 6)`, and for no glTF file and nothing that is called by another name in it";

/// How often something was called so, and how often there was nothing.
#[derive(Default)]
struct Count {
    all: usize,
    nothing: usize,
}

/// Names all places in the rules that call nothing by such a name. `models` are those of the parts that have triangles, `folder` is
/// where the rules lie.
pub(super) fn note(
    grown: &Grown,
    models: &[Option<SourceModel>],
    (program, folder): (&Program, &str),
    defects: &mut Defects,
) {
    let mut known = vec![None; grown.parts.len()];
    let mut counts: BTreeMap<(SaidInFile, &str), Count> = BTreeMap::new();
    for (index, part) in grown.parts.iter().enumerate() {
        let is_marked = matches!(
            Mark::of_name(&part.name),
            Some(Mark::Authored(_) | Mark::Drawn(Role::Door))
        );
        let Some(said) = part.called.filter(|_| is_marked) else {
            continue;
        };
        let count = counts.entry((said, &part.name)).or_default();
        count.all += 1;
        count.nothing += usize::from(!has_geometry(index, (grown, models), &mut known));
    }
    let counts = counts.into_iter().filter(|(_, count)| count.nothing > 0);
    let place_of = places(program, folder);
    let places = counts.map(|((said, name), Count { all, nothing })| {
        let times = match all {
            1 => String::new(),
            _ => format!(", {nothing} of {all} times"),
        };
        format!("{}: `{name}`{times}", place_of(said))
    });
    defects.name(KIND, places);
}

/// Names all places in the rules where something is called what looks like such a name and is none.
pub(super) fn note_lookalikes(grown: &Grown, (program, folder): (&Program, &str), defects: &mut Defects) {
    let called = grown
        .parts
        .iter()
        .filter_map(|part| Some((part.called?, part.name.as_str())));
    let called: BTreeSet<(SaidInFile, &str)> = called.collect();
    let place_of = places(program, folder);
    let alike = called.into_iter().filter_map(|(said, name)| {
        Some(format!(
            "{}: {}",
            place_of(said),
            lookalike::told(name, lookalike::OF_RULES)?
        ))
    });
    defects.name(lookalike::KIND, alike);
}

/// Tells file, line and column of a place in the rules.
fn places(program: &Program, folder: &str) -> impl Fn(SaidInFile) -> String {
    let files: Vec<_> = program.files().collect();
    move |said| {
        let (file, text) = files[said.file];
        let place = DcgError::of_grown(file, text, said.at, String::new()).below(folder);
        let DcgError { file, line, column, .. } = *place;
        format!("{file}, line {line}, column {column}")
    }
}

/// Whether a part draws something under its own name.
fn has_geometry(index: usize, (grown, models): (&Grown, &[Option<SourceModel>]), known: &mut [Option<bool>]) -> bool {
    if let Some(known) = known[index] {
        return known;
    }
    let placed = || grown.parts[index].placements.iter().map(|placement| placement.part);
    let found = models[index].is_some()
        || placed().any(|part| grown.parts[part].called.is_none() && has_geometry(part, (grown, models), known));
    known[index] = Some(found);
    found
}
