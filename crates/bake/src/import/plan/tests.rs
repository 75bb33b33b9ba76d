use super::*;
use crate::source::Primitive;
use glam::{Vec2, Vec3};
use layout::Tile;
use std::collections::BTreeSet;

const MUSEUM: &str = include_str!("../../../../../tests/fixtures/museum.plan");

fn refusal(text: &str) -> String {
    parse(text).expect_err("accepted").to_string()
}

fn museum() -> (Plan, SourceScene) {
    let plan = parse(MUSEUM).expect("the museum is sound");
    let scene = plan.to_scene();
    (plan, scene)
}

fn furniture_of<'a>(scene: &'a SourceScene, room: &str) -> Vec<&'a SourceObject> {
    let parts = ["floor", "ceiling", "north wall", "east wall", "south wall", "west wall"];
    let of_room = scene.objects.iter().filter(|o| {
        o.source_node
            .strip_prefix(room)
            .and_then(|rest| rest.strip_prefix('/'))
            .is_some_and(|part| {
                !parts.contains(&part) && !["doorway", "window", "glass door"].iter().any(|p| part.starts_with(p))
            })
    });
    of_room.collect()
}

#[test]
fn a_bare_drawing_becomes_rooms_with_named_markers() {
    let plan = parse("#######\n#a.+.b#\n#..#..#\n#######").expect("sound");
    let names: Vec<_> = plan.room_names().map(str::to_owned).collect();
    assert_eq!(names, ["Room A", "Room B"]);
    let scene = plan.to_scene();
    let named = |name: &str| scene.objects.iter().find(|o| o.source_node == name).expect(name);
    assert_eq!(
        named("a").world_from_object.w_axis.truncate().to_array(),
        [1.5, 0.0, 1.5]
    );
    assert_eq!(
        named("b").world_from_object.w_axis.truncate().to_array(),
        [5.5, 0.0, 1.5]
    );
    assert_eq!(named("a").model, named("b").model);
    assert!(scene.objects.iter().any(|o| o.source_node == "Room A/doorway 1"));
}

#[test]
fn a_drawing_may_follow_the_indentation_of_code_and_end_lines_with_crlf() {
    let indented = parse("####\n           #a.#\n           ####")
        .expect("sound")
        .to_scene();
    let plain = parse("\u{feff}####\r\n#a.#\r\n####\r\n\r\n").expect("sound").to_scene();
    assert_eq!(format!("{indented:?}"), format!("{plain:?}"));
}

#[test]
fn errors_name_line_column_and_the_way_out() {
    let headed = |plan: &str| format!("title: T\nlegend:\n  b = bench\nplan:\n{plan}");
    assert_eq!(
        refusal(&headed("#####\n#b.q#\n#####")),
        "line 6, column 4: `q` is not in the legend; add a line `q = …` or use one of # . + % = @ 0–9 b"
    );
    assert!(refusal("####\n#é.#\n####").starts_with("line 2, column 2: `é` is not in the legend"));
    assert!(refusal("####\n#.\t#\n####").starts_with("line 2, column 3: a tab"));
    assert!(refusal("####\n#..\n####").starts_with("line 2, column 3: this floor has no wall"));
    assert!(refusal("####\n#.  \n####\n").contains("no wall towards the open ground"));
    assert!(refusal("").contains("there is no drawing"));
    assert!(refusal("\n \n\n").contains("there is no drawing"));
    assert!(refusal("###\n###\n###").contains("there is no drawing"));
    assert!(refusal("title: x\n").contains("there is no drawing"));
    assert!(
        refusal("#####\n#.+.#\n#...#\n#####").starts_with("line 2, column 3: this opening is not in a straight wall")
    );
    assert!(refusal("#####\n#1.2#\n#####").starts_with("line 2, column 4: this room already has number 1"));
    assert!(refusal("#####\n#1#1#\n#####").starts_with("line 2, column 4: room 1 is already the room on line 2"));
    assert!(
        refusal("legend:\nb = bench\nb = sofa\nplan:\n###\n#b#\n###")
            .starts_with("line 3, column 1: `b` was already given on line 2")
    );
    assert!(refusal("legend:\n# = bench\nplan:\n").starts_with("line 2, column 1: `#` always means wall"));
    assert!(
        refusal("legend:\nb = bensh\nplan:\n").starts_with("line 2, column 5: cannot read `bensh`; expected a kind")
    );
    assert!(
        refusal("legend:\nv = vase height 900\nplan:\n").starts_with("line 2, column 17: a height must be between")
    );
    assert!(refusal("legend:\nv = vase height nan\nplan:\n").contains("must be between"));
    assert!(refusal("legend:\nv = vase colour #2g5\nplan:\n").starts_with("line 2, column 17: cannot read `#2g5`"));
    assert!(
        refusal("rooms:\n1 = Hall, walls\nplan:\n").starts_with("line 2, column 16: cannot read `the end of the line`")
    );
    assert!(
        refusal("rooms:\n1 = Hall\nplan:\n###\n#.#\n###").starts_with("line 2, column 1: room 1 is not in the drawing")
    );
    assert!(
        refusal("title: x\nnonsense\nplan:\n###\n#.#\n###").starts_with("line 2, column 1: cannot read `nonsense`")
    );
    let wide = "#".repeat(MAX_SIDE_TILES + 1);
    assert!(refusal(&wide).contains("1025 tiles wide; the limit is 1024"));
    assert!(refusal(&"#\n".repeat(MAX_SIDE_TILES + 1)).contains("1025 tiles deep"));
    let hall = format!(
        "legend:\np = painting\nplan:\n{0}\n{1}{1}{1}#.....p.....#\n{1}{1}{1}{0}",
        "#############", "#...........#\n"
    );
    assert!(refusal(&hall).contains("a painting hangs on a wall"));
}

