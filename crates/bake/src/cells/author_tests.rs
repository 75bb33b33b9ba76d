use glam::DVec3;
use proptest::prelude::*;

use super::{
    AuthorError, author,
    plan::{Builder, prism},
    *,
};
use crate::{
    defect::Defects,
    frame::Frame,
    memory::Forgetful,
    occluders::Hiders,
    progress::Silent,
    source::{Authored, AuthoredShape, Role},
    visibility::{self, Method, SampledSettings, Views, VisibilitySettings, conservative::Scenery},
    world::World,
};

fn rectangle(node: &str, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2]) -> AuthoredShape {
    prism(node, &[[x0, z0], [x1, z0], [x1, z1], [x0, z1]], [0.0, 3.0])
}

/// Seen from above, with corners in the east and the west.
fn hexagon(node: &str, [x, z]: [f64; 2], radius: f64) -> AuthoredShape {
    let corner = |i: u32| {
        let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_3).sin_cos();
        [x + radius * cos, z + radius * sin]
    };
    prism(node, &(0..6).map(corner).collect::<Vec<_>>(), [0.0, 3.0])
}

fn cells(cells: Vec<AuthoredShape>, portals: Vec<AuthoredShape>) -> (Result<CellGraph, AuthorError>, Defects) {
    let mut defects = Defects::default();
    let authored = Authored {
        cells,
        portals,
        occluders: Vec::new(),
    };
    let world = World::new(&Builder::default().scene).unwrap();
    (author::build(&world, &authored, &mut defects), defects)
}

fn sound(shapes: Vec<AuthoredShape>) -> CellGraph {
    cells(shapes, Vec::new()).0.unwrap()
}

fn refusal(shapes: Vec<AuthoredShape>) -> String {
    cells(shapes, Vec::new()).0.unwrap_err().to_string()
}

fn area_m2(portal: &Portal) -> f64 {
    hull::area_m2(&portal.polygon.iter().map(|p| DVec3::from(*p)).collect::<Vec<_>>())
}

#[test]
fn hexagons_that_share_a_wall_are_adjacent_through_all_of_it() {
    let south = [0.0, 3.0f64.sqrt()];
    let graph = sound(vec![hexagon("cell:a", [0.0, 0.0], 1.0), hexagon("cell:b", south, 1.0)]);
    assert_eq!(graph.cells.len(), 2);
    for (cell, other) in [(0, 1), (1, 0)] {
        let cell = &graph.cells[cell];
        assert_eq!(cell.adjacent, [other]);
        assert!((area_m2(&cell.portals[0]) - 3.0).abs() < 1e-6);
        let hull = cell.hull.as_ref().expect("no box");
        assert_eq!((hull.planes.len(), hull.shape.points.len()), (8, 12));
    }
    // In the boxes of both, but in neither.
    assert_eq!(graph.cell_at([0.95, 1.0, 0.86]), None);
    assert!(graph.cell_at([0.0, 1.0, 0.5]).is_some());
    assert_ne!(graph.cell_at([0.0, 1.0, 0.5]), graph.cell_at([0.0, 1.0, 1.5]));
}

#[test]
fn a_box_is_a_box_whichever_way_its_faces_look() {
    let mut inside_out = rectangle("cell:a", [0.0, 4.0], [0.0, 5.0]);
    inside_out.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    let graph = sound(vec![inside_out]);
    let bounds = Bounds {
        min: [0.0; 3],
        max: [4.0, 3.0, 5.0],
    };
    assert_eq!((graph.cells[0].bounds, &graph.cells[0].hull), (bounds, &None));
}

