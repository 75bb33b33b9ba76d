//! Where does it end? What is too much is refused, and what is declared holds what it should.

use super::{complaint, grown};

#[test]
fn bombs_end_at_their_limits() {
    for (text, what) in [
        ("rule a(n) { a(n + 1) a(n + 2) } a(0)", "levels"),
        ("part a(n) { if n > 0 { a(n - 1) a(n - 1) } } a(40)", "placements"),
        ("for i in 1e6 for j in 1e6 {}", "steps"),
        ("for i in 1e6 for j in 1e6 sphere(1, sides = 256)", "triangles"),
        ("rule a(n, l) { a(n + 1, [l, l]) } a(0, [1])", "numbers in a list"),
        ("part a(n) {} for i in 1e6 a(i)", "parts"),
        ("material m(n) {} for i in 1e6 paint m(i) {}", "materials"),
        ("heights x, z in 1 by 1 steps 4096 by 4096 = 0", "triangles"),
        (
            "rule a() { { { { { { { { { { { a() } } } } } } } } } } } a()",
            "nesting",
        ),
        (
            "function f(x) = -(-(-(-(-(-(-(-(-(-(-f(x)))))))))))\nlet a = f(1)",
            "nesting",
        ),
        (
            "part a(n) { move(0, 1, 0) turn(1) scale(1) paint m(n) { if n { for i in 1 a(n - 1) } } } material m(n) {} a(99)",
            "nesting",
        ),
    ] {
        let found = complaint(text);
        assert!(found.contains(what), "{text}: {found}");
    }
    let deep = format!("let a = {}1{}", "(".repeat(5000), ")".repeat(5000));
    assert!(complaint(&deep).contains("inside each other"));
}

#[test]
fn a_box_that_is_declared_may_touch_what_it_holds() {
    for text in [
        "part p() within [-1, 0, -1] to [1, 1, 1] { turn(45) cylinder(1, 1, sides = 4) } p()",
        "part p() within [-2, -2, -1] to [2, 2, 1] { heights x, z in 4 by 2 steps 1 by 1 = x } p()",
    ] {
        assert_eq!(grown(text).parts[1].meshes.len(), 1, "{text}");
    }
    let slope = grown("heights x, z in 4 by 2 steps 1 by 1 = x").parts[0].bounds;
    assert_eq!((slope.min, slope.max), ([-2.0, -2.0, -1.0], [2.0, 2.0, 1.0]));
}

#[test]
fn what_is_kept_is_limited() {
    let name = "x".repeat(900_000);
    for text in [
        format!("for i in 100 called \"{name}\" box(1, 1, 1)"),
        format!("for i in 100 viewpoint \"{name}\""),
    ] {
        let error = complaint(&text);
        assert!(error.contains("numbers kept"), "{error}");
    }
    let list = "function f(l, n) = if n < 1 then l else f([l, l], n - 1)\nlet big = f([0], 14)";
    let lines = (0..200).map(|i| format!("\nlet a{i} = [big]")).collect::<String>();
    assert!(complaint(&format!("{list}{lines}")).contains("numbers kept"));
    assert!(complaint(&format!("rule {name}() {{}}")).contains("more than 255 letters in a name"));
}
