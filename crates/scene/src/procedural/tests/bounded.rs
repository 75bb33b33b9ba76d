//! Where does it end? What is too much is refused, and what is declared holds what it should.

use super::{complaint, complaint_of, corners, grown, read};
use crate::procedural::{Limits, Loader, Program, Settings, grow};

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

/// The same in TypeScript: `viewer/core/procedural/golden.test.ts`.
#[test]
fn long_rows_and_chains_are_no_nesting_and_as_many_brackets_may_be_as_is_said() {
    let most = |text: &str, axis: usize| grown(text).parts[0].bounds.max[axis];
    let row = "move(1, 0, 0) ".repeat(256);
    assert_eq!(most(&format!("{row}box(1, 1, 1)"), 0), 256.5);
    let chain = |one: &dyn Fn(u32) -> String| (0..256).map(one).collect::<Vec<_>>().join(" else ");
    let statements = chain(&|i| format!("if a == {i} box(1, {i} + 1, 1)"));
    assert_eq!(most(&format!("rule r(a) {{ {statements} }} r(255)"), 1), 256.0);
    let values = chain(&|i| format!("if a == {i} then {i} + 1"));
    assert_eq!(
        most(&format!("function f(a) = {values} else 0 box(1, f(255), 1)"), 1),
        256.0
    );
    let braces = |count: usize| format!("{}box(1, 1, 1){}", "{".repeat(count), "}".repeat(count));
    assert_eq!(grown(&braces(95)).usage.triangles, 12);
    assert!(complaint(&braces(96)).contains("more than 96 brackets"));
    let in_calls = format!(
        "rule r(n) {{ {} {{ if n > 0 r(n - 1) }} }} r(99)",
        "move(1, 0, 0) ".repeat(250)
    );
    assert!(complaint(&in_calls).contains("more than 640 levels of nesting"));
    let dangling = "rule r(a, b) { if a if b box(1, 1, 1) else box(1, 2, 1) else box(1, 3, 1) } r(1, 0)";
    assert_eq!(most(dangling, 1), 2.0);
    assert_eq!(most(&dangling.replace("r(1, 0)", "r(0, 0)"), 1), 3.0);
}

/// What is around one another is counted through brackets, so that dropping, copying and compiling it stays bounded too.
#[test]
fn rows_in_brackets_are_one_row() {
    let deep = format!("{}box(1, 1, 1){}", "move(0, 1, 0) { ".repeat(90), "}".repeat(90));
    assert_eq!(grown(&deep).parts[0].bounds.max[1], 91.0);
    let rows = format!("{} {{ ", "turn(1) ".repeat(20)).repeat(20);
    let wanted = "more than 256 transforms, loops and conditions around one another";
    assert!(complaint(&format!("{rows} box(1, 1, 1) {}", "}".repeat(20))).contains(wanted));
    assert!(complaint(&"if 1 ".repeat(200_000)).contains(wanted));
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
    let name = "🏠".repeat(255);
    for text in [
        format!("for i in 65000 called \"{name}\" {{}}"),
        format!("for i in 100000 viewpoint \"{name}\""),
    ] {
        let error = complaint(&text);
        assert!(error.contains("numbers kept"), "{error}");
    }
    let list = "function f(l, n) = if n < 1 then l else f([l, l], n - 1)\nlet big = f([0], 14)";
    let lines = (0..200).map(|i| format!("\nlet a{i} = [big]")).collect::<String>();
    assert!(complaint(&format!("{list}{lines}")).contains("numbers kept"));
    let name = "x".repeat(256);
    assert!(complaint(&format!("rule {name}() {{}}")).contains("more than 255 letters in a name"));
}

/// What lists take at once: in calls that are open, beside what is being computed, and in what a file is given. Shared lists
/// and those that were needed before do not count against a text.
#[test]
fn what_lists_hold_at_once_is_limited() {
    const LIST: &str = "function long(n) = if n < 1 then [0] else [long(n - 1), long(n - 1)]
        function new(x) = mix(big, big, x) function first(l) = l[0] let big = long(14)";
    let wanted = "more than 2097152 numbers in lists at once; name long lists outside of rules, with `let`";
    for text in [
        // In parameters and values of calls.
        "function f(n, l) = if n < 1 then 0 else f(n - 1, new(n)) box(f(60, 0), 1, 1)".to_owned(),
        "rule r(n) { let l = new(n) if n > 0 r(n - 1) } r(60)".to_owned(),
        format!(
            "rule r(n) {{ {} }} r(1)",
            (0..60).map(|i| format!("let l{i} = new(n) ")).collect::<String>()
        ),
        // Beside what is being computed.
        "function f(n) = if n < 1 then 1 else count([new(n)]) + first([new(n), f(n - 1)][1]) box(f(60), 1, 1)"
            .to_owned(),
        "function f(n) = if n < 1 then 0 else new(n)[f(n - 1)] box(count(f(60)), 1, 1)".to_owned(),
        "function f(n) = if n < 1 then big else mix(new(n), f(n - 1), 0.5) box(count(f(60)), 1, 1)".to_owned(),
        "rule r(n) { for l in [new(n), 1] if n > 0 r(n - 1) } r(60)".to_owned(),
        format!(
            "{} box(1, 1, 1)",
            (0..60)
                .map(|i| format!("parameter p{i} = new(0.5) "))
                .collect::<String>()
        ),
    ] {
        // Defaults of parameters can use no `let`.
        let list = if text.contains("parameter") {
            LIST.replace("let big = long(14)", "function big() = long(14)")
                .replace("big, big", "big(), big()")
        } else {
            LIST.to_owned()
        };
        let error = complaint_of(&format!("{list} {text}"), 200_000_000);
        assert!(error.contains(wanted), "{text}: {error}");
    }
    for text in [
        "for i in 100 { let a = new(i / 100) box(1, 1, 1) }".to_owned(),
        "function f(n, l) = if n < 1 then count(l) else f(n - 1, l) for i in 9 { let l = new(i) box(f(20, l), 1, 1) }"
            .to_owned(),
        "rule r(i) { let a = new(i) box(count(a), 1, 1) } for i in 100 r(i / 100)".to_owned(),
        "for i in 100 box(count([new(i), 1]), count(new(i)[0]), 1)".to_owned(),
    ] {
        grown(&format!("{LIST} {text}"));
    }
    // A list that becomes too long ends before the rest of it is computed.
    let items = "new(0.5), ".repeat(3);
    let error = complaint_of(&format!("{LIST} let a = [{items} 1 / 0]"), 200_000_000);
    assert!(error.contains("more than 65536 numbers in a list"), "{error}");
}