#[test]
fn a_portal_polygon_narrows_the_opening_and_one_elsewhere_is_a_defect() {
    let quad = |node: &str, x: f64| AuthoredShape {
        node: node.to_owned(),
        triangles: vec![
            [
                DVec3::new(x, 0.0, 1.0),
                DVec3::new(x, 0.0, 2.0),
                DVec3::new(x, 2.0, 2.0),
            ],
            [
                DVec3::new(x, 0.0, 1.0),
                DVec3::new(x, 2.0, 2.0),
                DVec3::new(x, 2.0, 1.0),
            ],
        ],
        said: None,
    };
    let rooms = vec![
        rectangle("cell:a", [0.0, 4.0], [0.0, 4.0]),
        rectangle("cell:b", [4.0, 8.0], [0.0, 4.0]),
    ];
    let (graph, defects) = cells(rooms, vec![quad("portal:door", 4.01), quad("portal:nowhere", 6.0)]);
    let graph = graph.unwrap();
    let portal = &graph.cells[0].portals[0];
    assert!((area_m2(portal) - 2.0).abs() < 1e-9, "{portal:?}");
    assert!(portal.polygon.iter().all(|p| p[0] == 4.0));
    assert_eq!(
        defects.count("author's portal that lies between no two cells: not used"),
        1
    );
}

#[test]
fn more_openings_than_a_record_holds_are_refused_by_both_names() {
    let rooms = || {
        vec![
            rectangle("cell:a", [0.0, 4.0], [0.0, 200.0]),
            rectangle("cell:b", [4.0, 8.0], [0.0, 200.0]),
        ]
    };
    let openings = |count: [u32; 2]| {
        let at = |i: u32, j: u32| [0.01 * f64::from(i), 0.05 * f64::from(j)];
        let polygon = move |i: u32, j: u32| {
            let [y, z] = at(i, j);
            let [high, far] = [y + 0.008, z + 0.04];
            let [a, b, c, d] = [[y, z], [high, z], [high, far], [y, far]].map(|[y, z]| DVec3::new(4.0, y, z));
            AuthoredShape {
                node: "portal:p".to_owned(),
                triangles: vec![[a, b, c], [a, c, d]],
                said: None,
            }
        };
        let [rows, columns] = count;
        let all = (0..rows).flat_map(|i| (0..columns).map(move |j| polygon(i, j)));
        cells(rooms(), all.collect()).0
    };
    let graph = openings([20, 200]).unwrap();
    assert_eq!(graph.cells[0].portals.len(), 4_000);
    let refused = openings([210, 200]).unwrap_err().to_string();
    assert!(
        refused.starts_with("author's cell `cell:a` has 42000 openings, most of them into `cell:b`"),
        "{refused}"
    );
}

#[test]
fn an_occluder_that_is_too_thin_for_a_wide_scene_is_left_out() {
    let bodies = |occluder: AuthoredShape| {
        let mut builder = Builder::default();
        builder.block("panel", [10.0, 0.0, -10.0], [11.0, 4.0, 10.0]);
        for x in [-7000.0, 7000.0] {
            builder.block("far", [x, 0.0, 0.0], [x + 1.0, 1.0, 1.0]);
        }
        let world = World::new(&builder.scene).unwrap();
        let authored = Authored {
            occluders: vec![occluder],
            ..Authored::default()
        };
        let mut defects = Defects::default();
        let drawn = author::occluders(&world, &authored, &mut defects).into_iter();
        let hiders = Hiders::of(&world, drawn.map(|drawn| drawn.body).collect());
        let scenery = Scenery::with(&world, hiders.occluders());
        let stored = scenery.encode(&Frame::SOURCE, world.origin());
        assert!(Scenery::decode(&stored).is_ok());
        let left_out =
            defects.count("author's occluder that is thinner than what is known exactly in so wide a scene: not used");
        (scenery.blocker.occluders.bodies.len(), left_out)
    };
    let straight = |width_m: f64| rectangle("occluder:panel", [10.1, 10.1 + width_m], [-9.0, 9.0]);
    let askew = |width_m: f64| {
        let footprint = [[10.1, -0.4], [10.1 + width_m, -0.4], [10.7 + width_m, 0.2], [10.7, 0.2]];
        prism("occluder:panel", &footprint, [0.0, 3.0])
    };
    for [wide, thin] in [[straight(0.5), straight(0.03)], [askew(0.2), askew(0.04)]] {
        let [(with, none), (without, one)] = [wide, thin].map(bodies);
        assert_eq!((with, none, one), (without + 1, 0, 1));
    }
}

