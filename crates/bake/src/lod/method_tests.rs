use std::collections::BTreeMap;

use super::quadric_tests::places;
use super::tests::{by, check_chain, model, soup, sphere, terrain};
use super::*;

fn count(primitives: &[Primitive]) -> usize {
    primitives.iter().map(Primitive::count).sum()
}

#[test]
fn the_octree_leaves_as_many_shapes_as_are_asked_for() {
    let model = model([terrain(40)]);
    let known = places(&model.primitives);
    for (order, measures) in [
        (Order::LeastError, Measures::default()),
        (Order::MostVertices, Measures::THESIS),
        (Order::FewestVertices, Measures::THESIS),
    ] {
        let settings = LodSettings {
            octree: OctreeSettings { order, measures },
            ..by(Method::Octree)
        };
        let mut generator = Generator::new(&model, &settings);
        for target in [2000, 1200, 333, 90, 20] {
            let mesh = generator.octree_mesh(target).unwrap();
            assert!(places(&mesh).is_subset(&known), "a position that the source has not");
            let left = count(&mesh);
            assert!(
                left <= target + target / 10 && 2 * left >= target,
                "{order:?}: {left} of {target}"
            );
        }
        check_chain("terrain", &model, &chain(&model, &settings));
    }
}

#[test]
fn flat_parts_cost_nothing_in_order_of_error() {
    let flat = Primitive {
        positions: terrain(40).positions.iter().map(|p| [p[0], 0.0, p[2]]).collect(),
        ..terrain(40)
    };
    let model = model([flat]);
    let level = Generator::new(&model, &by(Method::Octree)).level(40).unwrap();
    // As small as the measure can tell apart: a few ten-thousandths of the diagonal.
    assert!(level.geometric_error < 0.05, "{}", level.geometric_error);
}

#[test]
fn the_best_of_both_is_never_worse_than_either() {
    for mesh in [sphere(48, 24), terrain(32), soup(1_500)] {
        let model = model([mesh]);
        for target in [900, 200] {
            let error = |method| {
                let level = Generator::new(&model, &by(method)).level(target);
                level.unwrap().geometric_error
            };
            let best = error(Method::Best);
            assert!(best <= error(Method::Octree) && best <= error(Method::Quadric));
        }
    }
}

#[test]
fn what_the_author_made_coarser_is_taken_where_nothing_smaller_is_nearer() {
    let at_height = |primitive: Primitive, height: f32| Primitive {
        positions: primitive.positions.iter().map(|p| [p[0], height, p[2]]).collect(),
        ..primitive
    };
    let (flat, quad) = (at_height(terrain(40), 0.0), at_height(terrain(1), 0.0));
    let with = |coarser: &[&Primitive]| SourceModel {
        coarser: coarser.iter().map(|primitive| vec![(*primitive).clone()]).collect(),
        ..model([flat.clone()])
    };
    let settings = by(Method::Best);
    let authored = with(&[&quad]);
    let levels = chain(&authored, &settings).levels;
    assert_eq!(levels.last().unwrap().primitives, std::slice::from_ref(&quad));
    assert!(levels.last().unwrap().geometric_error < 0.05);
    // Far off and larger than that, so nobody would choose it.
    let far = at_height(terrain(8), 1e3);
    assert_eq!(chain(&with(&[&far, &quad]), &settings).levels, levels);
    check_chain("authored", &authored, &LodChain { levels });
}

#[test]
fn parts_of_a_mesh_stay_together_along_their_cuts() {
    let whole = terrain(40);
    let half = whole.indices.len() / 2;
    // The cut runs along the row of vertices that both halves have.
    let cut: Vec<[f32; 3]> = whole.positions[20 * 41..21 * 41].to_vec();
    let ends = |a: [f32; 3], b: [f32; 3]| {
        // −0 is 0.
        let mut ends = [a, b].map(|p| p.map(|x| (x + 0.0).to_bits()));
        ends.sort_unstable();
        ends
    };
    for indices in [&whole.indices[..half], &whole.indices[half..]] {
        let part = SourceModel {
            cut_positions: cut.clone(),
            ..model([whole.subset(indices.to_vec())])
        };
        for method in [Method::Octree, Method::Quadric, Method::Best] {
            let chain = chain(&part, &by(method));
            assert!(chain.levels.len() > 1);
            for level in &chain.levels {
                let mut edges: BTreeMap<_, usize> = BTreeMap::new();
                for [a, b, c] in level.primitives.iter().flat_map(Primitive::triangles) {
                    for edge in [ends(a, b), ends(b, c), ends(c, a)] {
                        *edges.entry(edge).or_default() += 1;
                    }
                }
                assert!(
                    cut.windows(2).all(|pair| edges.contains_key(&ends(pair[0], pair[1]))),
                    "{method}: a crack"
                );
            }
        }
    }
}

#[test]
fn cleaning_takes_doublets_away_and_nothing_else() {
    let sheet = terrain(10);
    let mut twice = sheet.clone();
    let doublets = sheet.indices.iter().map(|i| i + sheet.positions.len() as u32);
    twice.indices.extend(doublets);
    twice.positions.extend(sheet.positions.clone());
    twice.normals.extend(sheet.normals.clone());
    twice.uvs[0].extend(sheet.uvs[0].clone());
    twice.positions.push([9.0; 3]);
    twice.normals.push([0.0, 1.0, 0.0]);
    twice.uvs[0].push([0.0; 2]);
    let cleaned = clean(&model([twice]), &LodSettings::default());
    assert_eq!(cleaned.primitives.len(), 1);
    assert_eq!(cleaned.primitives[0].count(), sheet.count());
    assert_eq!(cleaned.primitives[0].positions.len(), sheet.positions.len());
    assert!(error::rms(&cleaned.primitives, &[sheet], 500) < 1e-12);
}

#[test]
fn what_hardly_is_a_mesh_gives_a_chain() {
    let points = |topology, positions: Vec<[f32; 3]>| Primitive {
        topology,
        indices: (0..positions.len() as u32).collect(),
        positions,
        ..Primitive::default()
    };
    let in_one_place = points(Topology::Triangles, vec![[1.0; 3]; 300]);
    let on_a_line = points(Topology::Triangles, (0..300).map(|i| [i as f32, 0.0, 0.0]).collect());
    let vast = points(
        Topology::Triangles,
        [[f32::MAX, 0.0, 1.0], [f32::MIN, 1.0, 0.0], [0.0; 3]].repeat(50),
    );
    let single = points(Topology::Points, vec![[0.0; 3]]);
    let settings = LodSettings {
        min_shapes: 1,
        coarsest_shapes: 1,
        ..LodSettings::default()
    };
    for mesh in [in_one_place, on_a_line, vast, single] {
        let model = model([mesh]);
        assert!(!chain(&model, &settings).levels.is_empty());
        let kept = clean(&model, &settings)
            .primitives
            .iter()
            .map(Primitive::count)
            .sum::<usize>();
        assert!(kept <= model.primitives.iter().map(Primitive::count).sum());
    }
}

#[test]
fn targets_fall_evenly_to_the_coarsest() {
    let usual = LodSettings::default();
    assert_eq!(targets(4096, &usual), [1361, 453, 150, 50]);
    assert_eq!(targets(60, &usual), [19]);
    let many = LodSettings {
        max_levels: 10,
        usual_share: 0.95,
        coarsest_shapes: 16,
        ..usual
    };
    let falling = targets(6343, &many);
    assert_eq!((falling.len(), falling[8]), (9, 16));
    assert!(falling.windows(2).all(|pair| pair[1] < pair[0]));
}
