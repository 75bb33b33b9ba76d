//! Which coarsest levels travel together?
//!
//! Who enters a cell wants the coarsest level of hundreds of models, each a file of a few hundred bytes: requests, not
//! bytes, are what that costs. So models that the same cells see share a *pack*, their files one after the other. Every
//! model is in one pack at most, and still has its own file.
//!
//! Method: models with the same set of cells form a group; then, as in agglomerative clustering (Ward 1963), the two groups
//! are joined that waste the fewest bytes for each request that it saves: as long as that is less than a request itself
//! costs; then, while cells need many requests, until [`MOST_WASTE`] of what is fetched was not wanted. In large worlds
//! only groups of neighbouring models are compared. Deterministic.

use std::{
    cmp::{Ordering, Reverse},
    collections::{BTreeMap, BinaryHeap},
};

use belvedere_scene::{
    BlobName,
    manifest::PackSummary,
    object::{Model, PackRef},
};
use rayon::prelude::*;

use super::{
    BakeError,
    models::{Models, coarsest},
    sink::Ledger,
};
use crate::cells::ViewCell;

/// About what the headers of a request and of its answer take: a request that costs fewer wasted bytes is saved.
const BYTES_PER_REQUEST: f64 = 512.0;
/// As long as cells cost more requests than this …
const FEW_REQUESTS: f64 = 8.0;
/// … more bytes are wasted to save some, up to this share of all bytes that cells fetch.
const MOST_WASTE: f64 = 0.05;
/// A pack is no larger than this, so that a picture can be drawn before all of it is there.
pub(super) const MOST_PACK_BYTES: u64 = 256 << 10;
/// So many groups are compared with each other; in a world of more, neighbours only.
const MOST_GROUPS: usize = 1024;

/// A file, and the cells that want it.
struct File {
    bytes: u64,
    cells: CellSet,
}

/// A set of cells: one bit for each, in words of which only those are there that hold some, rising. So it takes no more than its cells.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
struct CellSet(Vec<(u32, u64)>);

impl CellSet {
    fn insert(&mut self, cell: usize) {
        let (word, bit) = ((cell / 64) as u32, 1 << (cell % 64));
        match self.0.binary_search_by_key(&word, |(word, _)| *word) {
            Ok(place) => self.0[place].1 |= bit,
            Err(place) => self.0.insert(place, (word, bit)),
        }
    }

    fn contains(&self, cell: usize) -> bool {
        let word = self.0.binary_search_by_key(&((cell / 64) as u32), |(word, _)| *word);
        word.is_ok_and(|place| self.0[place].1 >> (cell % 64) & 1 == 1)
    }

    fn count(&self) -> u64 {
        self.0.iter().map(|(_, bits)| u64::from(bits.count_ones())).sum()
    }

    /// Its cells, rising.
    fn cells(&self) -> impl Iterator<Item = usize> + '_ {
        let of_word = |(word, bits): &(u32, u64)| {
            let (word, bits) = (*word as usize, *bits);
            (0..64)
                .filter(move |bit| bits >> bit & 1 == 1)
                .map(move |bit| 64 * word + bit)
        };
        self.0.iter().flat_map(of_word)
    }

    fn shared_with(&self, other: &Self) -> u64 {
        let (mut shared, mut others) = (0, other.0.iter().peekable());
        for (word, bits) in &self.0 {
            while others.next_if(|(other, _)| other < word).is_some() {}
            if let Some((_, other)) = others.next_if(|(other, _)| other == word) {
                shared += u64::from((bits & other).count_ones());
            }
        }
        shared
    }

    fn add(&mut self, other: &Self) {
        let mut all: Vec<(u32, u64)> = self.0.iter().chain(&other.0).copied().collect();
        all.sort_by_key(|(word, _)| *word);
        all.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            kept.1 |= if is_same { next.1 } else { 0 };
            is_same
        });
        self.0 = all;
    }
}

