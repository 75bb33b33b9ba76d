//! Is every cut a mesh, and the one that its view asks for?

use std::collections::HashMap;
use std::path::Path;

use proptest::prelude::*;

use super::super::mesh::NONE;
use super::super::{Decoder, Header};
use super::front::Front;
use super::{ClusterTree, Selection, View};

const NAMES: [&str; 5] = ["bowl", "soup", "cube", "plain", "nothing"];

fn stream(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/smooth");
    std::fs::read(folder.join(format!("{name}.slod"))).unwrap()
}

fn decoded(bytes: &[u8]) -> Decoder {
    let mut decoder = Decoder::new(1 << 24);
    decoder.push(bytes).unwrap();
    decoder
}

fn view(eye: [f64; 3], most_error_px: f64) -> View {
    View {
        eye,
        planes: Vec::new(),
        pixels: 1000.0,
        most_error_px,
        outside: 1.0,
    }
}

/// Only what lies in a cone of four planes around a direction.
fn cone(eye: [f64; 3], towards: [f64; 3], most_error_px: f64, outside: f64) -> View {
    let length = towards.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
    let ahead = towards.map(|x| x / length);
    let planes = (0..6).map(|i| {
        let mut side = [0.0; 3];
        side[i % 3] = if i < 3 { 0.7 } else { -0.7 };
        let normal: [f64; 3] = std::array::from_fn(|axis| 0.7 * ahead[axis] + side[axis]);
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
        let [x, y, z] = normal.map(|x| x / length);
        [x, y, z, -(x * eye[0] + y * eye[1] + z * eye[2])]
    });
    View {
        planes: planes.collect(),
        outside,
        ..view(eye, most_error_px)
    }
}

/// Whole in itself: the splits are a tree with its root, and corners and lists say what follows from them.
fn assert_valid(selection: &Selection) {
    let Selection { tree, front, base, .. } = selection;
    let mut drawn = Vec::new();
    for vertex in 1..tree.vertices() as u32 {
        let older = (1..vertex).rev().find(|&v| tree.next_sibling[v as usize] == vertex);
        let comes_after = older.unwrap_or(tree.parent[vertex as usize]);
        if front.is_made(vertex) {
            assert!(front.is_made(comes_after), "split {vertex} without {comes_after}");
            drawn.extend(tree.born[vertex as usize]..tree.born[vertex as usize + 1]);
        } else {
            assert!(vertex >= *base);
        }
    }
    let mut found = front.drawn.clone();
    found.sort_unstable();
    assert_eq!(found, drawn);
    let mut held: HashMap<u32, Vec<[u32; 3]>> = HashMap::new();
    for &triangle in &front.drawn {
        let corners = selection.triangle(triangle);
        let [a, b, c] = corners;
        assert!(a != b && b != c && c != a, "triangle {triangle} has a corner twice");
        for (side, cluster) in corners.into_iter().enumerate() {
            let mut vertex = tree.triangles[triangle as usize][side];
            while !front.is_made(vertex) {
                vertex = tree.parent[vertex as usize];
            }
            assert_eq!(cluster, vertex);
            held.entry(cluster).or_default().push(corners);
            if let Some(wedges) = selection.wedges(triangle) {
                let owners = tree.triangles.iter().zip(&tree.corners);
                let mut owners = owners.flat_map(|(triangle, corners)| triangle.iter().zip(corners));
                let owner = owners.find(|&(_, &wedge)| wedge == wedges[side]).unwrap().0;
                assert!(tree.holds(cluster, *owner), "a wedge from elsewhere");
            }
        }
    }
    for &cluster in &front.active {
        let mut listed = Vec::new();
        front.around(cluster, |corners| listed.push(corners));
        let mut held = held.remove(&cluster).unwrap_or_default();
        listed.sort_unstable();
        held.sort_unstable();
        assert_eq!(listed, held);
    }
    assert!(held.is_empty());
}

/// All that the view may ask of a settled cut, by the errors and balls of the tree.
fn assert_good_enough(selection: &Selection, view: &View) {
    let Selection { tree, front, .. } = selection;
    for split in 1..tree.vertices() as u32 {
        if front.is_made(split) {
            let last = front.is_last(tree, split) && split >= selection.base;
            assert!(!last || view.keeps(tree, split), "split {split} is of no use");
            continue;
        }
        let at = tree.positions[tree.parent[split as usize] as usize];
        let radius = tree.radii[split as usize];
        let along = |x: f64, y: f64, z: f64| x * at[0] + y * at[1] + z * at[2];
        // Rounding may put a ball a little out of the one that holds it.
        let is_seen = view
            .planes
            .iter()
            .all(|&[x, y, z, w]| along(x, y, z) + w >= -radius * (1.0 - 1e-9));
        let most = view.most_error_px * if is_seen { 1.0 } else { view.outside };
        if most == f64::INFINITY {
            continue;
        }
        let away: f64 = (0..3)
            .map(|axis| (at[axis] - view.eye[axis]).powi(2))
            .sum::<f64>()
            .sqrt();
        let on_screen = tree.errors[split as usize] * view.pixels;
        assert!(
            on_screen <= most * (away - radius).max(0.0) * (1.0 + 1e-9),
            "split {split} is missing"
        );
    }
}