#[test]
fn a_small_cell_before_a_large_one_opens_over_its_own_face_only() {
    let graph = sound(vec![
        rectangle("cell:hall", [0.0, 10.0], [0.0, 10.0]),
        rectangle("cell:bay", [10.0, 12.0], [3.0, 5.0]),
    ]);
    assert!((area_m2(&graph.cells[0].portals[0]) - 6.0).abs() < 1e-9);
}

#[test]
fn what_is_drawn_a_little_apart_is_meant_to_touch() {
    let graph = sound(vec![
        hexagon("cell:a", [0.0, 0.0], 1.0),
        hexagon("cell:b", [0.0, 3.0f64.sqrt() + 4e-4], 1.0),
    ]);
    assert_eq!(graph.cells[0].adjacent, [1]);
    let wall_m = 0.5 * 3.0f64.sqrt();
    for z in [wall_m, wall_m + 1e-4, wall_m + 2e-4, wall_m + 4e-4] {
        assert!(graph.cell_at([0.2, 1.0, z]).is_some(), "nobody holds z = {z}");
    }
}

#[test]
fn what_is_no_convex_polyhedron_is_refused_by_name() {
    let dented = prism(
        "cell:dent",
        &[[0., 0.], [4., 0.], [4., 4.], [2., 1.], [0., 4.]],
        [0.0, 3.0],
    );
    let cause = refusal(vec![dented]);
    assert!(cause.contains("cell:dent") && cause.contains("not convex"), "{cause}");
    let mut open = hexagon("cell:open", [0.0, 0.0], 2.0);
    open.triangles.pop();
    let cause = refusal(vec![open]);
    assert!(cause.contains("cell:open") && cause.contains("not closed"), "{cause}");
    let mut lidless = rectangle("cell:tub", [0.0, 4.0], [0.0, 4.0]);
    lidless.triangles.retain(|triangle| triangle.iter().any(|p| p.y == 0.0));
    let cause = refusal(vec![lidless]);
    assert!(cause.contains("cell:tub") && cause.contains("not closed"), "{cause}");
    let flat = prism("cell:flat", &[[0., 0.], [4., 0.], [4., 4.]], [1.0, 1.0]);
    let cause = refusal(vec![flat]);
    assert!(cause.contains("cell:flat") && cause.contains("no volume"), "{cause}");
}

#[test]
fn cells_that_overlap_are_refused_by_both_names() {
    let cause = refusal(vec![
        hexagon("cell:a", [0.0, 0.0], 1.0),
        hexagon("cell:b", [0.3, 1.6], 1.0),
    ]);
    assert!(
        cause.contains("cell:a") && cause.contains("cell:b") && cause.contains("overlap"),
        "{cause}"
    );
    let inside = refusal(vec![
        rectangle("cell:out", [0., 9.], [0., 9.]),
        hexagon("cell:in", [4.0, 4.0], 1.0),
    ]);
    assert!(inside.contains("cell:in"), "{inside}");
}

/// Of very many faces only what is wrong with each cell by itself is told: the same that a bake says first.
#[test]
fn what_a_bake_refuses_is_known_before() {
    let refusal = |count: usize, last: AuthoredShape| {
        let mut cells = vec![rectangle("cell:a", [0., 9.], [0., 9.]); count];
        cells.push(last);
        let authored = Authored {
            cells,
            ..Authored::default()
        };
        author::refusal(&authored).map(|refusal| refusal.to_string())
    };
    let within = || hexagon("cell:in", [4.0, 4.0], 1.0);
    assert!(refusal(1, within()).unwrap().contains("overlap"));
    assert_eq!(refusal(2_730, within()), None);
    let mut flat = within();
    flat.triangles.truncate(1);
    assert!(refusal(2_730, flat).unwrap().contains("no volume"));
}