/// Packs the coarsest levels of models by the cells that see them (for each cell the models, in any order), stores the
/// packs, and gives the models that know theirs.
pub(super) fn write(
    models: &Models<'_>,
    seen: &[Vec<usize>],
    cells: &[ViewCell],
    ledger: &Ledger<'_>,
) -> Result<(Vec<Model>, PackSummary), BakeError> {
    // Models may share a file.
    let mut places: BTreeMap<&BlobName, usize> = BTreeMap::new();
    let mut files: Vec<(usize, File)> = Vec::new();
    let mut file_of = Vec::with_capacity(models.models.len());
    for (number, model) in models.models.iter().enumerate() {
        let level = coarsest(model);
        file_of.push(*places.entry(&level.url).or_insert_with(|| {
            let (bytes, cells) = (level.bytes, CellSet::default());
            files.push((number, File { bytes, cells }));
            files.len() - 1
        }));
    }
    for (cell, seen) in seen.iter().enumerate() {
        for model in seen {
            files[file_of[*model]].1.cells.insert(cell);
        }
    }
    let (of_model, files): (Vec<usize>, Vec<File>) = files.into_iter().unzip();
    let groups = grouped(&files);
    let summary = PackSummary {
        requests_per_crossing: requests_per_crossing(&files, &groups, cells),
        ..summary(&files, &groups, seen.len())
    };
    let mut refs: Vec<Option<PackRef>> = vec![None; files.len()];
    for group in groups.iter().filter(|group| group.len() > 1) {
        let whole: Vec<&[u8]> = group
            .iter()
            .map(|file| &models.coarsest_glb[of_model[*file]][..])
            .collect();
        let (url, bytes) = ledger.put("pack", whole.concat())?;
        let mut from = 0;
        for file in group {
            let url = url.clone();
            refs[*file] = Some(PackRef { url, bytes, from });
            from += files[*file].bytes;
        }
    }
    let with_pack = |(model, file): (&Model, &usize)| {
        let mut model = model.clone();
        if let Some(level) = model.levels.last_mut() {
            level.pack.clone_from(&refs[*file]);
        }
        model
    };
    Ok((models.models.iter().zip(&file_of).map(with_pack).collect(), summary))
}

/// Files in groups: rising inside, and in the order of their first files. Files that no cell wants are in none.
fn grouped(files: &[File]) -> Vec<Vec<usize>> {
    let mut groups = wanted_alike(files);
    groups.sort_by_key(|group| group.files[0]);
    let joined: Vec<Vec<Group>> = groups
        .par_chunks(MOST_GROUPS)
        .map(|neighbours| join(neighbours.to_vec()))
        .collect();
    let mut groups: Vec<_> = joined.into_iter().flatten().map(|group| group.files).collect();
    groups.iter_mut().for_each(|group| group.sort_unstable());
    groups.sort();
    groups
}

/// Files that go together.
#[derive(Debug, Clone)]
struct Group {
    files: Vec<usize>,
    bytes: u64,
    cells: CellSet,
}

impl Group {
    fn joined(&self, other: &Self) -> Self {
        let mut cells = self.cells.clone();
        cells.add(&other.cells);
        Self {
            files: [&self.files[..], &other.files].concat(),
            bytes: self.bytes + other.bytes,
            cells,
        }
    }
}

/// Groups of files that the same cells want, none larger than a pack may be unless it is one file.
fn wanted_alike(files: &[File]) -> Vec<Group> {
    let mut alike: BTreeMap<&CellSet, Vec<Group>> = BTreeMap::new();
    for (number, file) in files.iter().enumerate().filter(|(_, file)| file.cells.count() > 0) {
        let groups = alike.entry(&file.cells).or_default();
        match groups.last_mut().filter(|g| g.bytes + file.bytes <= MOST_PACK_BYTES) {
            Some(group) => {
                group.files.push(number);
                group.bytes += file.bytes;
            }
            None => groups.push(Group {
                files: vec![number],
                bytes: file.bytes,
                cells: file.cells.clone(),
            }),
        }
    }
    alike.into_values().flatten().collect()
}

/// Two groups that may be joined, by their numbers, and what that costs.
struct Joint {
    /// Bytes that cells fetch and do not want, over requests that are saved.
    price: f64,
    wasted: u64,
    saved: u64,
    groups: [usize; 2],
}