fn settle(selection: &mut Selection, view: &View) -> (usize, usize) {
    let (mut splits, mut merges) = (0, 0);
    for _ in 0..10_000 {
        let progress = selection.update(view, 500);
        splits += progress.splits;
        merges += progress.merges;
        if progress.is_settled {
            return (splits, merges);
        }
    }
    panic!("it never comes to rest");
}

#[test]
fn splits_in_the_order_of_the_stream_give_the_meshes_of_its_beginnings() {
    for name in NAMES {
        let bytes = stream(name);
        let tree = ClusterTree::new(&decoded(&bytes));
        let mut front = Front::new(&tree);
        let mut beginning = Decoder::new(1 << 24);
        let mut compared = 0;
        for byte in bytes {
            beginning.push(&[byte]).unwrap();
            let vertices = beginning.counts().0 as u32;
            while (front.active.len() as u32) < vertices {
                front.split(&tree, front.active.len() as u32);
            }
            let drawn: Vec<[u32; 3]> = front.drawn.iter().map(|&t| front.corners[t as usize]).collect();
            assert_eq!(drawn, beginning.lattice().triangles, "{name}");
            compared += usize::from(!drawn.is_empty());
        }
        assert!(name == "nothing" || compared > 100, "{name}");
    }
}

#[test]
fn no_error_at_all_gives_all_and_any_error_the_first_mesh() {
    for name in NAMES {
        let bytes = stream(name);
        let whole = decoded(&bytes);
        let (header, header_bytes) = Header::read(&bytes).unwrap().unwrap();
        let first = header.cuts.first().filter(|_| header.cuts.len() > 1);
        let least = first.map_or(0, |cut| cut.triangles as usize);
        let mut selection = Selection::new(ClusterTree::new(&whole), least);
        assert_eq!(selection.counts().1, least);
        settle(&mut selection, &view([0.3, 0.2, 7.0], 0.0));
        assert_valid(&selection);
        let mut drawn = selection.drawn().to_vec();
        drawn.sort_unstable();
        let lattice = whole.lattice();
        let triangles: Vec<_> = drawn.iter().map(|&t| selection.triangle(t)).collect();
        assert_eq!(triangles, lattice.triangles, "{name}");
        let wedges: Vec<_> = drawn.iter().filter_map(|&t| selection.wedges(t)).collect();
        assert_eq!(wedges, lattice.corners, "{name}");

        settle(&mut selection, &view([0.3, 0.2, 7.0], f64::INFINITY));
        assert_valid(&selection);
        let first = decoded(&bytes[..first.map_or(header_bytes, |cut| cut.bytes as usize)]);
        let mut drawn = selection.drawn().to_vec();
        drawn.sort_unstable();
        assert_eq!(drawn.len(), first.counts().1, "{name}");
        assert_eq!(selection.snapshot(&whole).indices.concat().len(), 3 * drawn.len());
        if first.counts().0 == selection.counts().0 {
            let triangles: Vec<_> = drawn.iter().map(|&t| selection.triangle(t)).collect();
            assert_eq!(triangles, first.lattice().triangles, "{name}");
        }
    }
}

#[test]
fn near_is_fine_and_far_is_coarse() {
    let whole = decoded(&stream("plain"));
    let mut selection = Selection::new(ClusterTree::new(&whole), 0);
    settle(&mut selection, &view([0.0, 1.0, 0.0], 4.0));
    let (clusters, triangles) = selection.counts();
    assert!(
        triangles * 10 < whole.counts().1 * 9 && triangles * 10 > whole.counts().1,
        "{triangles}"
    );
    // The bowl goes from x = 0 to 2.
    let active = &selection.front.active;
    let near = active
        .iter()
        .filter(|&&v| selection.tree.positions[v as usize][0] < 1.0)
        .count();
    assert!(2 * near > 3 * (clusters - near), "{near} of {clusters}");
}