#[test]
fn a_cell_that_touches_no_other_is_allowed_and_counted() {
    let far = rectangle("cell:island", [20.0, 24.0], [0.0, 4.0]);
    let rooms = vec![
        rectangle("cell:a", [0., 4.], [0., 4.]),
        rectangle("cell:b", [4., 8.], [0., 4.]),
        far,
    ];
    let (graph, defects) = cells(rooms, Vec::new());
    assert_eq!(
        graph
            .unwrap()
            .cells
            .iter()
            .filter(|cell| cell.adjacent.is_empty())
            .count(),
        1
    );
    assert_eq!(
        defects.count("isolated cell: an author's cell that touches no other"),
        1
    );
}

#[test]
fn a_door_is_named_with_the_opening_that_its_box_covers() {
    let mut builder = Builder::default();
    let door = builder.block("door:a", [3.95, 0.0, 1.0], [4.05, 2.0, 2.0]);
    let other = builder.block("door:b", [3.95, 0.0, 3.0], [4.05, 2.0, 3.4]);
    for object in [door, other] {
        builder.scene.objects[object as usize].role = Role::Door;
    }
    let world = World::new(&builder.scene).unwrap();
    let mut authored = Authored {
        cells: vec![
            rectangle("cell:a", [0., 4.], [0., 4.]),
            rectangle("cell:b", [4., 8.], [0., 4.]),
        ],
        ..Authored::default()
    };
    let graph = author::build(&world, &authored, &mut Defects::default()).unwrap();
    assert_eq!(graph.cells[0].portals[0].door, None, "the wall is wider than the door");
    let idle = graph.idle_doors(&world);
    assert_eq!(
        (&idle, &graph.doors_in_openings(&world, &idle)),
        (&vec![door, other], &idle)
    );
    authored.portals.push(AuthoredShape {
        node: "portal:a".to_owned(),
        triangles: vec![
            [DVec3::new(4., 0., 1.), DVec3::new(4., 0., 2.), DVec3::new(4., 2., 2.)],
            [DVec3::new(4., 0., 1.), DVec3::new(4., 2., 2.), DVec3::new(4., 2., 1.)],
        ],
        said: None,
    });
    let graph = author::build(&world, &authored, &mut Defects::default()).unwrap();
    assert_eq!(graph.cells[0].portals[0].door, Some(door));
    assert_eq!(graph.idle_doors(&world), [other]);
    assert!(
        graph.doors_in_openings(&world, &[other]).is_empty(),
        "it is beside the portal"
    );
}

/// A `portal:` polygon of these corners in a plane across x.
fn across_x(corners: &[[f64; 2]]) -> AuthoredShape {
    let corner = |i: usize| DVec3::new(4.0, corners[i][0], corners[i][1]);
    AuthoredShape {
        node: "portal:x".to_owned(),
        triangles: (2..corners.len()).map(|i| [0, i - 1, i].map(corner)).collect(),
        said: None,
    }
}

/// The door that is named with the opening between two rooms, one on either side of x = 4 m, that a polygon says.
fn named(builder: &Builder, portal: AuthoredShape) -> Option<u32> {
    let world = World::new(&builder.scene).unwrap();
    let authored = Authored {
        cells: vec![
            rectangle("cell:a", [0., 4.], [0., 4.]),
            rectangle("cell:b", [4., 8.], [0., 4.]),
        ],
        portals: vec![portal],
        ..Authored::default()
    };
    let graph = author::build(&world, &authored, &mut Defects::default()).unwrap();
    graph.cells[0].portals[0].door
}