impl Joint {
    /// What joining costs, if it saves anything.
    fn of(numbers: [usize; 2], [a, b]: [&Group; 2]) -> Option<Self> {
        let saved = a.cells.shared_with(&b.cells);
        if saved == 0 || a.bytes + b.bytes > MOST_PACK_BYTES {
            return None;
        }
        let wasted = a.bytes * (b.cells.count() - saved) + b.bytes * (a.cells.count() - saved);
        Some(Self {
            price: wasted as f64 / saved as f64,
            wasted,
            saved,
            groups: numbers,
        })
    }
}

impl PartialEq for Joint {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Joint {}

impl PartialOrd for Joint {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Joint {
    fn cmp(&self, other: &Self) -> Ordering {
        self.price.total_cmp(&other.price).then(self.groups.cmp(&other.groups))
    }
}

/// Joins groups as long as that pays.
fn join(groups: Vec<Group>) -> Vec<Group> {
    let wanted: u64 = groups.iter().map(|g| g.bytes * g.cells.count()).sum();
    let mut waste_left = (wanted as f64 * MOST_WASTE / (1.0 - MOST_WASTE)) as u64;
    let mut around = CellSet::default();
    groups.iter().for_each(|group| around.add(&group.cells));
    let few = FEW_REQUESTS * around.count() as f64;
    let mut requests: u64 = groups.iter().map(|group| group.cells.count()).sum();

    let mut groups: Vec<Option<Group>> = groups.into_iter().map(Some).collect();
    let mut joints: BinaryHeap<Reverse<Joint>> = BinaryHeap::new();
    for number in 1..groups.len() {
        joints.extend(joints_of(&groups, number).map(Reverse));
    }
    while let Some(Reverse(joint)) = joints.pop() {
        let pays = joint.price <= BYTES_PER_REQUEST;
        if !pays && requests as f64 <= few {
            break;
        }
        let [a, b] = joint.groups;
        let (Some(low), Some(high)) = (&groups[a], &groups[b]) else {
            continue;
        };
        if !pays && joint.wasted > waste_left {
            continue;
        }
        waste_left = waste_left.saturating_sub(joint.wasted);
        requests -= joint.saved;
        let joined = low.joined(high);
        (groups[a], groups[b]) = (None, None);
        groups.push(Some(joined));
        joints.extend(joints_of(&groups, groups.len() - 1).map(Reverse));
    }
    groups.into_iter().flatten().collect()
}

/// What joining a group with each of those before it costs.
fn joints_of(groups: &[Option<Group>], number: usize) -> impl Iterator<Item = Joint> {
    let before = groups[..number].iter().enumerate();
    before.filter_map(move |(other, group)| {
        let pair = [group.as_ref()?, groups[number].as_ref()?];
        Joint::of([other, number], pair)
    })
}

fn summary(files: &[File], groups: &[Vec<usize>], cells: usize) -> PackSummary {
    let mut summary = PackSummary::default();
    let (mut fetched, mut wanted, mut requests) = (0, 0, 0);
    for group in groups {
        let all = group.iter().map(|file| &files[*file]);
        wanted += all.clone().map(|file| file.bytes * file.cells.count()).sum::<u64>();
        requests += cells_of(files, group).count();
        fetched += fetched_bytes(files, group);
        if group.len() > 1 {
            summary.packs += 1;
            summary.files += group.len() as u32;
            summary.bytes += all.map(|file| file.bytes).sum::<u64>();
        }
    }
    summary.requests_per_cell = requests as f64 / cells.max(1) as f64;
    summary.wasted_share = (fetched - wanted) as f64 / fetched.max(1) as f64;
    summary
}

/// The mean number of groups that a cell needs and the one before did not.
fn requests_per_crossing(files: &[File], groups: &[Vec<usize>], cells: &[ViewCell]) -> f64 {
    let crossings: usize = cells.iter().map(|cell| cell.adjacent.len()).sum();
    let new_in = |group: &Vec<usize>| {
        let around = cells_of(files, group);
        let entered = around.cells().map(|cell| &cells[cell]);
        let lacks = |before: &&u32| !around.contains(**before as usize);
        let before = |cell: &ViewCell| cell.adjacent.iter().filter(lacks).count();
        entered.map(before).sum::<usize>()
    };
    groups.iter().map(new_in).sum::<usize>() as f64 / crossings.max(1) as f64
}

/// The cells that want any of these files, which are not none.
fn cells_of(files: &[File], group: &[usize]) -> CellSet {
    let mut cells = files[group[0]].cells.clone();
    group.iter().for_each(|file| cells.add(&files[*file].cells));
    cells
}

/// What all cells together fetch of a pack.
fn fetched_bytes(files: &[File], group: &[usize]) -> u64 {
    let bytes: u64 = group.iter().map(|file| files[*file].bytes).sum();
    bytes * cells_of(files, group).count()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const CELLS: usize = 70;

    fn file(bytes: u64, cells: impl IntoIterator<Item = usize>) -> File {
        let mut set = CellSet::default();
        cells.into_iter().for_each(|cell| set.insert(cell));
        File { bytes, cells: set }
    }

    #[test]
    fn what_the_same_cells_see_is_one_pack_and_what_nobody_sees_is_in_none() {
        let files = [
            file(900, 0..40),
            file(900, 40..70),
            file(500, []),
            file(700, 0..40),
            file(800, 40..70),
        ];
        let groups = grouped(&files);
        assert_eq!(groups, [vec![0, 3], vec![1, 4]]);
        let summary = summary(&files, &groups, CELLS);
        assert_eq!((summary.packs, summary.files, summary.bytes), (2, 4, 3300));
        assert_eq!((summary.requests_per_cell, summary.wasted_share), (1.0, 0.0));
    }

    #[test]
    fn a_file_that_a_few_cells_less_want_joins_when_it_is_small_and_not_when_it_is_large() {
        let room = |bytes: u64| grouped(&[file(1000, 0..60), file(bytes, 0..50), file(1000, 0..60)]);
        assert_eq!(room(500), [vec![0, 1, 2]]);
        assert_eq!(room(9000), [vec![0, 2], vec![1]]);
    }

    #[test]
    fn no_pack_is_larger_than_it_may_be() {
        let files: Vec<_> = (0..50).map(|_| file(40_000, 0..CELLS)).collect();
        for group in grouped(&files) {
            assert!(group.len() as u64 * 40_000 <= MOST_PACK_BYTES);
        }
    }

    proptest! {
        #[test]
        fn a_set_of_cells_is_a_set(of in prop::array::uniform2(prop::collection::btree_set(0usize..300, 0..60))) {
            let [a, b] = &of;
            let [mut set, other] = [a, b].map(|cells| file(1, cells.iter().rev().copied()).cells);
            prop_assert_eq!(set.shared_with(&other), a.intersection(b).count() as u64);
            set.add(&other);
            let both: Vec<usize> = a.union(b).copied().collect();
            prop_assert_eq!(set.count(), both.len() as u64);
            prop_assert!((0..320).all(|cell| set.contains(cell) == both.contains(&cell)));
            prop_assert_eq!(set.cells().collect::<Vec<_>>(), both);
        }

        #[test]
        fn every_wanted_file_is_in_one_group_and_little_is_wasted(
            wants in prop::collection::vec((1u64..20_000, 0usize..CELLS, 0usize..30), 1..60)
        ) {
            let files: Vec<_> = wants
                .iter()
                .map(|(bytes, from, count)| file(*bytes, (*from..from + count).filter(|cell| *cell < CELLS)))
                .collect();
            let groups = grouped(&files);
            let mut packed: Vec<usize> = groups.concat();
            packed.sort_unstable();
            let wanted: Vec<usize> = (0..files.len()).filter(|i| files[*i].cells.count() > 0).collect();
            prop_assert_eq!(packed, wanted);
            let alone: Vec<_> = groups.concat().into_iter().map(|file| vec![file]).collect();
            let (packed, alone) = (summary(&files, &groups, CELLS), summary(&files, &alone, CELLS));
            let saved = (alone.requests_per_cell - packed.requests_per_cell) * CELLS as f64;
            prop_assert!(saved >= 0.0);
            let fetched: u64 = groups.iter().map(|group| fetched_bytes(&files, group)).sum();
            let wasted = packed.wasted_share * fetched as f64;
            prop_assert!(wasted <= BYTES_PER_REQUEST * saved + MOST_WASTE * fetched as f64 + 1.0);
        }
    }
}