#[test]
fn what_is_out_of_view_is_coarse_until_the_eye_turns() {
    let whole = decoded(&stream("plain"));
    let mut selection = Selection::new(ClusterTree::new(&whole), 0);
    let all_around = view([1.0, 0.3, 0.5], 0.5);
    settle(&mut selection, &all_around);
    let all = selection.counts().1;
    let ahead = View {
        planes: vec![[1.0, 0.0, 0.0, -1.0]],
        outside: f64::INFINITY,
        ..all_around
    };
    let (splits, merges) = settle(&mut selection, &ahead);
    let half = selection.counts().1;
    assert!(splits == 0 && merges > 20 && half * 10 < all * 9, "{half} of {all}");
    let some = View { outside: 8.0, ..ahead };
    settle(&mut selection, &some);
    assert!(selection.counts().1 > half);
}

#[test]
fn a_cut_at_rest_stays_while_little_changes() {
    let whole = decoded(&stream("plain"));
    let mut selection = Selection::new(ClusterTree::new(&whole), 0);
    let mut path = cone([1.0, 0.6, 0.5], [0.3, -1.0, 0.2], 2.0, 8.0);
    let (splits, _) = settle(&mut selection, &path);
    assert!(splits > 20);
    assert_eq!(selection.update(&path, 500).work, 0);
    path.most_error_px = 2.5;
    assert_eq!(settle(&mut selection, &path), (0, 0));
    path.most_error_px = 2.0;
    assert_eq!(settle(&mut selection, &path), (0, 0));
    path.most_error_px = 4.0;
    assert!(settle(&mut selection, &path).1 > 0);
}

#[test]
fn a_cut_grows_with_what_is_decoded() {
    let bytes = stream("bowl");
    let mut decoder = decoded(&bytes[..bytes.len() / 2]);
    let eye = view([1.0, 0.6, 0.5], 1.0);
    let mut selection = Selection::new(ClusterTree::new(&decoder), 20);
    settle(&mut selection, &eye);
    let before = selection.counts();
    decoder.push(&bytes[bytes.len() / 2..]).unwrap();
    selection.grow(ClusterTree::new(&decoder));
    assert_eq!(selection.counts().0, before.0);
    assert_valid(&selection);
    settle(&mut selection, &eye);
    assert_good_enough(&selection, &eye);
    assert!(selection.counts() > before);
}

fn eyes() -> impl Strategy<Value = (View, usize)> {
    let numbers = prop::array::uniform3(-1.0..3.0f64);
    let error = prop_oneof![Just(0.0), Just(f64::INFINITY), 0.1..50.0f64, 0.1..1000.0f64];
    let outside = prop_oneof![Just(1.0), Just(8.0), Just(f64::INFINITY)];
    (
        numbers,
        prop::array::uniform3(-1.0..1.0f64),
        error,
        outside,
        1..800usize,
    )
        .prop_map(|(eye, towards, error, outside, work)| (cone(eye, towards, error, outside), work))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn every_cut_on_every_path_is_a_mesh(
        name in prop::sample::select(&NAMES[..4]),
        part in 0.2..1.0f64,
        least in 0..60usize,
        path in prop::collection::vec(eyes(), 1..12),
    ) {
        let bytes = stream(name);
        let decoder = decoded(&bytes[..(bytes.len() as f64 * part) as usize]);
        let mut selection = Selection::new(ClusterTree::new(&decoder), least);
        let largest = 3 * decoder.counts().1 + 1;
        for (view, work) in &path {
            let before = selection.counts().0;
            let progress = selection.update(view, *work);
            prop_assert!(progress.work < work + largest);
            prop_assert_eq!(selection.counts().0, before + progress.splits - progress.merges);
            assert_valid(&selection);
        }
        let (last, _) = &path[path.len() - 1];
        settle(&mut selection, last);
        assert_valid(&selection);
        assert_good_enough(&selection, last);
    }

    #[test]
    fn a_closed_surface_stays_closed(path in prop::collection::vec(eyes(), 1..6)) {
        let mut selection = Selection::new(ClusterTree::new(&decoded(&stream("cube"))), 0);
        for (view, work) in &path {
            selection.update(view, *work);
            let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
            for &triangle in selection.drawn() {
                let [a, b, c] = selection.triangle(triangle);
                for [from, to] in [[a, b], [b, c], [c, a]] {
                    *edges.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
                }
            }
            prop_assert!(edges.values().all(|&count| count == 0));
        }
    }
}

#[test]
fn nothing_can_be_looked_at() {
    let mut selection = Selection::new(ClusterTree::new(&Decoder::new(1 << 20)), 10);
    assert!(selection.update(&view([0.0; 3], 0.0), 10).is_settled);
    assert_eq!(selection.counts(), (0, 0));
    assert_eq!(ClusterTree::default().parent.first().copied().unwrap_or(NONE), NONE);
}