#[test]
fn a_door_askew_names_no_opening_beside_it() {
    let mut builder = Builder::default();
    // From one corner of the box around it to the other, and so across x = 4 m at z = 1 m only.
    let corners = [[3., 0., 0.], [5., 0., 2.], [5., 2., 2.], [3., 2., 0.]];
    let door = builder.mesh("door:askew", corners.to_vec(), vec![0, 1, 2, 0, 2, 3]);
    builder.scene.objects[door as usize].role = Role::Door;
    let between = |low: f64, high: f64| across_x(&[[0.1, low], [0.1, high], [1.9, high], [1.9, low]]);
    assert_eq!(named(&builder, between(0.1, 0.7)), None);
    assert_eq!(named(&builder, between(0.95, 1.05)), Some(door));
}

#[test]
fn a_door_with_a_slanted_head_names_no_opening_above_it() {
    let mut builder = Builder::default();
    let corners = [[4., 0., 1.], [4., 0., 2.], [4., 1., 2.], [4., 2., 1.]];
    let door = builder.mesh("door:slanted", corners.to_vec(), vec![0, 1, 2, 0, 2, 3]);
    builder.scene.objects[door as usize].role = Role::Door;
    let whole = across_x(&[[0., 1.], [0., 2.], [2., 2.], [2., 1.]]);
    assert_eq!(named(&builder, whole), None);
    let below = across_x(&[[0., 1.], [0., 2.], [1., 2.], [2., 1.]]);
    assert_eq!(named(&builder, below), Some(door));
}

/// A chest stands in the corner of the box around a cell, outside the cell.
#[test]
fn eyes_stand_in_the_hull_and_not_in_the_box_around_it() {
    let mut builder = Builder::default();
    let chest = builder.block("chest", [2.5, 0.2, 2.5], [3.9, 2.8, 3.9]);
    let thing = builder.block("thing", [3.0, 1.0, 3.0], [3.4, 1.4, 3.4]);
    let world = World::new(&builder.scene).unwrap();
    let seen_from = |shape: AuthoredShape| {
        let authored = Authored {
            cells: vec![shape],
            ..Authored::default()
        };
        let graph = author::build(&world, &authored, &mut Defects::default()).unwrap();
        let settings = VisibilitySettings {
            method: Method::Sampled,
            sampled: Some(SampledSettings {
                rays_per_cell: 40_000,
                ..SampledSettings::default()
            }),
        };
        let hiders = Hiders::of(&world, Vec::new());
        let found = visibility::compute(&Views::of(&world, &graph, &hiders), &settings, &Forgetful, &Silent).unwrap();
        let objects = found.cells[0].objects.iter().map(|seen| seen.object);
        objects.collect::<std::collections::BTreeSet<_>>()
    };
    let triangle = prism("cell:t", &[[0., 0.], [4., 0.], [0., 4.]], [0.0, 3.0]);
    assert_eq!(seen_from(triangle), [chest].into());
    assert_eq!(
        seen_from(rectangle("cell:b", [0., 4.], [0., 4.])),
        [chest, thing].into()
    );
}

#[test]
fn a_region_for_proofs_is_the_hull_and_a_little_more() {
    let graph = sound(vec![prism("cell:t", &[[0., 0.], [4., 0.], [0., 4.]], [0.0, 3.0])]);
    let world = World::new(&Builder::default().scene).unwrap();
    let region = crate::occluders::Region::of_cell(&world, &graph.cells[0]);
    assert_eq!(region.points.len(), 6);
    let aslant = glam::Vec3::new(1.0, 0.0, 1.0).normalize();
    let [_, high] = region.heights(aslant, 0.0);
    assert!((2.0 * 2.0f32.sqrt()..2.829).contains(&high), "{high}");
}

