//! Behaviour of the language: what grows out of a text.

mod bounded;
mod foreign;
mod placed;
mod told;

use super::{DcgError, Grown, Limits, Loader, NoImports, Program, Settings, Value, bounds, grow};

fn read(text: &str) -> Result<Program, Box<DcgError>> {
    Program::read("test.dcg", text.to_owned(), &NoImports)
}

fn grown(text: &str) -> Grown {
    grow(&read(text).unwrap(), &Settings::default()).unwrap()
}

/// What is said of a text, without the line that is shown.
fn complaint(text: &str) -> String {
    complaint_of(text, 4_000_000)
}

/// The same where it may take so many steps.
fn complaint_of(text: &str, steps: u64) -> String {
    let limits = Limits {
        steps,
        triangles: 1_000_000,
        ..Limits::default()
    };
    let settings = Settings {
        limits,
        ..Settings::default()
    };
    let error = read(text).and_then(|program| grow(&program, &settings)).unwrap_err();
    error.to_string().lines().next().unwrap_or_default().to_owned()
}

/// Corners of the model's own triangles, one triple of points for each.
fn corners(grown: &Grown) -> Vec<[[f32; 3]; 3]> {
    let meshes = grown.parts[0].meshes.iter();
    let of = |mesh: &super::Mesh| {
        let triples = mesh.indices.as_chunks::<3>().0.to_vec();
        triples
            .into_iter()
            .map(|t| t.map(|i| mesh.positions[i as usize]))
            .collect::<Vec<_>>()
    };
    meshes.flat_map(of).collect()
}

/// Six times the volume that triangles enclose when they look outwards.
fn volume(grown: &Grown) -> f64 {
    let v = |p: [f32; 3]| p.map(f64::from);
    let signed = |[a, b, c]: [[f32; 3]; 3]| super::affine::dot(v(a), super::affine::cross(v(b), v(c)));
    corners(grown).into_iter().map(signed).sum::<f64>() / 6.0
}

const WORM: &str = "
parameter count = 4 from 0 to 30
rule worm(c) {
  if c > 0 { sphere(0.5) move(1, 0, 0) worm(c - 1) }
  else cone(0.5, 1)
}
worm(count)
";

#[test]
fn a_worm_has_as_many_spheres_as_it_counts() {
    let model = grown(WORM);
    let bounds = model.parts[0].bounds;
    assert_eq!((bounds.min[0], bounds.max[0]), (-0.5, 4.5));
    let parameters = [("count".to_owned(), Value::Number(9.0))].into();
    let longer = grow(
        &read(WORM).unwrap(),
        &Settings {
            parameters,
            ..Settings::default()
        },
    )
    .unwrap();
    assert_eq!(longer.parts[0].bounds.max[0], 9.5);
    assert!(longer.usage.levels > model.usage.levels);
}

#[test]
fn solids_are_closed_and_look_outwards() {
    for (text, wanted, tolerance) in [
        ("box(2, 3, 4)", 24.0, 1e-6),
        ("cylinder(1, 2, sides = 256)", std::f64::consts::TAU, 0.01),
        ("cone(1, 3, sides = 256)", std::f64::consts::PI, 0.01),
        ("cone(1, 3, top = 1, sides = 4)", 6.0, 1e-5),
        ("sphere(1, sides = 256)", 4.1888, 0.01),
        ("lathe([[0, 0], [1, 0], [1, 2], [0, 2]], sides = 4)", 4.0, 1e-5),
        ("prism([[0, 0], [0, 2], [2, 2], [2, 0]], 3)", 12.0, 1e-5),
        ("prism([[0, 0], [2, 0], [2, 2], [0, 2]], 3)", 12.0, 1e-5),
        ("prism([[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]], 1)", 7.0, 1e-5),
        ("scale(-1, 1, 2) box(1, 1, 1)", 2.0, 1e-6),
        (
            "mesh([[0,0,0],[1,0,0],[0,1,0],[0,0,1]], [[0,2,1],[0,1,3],[1,2,3],[2,0,3]])",
            1.0 / 6.0,
            1e-6,
        ),
        ("turn(30) tilt(40) roll(50) move(1, 2, 3) box(1, 2, 3)", 6.0, 1e-5),
    ] {
        let found = volume(&grown(text));
        assert!((found - wanted).abs() < tolerance, "{text}: {found}");
    }
}