#[test]
fn what_is_kept_is_told_and_no_more_than_that_is_needed() {
    let text = "material m(n) {} part p(l) { paint m(l[0]) box(1, 1, 1) } let a = [1, 2, 3]
        for i in 5 p([i, 1]) called \"sixteen letters.\" box(1, 1, 1) viewpoint \"eight le\"";
    let program = read(text).unwrap();
    let with = |kept| {
        let limits = Limits {
            kept,
            ..Limits::default()
        };
        let settings = Settings {
            limits,
            ..Settings::default()
        };
        grow(&program, &settings)
    };
    let usage = with(1_000).unwrap().usage;
    // The file and its value, 5 parts with a list of 2 each, 5 materials, 16 and 8 letters.
    assert_eq!(usage.kept, 2 + 4 + 5 * 3 + 5 * 4 + 2 + 1);
    assert_eq!(usage.files, 1);
    assert_eq!(with(usage.kept).unwrap().usage, usage);
    let said = with(usage.kept - 1).unwrap_err().to_string();
    assert!(
        said.contains(&format!("more than {} numbers kept", usage.kept - 1)),
        "{said}"
    );
}

/// However many parameters there are, and however many calls that give few of them.
#[test]
fn what_calls_do_not_give_takes_no_room() {
    let formals: String = (0..1000).map(|i| format!("a{i} = {i}, ")).collect();
    let calls: String = (0..1000).map(|i| format!("r(a{i} = 2, a0 = 1) ")).collect::<String>();
    let text = format!(
        "rule r({formals}) {{}} {}",
        calls.replace("r(a0 = 2, a0 = 1)", "r() r(5, a999 = 1)")
    );
    let program = read(&text).unwrap();
    let given = program.modules[0].calls.iter().map(|call| call.given.as_slice());
    let given: Vec<_> = given.collect();
    assert_eq!(given.len(), 1001);
    assert_eq!(
        (given[0], given[1], given[2]),
        (&[][..], &[(0, 0), (999, 1)][..], &[(0, 1), (1, 0)][..])
    );
    assert_eq!(given.iter().map(|given| given.len()).sum::<usize>(), 2000);
}

#[test]
fn the_nearest_value_of_a_name_counts_and_is_gone_behind_its_braces() {
    let widths = |text: &str| {
        let model = grown(text);
        let corners = corners(&model).into_iter().flatten();
        corners.map(|[x, ..]| x).fold(0.0, f32::max)
    };
    let text =
        "rule r(a) { { let a = 2 * a { let a = 2 * a box(a, 1, 1) } box(a, 1, 1) for a in 3 { let b = a } } WIDE }
        let a = 9 r(3)";
    assert_eq!(widths(&text.replace("WIDE", "")), 6.0);
    assert_eq!(widths(&text.replace("WIDE", "box(5 * a, 1, 1)")), 7.5);
    assert!(complaint(&text.replace("WIDE", "box(b, 1, 1)")).contains("`b` is not a value here"));
}

/// Long comments in every file that is imported.
struct Long;

impl Loader for Long {
    fn load(&self, path: &str) -> Result<String, String> {
        let next = path
            .trim_end_matches(".dcg")
            .parse::<u32>()
            .map_err(|_| path.to_owned())?
            + 1;
        Ok(format!("// {}\nimport \"{next}.dcg\" as next", "x".repeat(1 << 19)))
    }
}

#[test]
fn texts_of_all_files_together_are_bounded() {
    let error = Program::read("first.dcg", "import \"1.dcg\" as one".to_owned(), &Long).unwrap_err();
    assert_eq!(error.file, "7.dcg");
    let wanted = "line 2, column 8: more than 4194304 bytes of text in all files; leave out what is not used";
    assert!(error.to_string().contains(wanted), "{error}");
}

/// What is written in single precision lies in the bounds, also where the part that it is in is placed.
#[test]
fn bounds_hold_corners_as_they_are_written() {
    let solid = "move(0.1, 100000.3, 0) box(1, 1, 1)";
    for text in [solid.to_owned(), format!("part p() {{ {solid} }} scale(0.3) p()")] {
        let model = grown(&text);
        let bounds = model.parts[0].bounds;
        for instance in model.instances() {
            let corners = model.parts[instance.part]
                .meshes
                .iter()
                .flat_map(|mesh| &mesh.positions);
            for corner in corners {
                let corner = instance.world_from_part.point(corner.map(f64::from));
                assert!(bounds.contains(corner), "{text}: {corner:?}, {bounds:?}");
            }
        }
    }
}