#[test]
fn portals_without_cells_are_all_named_with_the_way_out() {
    let portal = |node: &str| AuthoredShape {
        node: node.to_owned(),
        triangles: vec![],
        said: None,
    };
    let authored = Authored {
        portals: vec![portal("portal:front"), portal("portal:back")],
        ..Authored::default()
    };
    let mut defects = Defects::default();
    super::author::note_portals(&authored, &mut defects);
    let told: Vec<_> = defects.iter().map(|defect| defect.to_string()).collect();
    assert_eq!(told.len(), 1);
    for part in ["2 × ", "(portal:front, portal:back)", "`cell:`"] {
        assert!(told[0].contains(part), "{told:?}");
    }
}

/// Rooms in a lattice of which some are missing and some hexagonal, and polygons on some of the walls between them.
fn lattice() -> impl Strategy<Value = (Vec<AuthoredShape>, Vec<AuthoredShape>)> {
    let rooms = prop::collection::vec(0u8..4, 30);
    let open = prop::collection::vec((0u8..6, 0u8..6, any::<bool>(), 0.0..0.06f64), 0..12);
    (rooms, open).prop_map(|(rooms, open)| {
        let room = |(at, kind): (usize, &u8)| {
            let [x, z] = [at % 6, at / 6].map(|i| 4.0 * i as f64);
            let footprint = match kind {
                0 => return None,
                1 => vec![
                    [x, z + 1.0],
                    [x + 1.0, z],
                    [x + 4.0, z],
                    [x + 4.0, z + 4.0],
                    [x, z + 4.0],
                ],
                _ => vec![[x, z], [x + 4.0, z], [x + 4.0, z + 4.0], [x, z + 4.0]],
            };
            Some(prism("cell:room", &footprint, [0.0, 3.0]))
        };
        let polygon = |(x, z, across, off_m): (u8, u8, bool, f64)| {
            let [x, z] = [x, z].map(|i| 4.0 * f64::from(i));
            let place = |along: f64, y: f64| match across {
                true => DVec3::new(x + along, y, z + off_m),
                false => DVec3::new(x + off_m, y, z + along),
            };
            let [a, b, c, d] = [place(1.5, 0.0), place(2.5, 0.0), place(2.5, 2.0), place(1.5, 2.0)];
            AuthoredShape {
                node: "portal:p".to_owned(),
                triangles: vec![[a, b, c], [a, c, d]],
                said: None,
            }
        };
        let rooms = rooms.iter().enumerate().filter_map(room);
        (rooms.collect(), open.into_iter().map(polygon).collect())
    })
}

/// The openings of all cells, each by the middles of both and its corners.
fn openings_of(graph: &CellGraph) -> Vec<String> {
    let mut openings: Vec<_> = graph
        .cells
        .iter()
        .flat_map(|cell| {
            cell.portals.iter().map(move |portal| {
                let mut corners: Vec<_> = portal.polygon.iter().map(|corner| format!("{corner:.6?}")).collect();
                corners.sort_unstable();
                let [from, to] = [cell, &graph.cells[portal.to as usize]].map(ViewCell::center);
                format!("{from:.6?} {to:.6?} {corners:?}")
            })
        })
        .collect();
    openings.sort_unstable();
    openings
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn many_cells_have_the_openings_that_each_two_of_them_have_alone((rooms, open) in lattice()) {
        let whole = cells(rooms.clone(), open.clone()).0.unwrap();
        let mut of_pairs = Vec::new();
        for (i, a) in rooms.iter().enumerate() {
            for b in &rooms[i + 1..] {
                of_pairs.extend(openings_of(&cells(vec![a.clone(), b.clone()], open.clone()).0.unwrap()));
            }
        }
        of_pairs.sort_unstable();
        prop_assert_eq!(openings_of(&whole), of_pairs);
    }

    #[test]
    fn by_place_one_finds_the_cell_that_asking_each_finds((rooms, _) in lattice(), (x, y, z) in (-2i32..52, -1i32..8, -2i32..52)) {
        let graph = cells(rooms, Vec::new()).0.unwrap();
        let point = [x, y, z].map(|step| 0.5 * f64::from(step));
        prop_assert_eq!(graph.by_place().cell_at(point), graph.cell_at(point));
    }
}