proptest::proptest! {
    #[test]
    fn no_text_makes_the_reader_panic(text in "[#.+%= ab@1\\t\\r\\n:é-]{0,160}", header in 0..3usize) {
        let prefix = ["", "plan:\n", "title: x\nrooms:\n1 = A, height 3\nlegend:\na = painting\nplan:\n"][header];
        if let Ok(plan) = parse(&format!("{prefix}{text}")) {
            assert!(!plan.to_scene().objects.is_empty());
        }
    }
}

#[test]
fn every_room_of_the_museum_is_named_furnished_and_reachable() {
    let (plan, scene) = museum();
    assert!((36..=48).contains(&plan.rooms.len()), "{} rooms", plan.rooms.len());
    for name in plan.room_names() {
        let count = furniture_of(&scene, name).len();
        assert!(count >= 3, "{name} has {count} pieces");
    }
    let mut reached = BTreeSet::new();
    let layout = &plan.layout;
    let start = layout
        .tiles
        .iter()
        .position(|t| *t == Tile::Room(0))
        .expect("there is a room");
    let mut pending = vec![((start % layout.columns) as isize, (start / layout.columns) as isize)];
    let mut rooms = BTreeSet::new();
    while let Some((c, r)) = pending.pop() {
        match layout.tile(c, r) {
            Tile::Room(room) => rooms.insert(room),
            Tile::Opening(o) if layout.openings[o].kind == layout::OpeningKind::Doorway => true,
            _ => continue,
        };
        if reached.insert((c, r)) {
            pending.extend(legend::Facing::ALL.map(|f| (c + f.step().0, r + f.step().1)));
        }
    }
    assert_eq!(rooms.len(), plan.rooms.len());
}

#[test]
fn the_museum_is_of_the_promised_size() {
    let (_, scene) = museum();
    let drawn: usize = scene
        .objects
        .iter()
        .map(|o| scene.models[o.model].triangle_count())
        .sum();
    let stored: usize = scene.models.iter().map(SourceModel::triangle_count).sum();
    let (objects, models) = (scene.objects.len(), scene.models.len());
    println!("{objects} objects, {models} models, {stored} triangles stored, {drawn} drawn");
    assert!((500..=1_200).contains(&objects), "{objects} objects");
    assert!((150_000..=1_000_000).contains(&drawn), "{drawn} triangles");
    assert!(!scene.viewpoints.is_empty());
    let names: BTreeSet<_> = scene.objects.iter().map(|o| &o.source_node).collect();
    assert_eq!(names.len(), objects, "names are unique");
}