#[test]
fn a_polygon_is_flat_and_a_face_of_a_mesh_may_be_folded() {
    for off in [0.0, 0.03, 0.05, 0.5] {
        let points = format!("[[0, 0, 0], [1, 0, 0], [1, 1, {off}], [0, 1, 0]]");
        let polygon = read(&format!("polygon({points})")).unwrap();
        let is_flat = grow(&polygon, &Settings::default()).is_ok();
        // Which of the four lies off makes no difference: each is off by a quarter of it.
        assert_eq!(is_flat, off < 0.04, "{off}");
        assert_eq!(corners(&grown(&format!("mesh({points}, [[0, 1, 2, 3]])"))).len(), 2);
    }
    // Far from the origin and small, in a slanting plane; and many at once.
    grown("for i in 20 polygon([[9e5, 9e5, 0], [9e5 + 1, 9e5, 1], [9e5 + 1, 9e5 + i + 1, 1], [9e5, 9e5 + i + 1, 0]])");
}

#[test]
fn normals_agree_with_the_way_round() {
    for text in [
        "turn(20) scale(1, -2, 3) { sphere(1) cone(1, 2, 0.5) box(1, 1, 1) }",
        "lathe([[1, 0], [2, 1], [1, 3]], smooth = 1) prism([[0, 0], [3, 0], [1, 1], [0, 3]], 1)",
        "heights x, z in 10 by 10 steps 20 by 10 = fractal(x / 3, z / 3, 4)",
    ] {
        let model = grown(text);
        for mesh in &model.parts[0].meshes {
            for t in mesh.indices.as_chunks::<3>().0 {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize].map(f64::from));
                let edge = |p: [f64; 3]| std::array::from_fn(|i| p[i] - a[i]);
                let face = super::affine::cross(edge(b), edge(c));
                let normal = t.map(|i| mesh.normals[i as usize].map(f64::from));
                assert!(normal.iter().all(|n| super::affine::dot(*n, face) >= 0.0), "{text}");
            }
        }
    }
}

#[test]
fn what_has_no_radius_writes_nothing_and_a_wire_in_a_profile_only_its_ends() {
    let nothing = "sphere(0, 256) cone(0, 1) cylinder(0, 2) for s in 2 lathe([[0, 0], [0, 1], [0, 2]], smooth = s)";
    let model = grown(nothing);
    assert!(model.parts[0].meshes.is_empty());
    assert_eq!(model.parts[0].bounds.max[1], 2.0);
    for smooth in [0, 1] {
        let profile = "[[0, 0], [0, 1], [0, 2], [1, 3], [0, 4], [0, 5], [0, 6], [1, 7]]";
        let model = grown(&format!("lathe({profile}, 8, {smooth})"));
        let mesh = &model.parts[0].meshes[0];
        assert_eq!(mesh.indices.len(), 3 * 3 * 8);
        assert_eq!(mesh.positions.len(), if smooth == 1 { 5 * 8 } else { 3 * 2 * 8 });
    }
}

#[test]
fn equal_parts_are_shared_and_unequal_ones_are_not() {
    let model = grown("part post(h) { cylinder(0.1, h) } for i in 100 move(i, 0, 0) post(1 + mod(i, 2))");
    assert_eq!(model.parts.len(), 3);
    assert_eq!(model.usage.placements, 100);
    assert_eq!(model.instances().len(), 101);
}

#[test]
fn random_numbers_depend_on_the_place_and_the_seed_only() {
    let text = "rule die() { box(random(1, 2), 1, 1) } for i in 5 move(3 * i, 0, 0) die()";
    let with_more = text.replace("for i in 5", "for i in 5 {} for i in 5");
    let program = |text: &str| read(text).unwrap();
    let positions = |text: &str, seed| {
        let grown = grow(
            &program(text),
            &Settings {
                seed,
                ..Settings::default()
            },
        )
        .unwrap();
        grown.parts[0].meshes[0].positions.clone()
    };
    assert_eq!(positions(text, 1), positions(text, 1));
    assert_ne!(positions(text, 1), positions(text, 2));
    assert_ne!(positions(text, 1), positions(&with_more, 1));
    let widths: std::collections::BTreeSet<u32> = positions(text, 1)
        .chunks(24)
        .map(|die| (die[0][0] - die[12][0]).abs().to_bits())
        .collect();
    assert!(widths.len() > 3);
}

