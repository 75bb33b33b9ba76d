//! What is known of glTF files that rules place? Their boxes, where whoever grows gives them. The same in TypeScript:
//! `viewer/core/procedural/golden.test.ts`.

use super::read;
use crate::Bounds;
use crate::procedural::{Settings, bounds, grow, grow_with};

const BENCH: Bounds = Bounds {
    min: [-1.0, 0.0, -0.5],
    max: [5.0, 1.0, 0.5],
};

fn boxes(path: &str) -> Option<Bounds> {
    (path == "bench.glb").then_some(BENCH)
}

#[test]
fn they_are_in_the_bounds_where_their_boxes_are_known() {
    let text = "part p() { move(50, 0, 0) model \"bench.glb\" model \"unknown.glb\" } box(1, 1, 1) turn(90) p()";
    let (program, settings) = (read(text).unwrap(), Settings::default());
    let parts = grow_with(&program, &settings, &boxes).unwrap().parts;
    let held = |min, max| Bounds { min, max };
    assert_eq!(parts[1].bounds, held([49.0, 0.0, -0.5], [55.0, 1.0, 0.5]));
    assert_eq!(parts[0].bounds, held([-0.5, 0.0, -55.0], [0.5, 1.0, 0.5]));
    assert_eq!(bounds(&program, &settings, &boxes).unwrap(), parts[0].bounds);
    assert_eq!(grow(&program, &settings).unwrap().parts[0].bounds.max, [0.5, 1.0, 0.5]);
}

#[test]
fn they_must_lie_in_what_a_part_declares() {
    for (text, said) in [
        (
            "part p() within [0, 0, 0] to [1, 1, 1] {\n  move(50, 0, 0) model \"bench.glb\"\n}\np()",
            "test.dcg, line 2, column 18: part `p` reaches 54 m beyond what it declares with `within`, towards +x; widen that\n    \
             move(50, 0, 0) model \"bench.glb\"\n    called from line 4, column 1 of test.dcg",
        ),
        (
            "part q() { model \"bench.glb\" }\npart p() within [-1, 0, -1] to [4, 1, 1] { box(1, 1, 1) called \"x\" q() }\np()",
            "test.dcg, line 1, column 12: part `p` reaches 1 m beyond what it declares with `within`, towards +x; widen that\n    \
             part q() { model \"bench.glb\" }\n    called from line 3, column 1 of test.dcg",
        ),
        (
            "part p() within [-1, 0, -1] to [5, 1, 1] { model \"bench.glb\" box(1, 2, 1) } p()",
            "test.dcg, line 1, column 6: part `p` reaches 1 m beyond what it declares with `within`, towards +y; widen that\n    \
             part p() within [-1, 0, -1] to [5, 1, 1] { model \"bench.glb\" box(1, 2, 1) } p()\n    \
             called from line 1, column 77 of test.dcg",
        ),
    ] {
        let error = grow_with(&read(text).unwrap(), &Settings::default(), &boxes).unwrap_err();
        assert_eq!(error.to_string(), said);
        let sound = read(&text.replace("box(1, 2, 1)", "")).unwrap();
        grow(&sound, &Settings::default()).unwrap();
    }
}