#[test]
fn geometry_is_sound() {
    let (_, scene) = museum();
    for model in &scene.models {
        assert!(
            model.triangle_count() <= 12_000,
            "{}: {}",
            model.name,
            model.triangle_count()
        );
        for part in &model.primitives {
            assert!(part.material.is_some_and(|m| m < scene.materials.len()));
            assert_eq!(part.positions.len(), part.normals.len());
            assert!(part.colors.is_empty() || part.colors.len() == part.positions.len());
            assert!(
                part.indices.iter().all(|&i| (i as usize) < part.positions.len()),
                "{}",
                model.name
            );
            assert!(part.positions.iter().flatten().all(|c| c.is_finite()), "{}", model.name);
            assert!(
                part.normals
                    .iter()
                    .all(|n| (Vec3::from(*n).length() - 1.0).abs() < 1e-3),
                "{}",
                model.name
            );
            let against = disagreeing(part);
            assert!(
                against * 50 <= part.count(),
                "{}: {against} of {} faces look inwards",
                model.name,
                part.count()
            );
        }
    }
    for object in &scene.objects {
        assert!(object.model < scene.models.len() && object.world_from_object.is_finite());
    }
}

/// Triangles whose winding contradicts their normals.
fn disagreeing(part: &Primitive) -> usize {
    let normal = |i: u32| Vec3::from(part.normals[i as usize]);
    let corner = |i: u32| Vec3::from(part.positions[i as usize]);
    let wrong = part.indices.chunks_exact(3).filter(|t| {
        let spread = (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0]));
        spread.dot(normal(t[0]) + normal(t[1]) + normal(t[2])) < 0.0
    });
    wrong.count()
}

#[test]
fn turned_things_look_outwards() {
    let scene = parse("legend:\nv = vase\nu = urn\ns = statue\nk = knot\nplan:\n########\n#v.u.sk#\n########")
        .expect("sound")
        .to_scene();
    for name in ["vase", "urn", "statue", "knot"] {
        let model = scene.models.iter().find(|m| m.name == name).expect(name);
        let volume: f32 = model
            .primitives
            .iter()
            .flat_map(Primitive::triangles)
            .map(|t| {
                let [a, b, c] = t.map(Vec3::from);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!(volume > 0.001, "{name} encloses {volume} m³");
    }
}

#[test]
fn no_two_faces_of_the_building_lie_in_each_other() {
    let scene = parse("###########\n#a..+....##\n#...#....b#\n#...#######\n#.........#\n##=#####=##")
        .expect("sound")
        .to_scene();
    let mut faces: Vec<(usize, bool, i64, [Vec2; 3])> = Vec::new();
    for object in scene.objects.iter().filter(|o| o.source_node.contains('/')) {
        for triangle in scene.models[object.model]
            .primitives
            .iter()
            .flat_map(Primitive::triangles)
        {
            let [a, b, c] = triangle.map(Vec3::from);
            let normal = (b - a).cross(c - a).normalize_or_zero().to_array();
            let Some(axis) = (0..3).find(|&i| normal[i].abs() > 0.9999) else {
                continue;
            };
            let flat = |p: Vec3| Vec2::new(p[(axis + 1) % 3], p[(axis + 2) % 3]);
            faces.push((
                axis,
                normal[axis] > 0.0,
                (a[axis] * 1e4).round() as i64,
                [flat(a), flat(b), flat(c)],
            ));
        }
    }
    faces.sort_by_key(|f| (f.0, f.1, f.2));
    for (i, f) in faces.iter().enumerate() {
        for g in faces[i + 1..].iter().take_while(|g| (g.0, g.1, g.2) == (f.0, f.1, f.2)) {
            assert!(
                !overlap(&f.3, &g.3),
                "overlap in plane {} = {}: {:?} {:?}",
                ["x", "y", "z"][f.0],
                f.2 as f32 / 1e4,
                f.3,
                g.3
            );
        }
    }
}

/// Separating axes of two triangles.
fn overlap(first: &[Vec2; 3], second: &[Vec2; 3]) -> bool {
    let axes = [first, second]
        .into_iter()
        .flat_map(|t| (0..3).map(move |i| (t[(i + 1) % 3] - t[i]).perp().normalize_or_zero()));
    axes.into_iter().all(|axis| {
        let reach = |t: &[Vec2; 3]| {
            t.iter()
                .map(|p| p.dot(axis))
                .fold((f32::MAX, f32::MIN), |(a, b), v| (a.min(v), b.max(v)))
        };
        let ((a, b), (c, d)) = (reach(first), reach(second));
        b.min(d) - a.max(c) > 2e-3
    })
}

#[test]
fn the_same_text_gives_the_same_scene() {
    assert_eq!(format!("{:?}", museum().1), format!("{:?}", museum().1));
}