#[test]
fn what_stays_the_same_in_a_file_is_another_number_with_other_parameters() {
    struct Leaf;
    impl Loader for Leaf {
        fn load(&self, _: &str) -> Result<String, String> {
            Ok(
                "parameter a = 1 parameter b = 2 * a let c = b + 1 part in(n) { box(b, 2 * c, n) } in(2 * b)"
                    .to_owned(),
            )
        }
    }
    // The second is known when its parameters are, and leaves its place to the third.
    let text = "import \"leaf.dcg\" as leaf leaf(a = 5) leaf(a = 5) leaf(a = 7) leaf.in(1)";
    let program = Program::read("test.dcg", text.to_owned(), &Leaf).unwrap();
    for _ in 0..2 {
        let grown = grow(&program, &Settings::default()).unwrap();
        let boxes = grown.parts.iter().filter(|part| !part.meshes.is_empty());
        let sizes: Vec<_> = boxes
            .map(|part| [0, 1, 2].map(|i| part.bounds.max[i] - part.bounds.min[i]))
            .collect();
        assert_eq!(sizes, [[10.0, 22.0, 20.0], [14.0, 30.0, 28.0], [2.0, 6.0, 1.0]]);
    }
}

#[test]
fn levels_end_a_recursion_and_leave_something_in_its_place() {
    let model = grown(
        "rule stem() levels 3 + level * 0 { box(1, 1, 1) move(0, 1, 0) stem() } then sphere(0.5, sides = 4)
         stem()",
    );
    assert_eq!(model.parts[0].bounds.max[1], 3.5);
}

#[test]
fn bounds_hold_what_grows_and_are_found_without_triangles() {
    let text = "
part tree(h) within [-h, 0, -h] to [h, 2 * h, h] { cylinder(0.1, h) move(0, h, 0) sphere(random(0.5, 0.9)) }
for i in 10 move(3 * i, 0, 0) turn(random(0, 360)) tree(random(2, 4))";
    let program = read(text).unwrap();
    let settings = Settings::default();
    let (declared, exact) = (
        bounds(&program, &settings, &|_| None).unwrap(),
        grow(&program, &settings).unwrap().parts[0].bounds,
    );
    assert_eq!(declared, declared.union(&exact));
    assert_eq!(
        complaint("part p() within [-1, 0, -1] to [1, 1, 1] { box(1, 2, 1) } p()"),
        "test.dcg, line 1, column 6: part `p` reaches 1 m beyond what it declares with `within`, towards +y; widen that"
    );
}

#[test]
fn a_text_that_says_what_it_was_given_grows_the_same_alone() {
    let text = "parameter height = 2 // metres
        from 1 to 9
        parameter lean = 0.5 + random(0, 1) // (of a metre)
        parameter outline = [[0, 0], [1, 0],
          [0, 1]] parameter far = 3
        function bent(x) = x + lean
        prism(outline, height) move(far, bent(random(0, 5)), 0) box(random(1, 2), 1, 1)";
    let program = read(text).unwrap();
    let list = serde_json::json!([[0, 0], [3, 0], [0, -2.5]]);
    let given = [
        ("height", Value::from_json(&4.25.into()).unwrap()),
        ("lean", Value::from_json(&(-1e-3).into()).unwrap()),
        ("outline", Value::from_json(&list).unwrap()),
    ];
    for some in 0..8 {
        let chosen = given.iter().enumerate().filter(|(i, _)| some >> i & 1 == 1);
        let parameters: std::collections::BTreeMap<String, Value> = chosen
            .map(|(_, (name, value))| ((*name).to_owned(), value.clone()))
            .collect();
        let alone = program.text_given("test.dcg", &parameters).unwrap();
        assert_eq!(alone.lines().count(), text.lines().count());
        assert_eq!(alone == text, parameters.is_empty());
        let settings = Settings {
            seed: 3,
            parameters,
            ..Settings::default()
        };
        let alone = grow(
            &read(&alone).unwrap(),
            &Settings {
                seed: 3,
                ..Settings::default()
            },
        )
        .unwrap();
        assert_eq!(corners(&alone), corners(&grow(&program, &settings).unwrap()));
    }
    let unknown = std::collections::BTreeMap::from([("hight".to_owned(), given[0].1.clone())]);
    assert_eq!(program.text_given("test.dcg", &unknown).as_deref(), Some(text));
    assert_eq!(program.text_given("other.dcg", &unknown), None);
    let much = std::collections::BTreeMap::from([("height".to_owned(), Value::from_json(&10.into()).unwrap())]);
    let error = grow(
        &read(&program.text_given("test.dcg", &much).unwrap()).unwrap(),
        &Settings::default(),
    )
    .unwrap_err();
    assert!(error.to_string().contains("it must be from 1 to 9"), "{error}");
}
