//! What is said when a text is wrong, and where?

use super::{complaint, read};
use crate::procedural::{DcgError, Loader, Program, Settings, Value, grow, nearest};

#[test]
fn what_is_wrong_is_said_with_its_place_and_a_way_out() {
    for (text, wanted) in [
        (
            "rule branch() {}\n  brnach()",
            "line 2, column 3: `brnach` is not a rule here; did you mean `branch`?",
        ),
        (
            "box(1, 1, dpth = 1)",
            "line 1, column 11: `dpth` is not a parameter of `box`; did you mean `depth`?",
        ),
        (
            "box(1, 1, 1, sdes = 4)",
            "line 1, column 14: `sdes` is not a parameter of `box`; it takes `width`, `height`, `depth`",
        ),
        (
            "foo(1)",
            "line 1, column 1: `foo` is not a rule here; declare it, as in `rule foo() { … }`",
        ),
        (
            "paint plaster box(1, 1, 1)",
            "line 1, column 7: `plaster` is not a material here; declare it, as in `material plaster { colour = #888 }`",
        ),
        (
            "box(yy, 1, 1)",
            "line 1, column 5: `yy` is not a value here; declare it, as in `let yy = …`",
        ),
        (
            "box(1, 1)",
            "line 1, column 1: `box` needs `depth`; write `box(width, height, depth)`",
        ),
        (
            "let a = 1\nbox(a, a / (a - 1), a)",
            "line 2, column 10: division by zero; test the divisor with `if` before",
        ),
        (
            "let a = 1e308 * 10",
            "line 1, column 15: this result is not a finite number here; keep its operands within range",
        ),
        (
            "rule a() { b() } rule b() { a() } a()",
            "line 1, column 29: more than 64 levels; stop the recursion earlier, with `if` or `levels`",
        ),
        (
            "part a() { a() } a()",
            "line 1, column 12: part `a` contains itself with the same parameters; count them down and stop with `if`",
        ),
        (
            "box(1, 1, 1) rule box() {}",
            "line 1, column 19: `box` is a word of the language; choose another name",
        ),
        (
            "import \"x.dcg\" as x",
            "line 1, column 8: \"x.dcg\" cannot be imported: there are no other files here",
        ),
        (
            "paint brick box(1, 1, 1) material brik { }",
            "line 1, column 7: `brick` is not a material here; did you mean `brik`?",
        ),
        (
            "prism([[0, 0], [1, 1], [1, 0], [0, 1]], 1)",
            "line 1, column 7: this polygon crosses itself or has no area; list its corners in order around it",
        ),
        (
            "for i in 1e9 box(1, 1, 1)",
            "line 1, column 10: a count is 1000000000; it must be from 0 to 1048576",
        ),
        ("box(1, 1, 1", "line 1, column 4: this `(` has no `)`"),
        (
            "box(1, 1, 1) §",
            "line 1, column 14: `§` (U+00A7) means nothing here; such signs stand in texts between `\"` and in comments behind `//`, and \
             nowhere else",
        ),
        (
            "let a = [1, 2]\nbox(a[2], 1, 1)",
            "line 2, column 6: there is no item 2: the list has 2, counted from 0",
        ),
        (
            "rule r(a, b) {} r(1, c = 2)",
            "line 1, column 22: `c` is not a parameter of `r`; did you mean `a`?",
        ),
    ] {
        let found = complaint(text);
        assert_eq!(found.strip_prefix("test.dcg, "), Some(wanted), "{text}");
    }
}

/// In files and rules that others call, the calls are told too: the innermost three, and a recursion once.
#[test]
fn the_calls_that_led_to_a_mistake_are_told() {
    struct Halves;
    impl Loader for Halves {
        fn load(&self, path: &str) -> Result<String, String> {
            Ok(match path {
                "half.dcg" => "parameter by = 1\nlet part_of = 1 / by\nfunction f(x) = x / by\nbox(part_of, 1, 1)",
                _ => "import \"half.dcg\" as half\nrule r(n) { if n > 0 r(n - 1)\n  if n <= 0 half(by = n) }",
            }
            .to_owned())
        }
    }
    let text = "import \"sub/../middle.dcg\" as m\nm.r(9)";
    let program = Program::read("test.dcg", text.to_owned(), &Halves).unwrap();
    let error = grow(&program, &Settings::default()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "half.dcg, line 2, column 17: division by zero; test the divisor with `if` before\n    let part_of = 1 / by\n    \
         called from line 3, column 13 of middle.dcg\n    called from line 2, column 22 of middle.dcg\n    \
         called from line 2, column 1 of test.dcg"
    );
    assert_eq!(
        error.below("sub").to_string().lines().last(),
        Some("    called from line 2, column 1 of sub/test.dcg")
    );
}

/// No place of the text is wrong, so none is told.
#[test]
fn a_parameter_that_there_is_not_is_no_mistake_of_the_text() {
    for (text, wanted) in [
        (
            "parameter height = 2 box(1, height, 1)",
            "`heigth` is not a parameter of `test.dcg`; did you mean `height`?",
        ),
        (
            "parameter size = 2 parameter floors = 1",
            "`heigth` is not a parameter of `test.dcg`; it takes `size`, `floors`",
        ),
        (
            "parameter size = 2 from 1 to 3 // metres\nparameter lean = 0 from -1 // to the left\n to size",
            "`heigth` is not a parameter of `test.dcg`; it takes `size from 1 to 3`, `lean from -1 to size`",
        ),
        (
            "box(1, 1, 1)",
            "`heigth` is not a parameter of `test.dcg`; it takes none",
        ),
    ] {
        let settings = Settings {
            parameters: [("heigth".to_owned(), Value::Number(3.0))].into(),
            ..Settings::default()
        };
        let refused = grow(&read(text).unwrap(), &settings).unwrap_err();
        assert_eq!((refused.to_string().as_str(), refused.line), (wanted, 0));
    }
}

#[test]
fn what_a_terminal_would_obey_is_not_repeated() {
    let told = read("rule main {\n  box(1, 1, 1) \u{1b}]0;title\u{7} \0\n}\n")
        .unwrap_err()
        .to_string();
    assert!(told.contains("line 2"), "{told}");
    assert!(!told.contains(['\u{1b}', '\u{7}', '\0']), "{told:?}");
}

#[test]
fn a_mark_of_the_byte_order_moves_no_place() {
    for (text, place) in [
        ("box(1, 1, -a)\nlet a = 1", "line 1, column 11: "),
        ("// ö\r\n  box(1, 1)", "line 2, column 3: "),
    ] {
        let marked = complaint(&format!("\u{feff}{text}"));
        assert_eq!(marked, complaint(text));
        assert!(marked.contains(place), "{marked}");
    }
}

#[test]
fn what_is_no_text_is_told_with_its_place() {
    for (bytes, wanted) in [
        (
            &b"box(1, 1, 1)\n  // caf\xe9\n"[..],
            "line 2, column 9: the byte 0xe9 is no part of a text; save the file as UTF-8\n    // caf",
        ),
        (
            b"\xff\xfeb\0o\0x\0",
            "line 1, column 1: the byte 0xff is no part of a text; save the file as UTF-8",
        ),
        (
            "\u{feff}ö".as_bytes().split_last().unwrap().1,
            "line 1, column 1: the byte 0xc3 is no part of a text; save the file as UTF-8",
        ),
    ] {
        let told = DcgError::text_of("test.dcg", bytes.to_vec()).unwrap_err().to_string();
        assert_eq!(told, format!("test.dcg, {wanted}"));
    }
    assert_eq!(DcgError::text_of("test.dcg", b"box".to_vec()).unwrap(), "box");
}

#[test]
fn what_is_out_of_range_is_no_mistake_of_the_text() {
    let program = read("parameter height = 2 from 1 to 9 box(1, height, 1)").unwrap();
    let list = Value::from_json(&serde_json::json!([1, 2])).unwrap();
    for (value, wanted) in [
        (Value::Number(12.0), "`height` is 12; it must be from 1 to 9"),
        (list, "`height` has a range and must be a number, and this is a list"),
    ] {
        let settings = Settings {
            parameters: [("height".to_owned(), value)].into(),
            ..Settings::default()
        };
        let refused = program.refuse_given(&settings).unwrap_err();
        assert_eq!((refused.to_string().as_str(), refused.line), (wanted, 0));
        assert_eq!(grow(&program, &settings).unwrap_err(), refused);
    }
    program.refuse_given(&Settings::default()).unwrap();
}

/// A list where a number was meant, or the other way round, is wrong where the text uses it; which parameter it is, is said too.
#[test]
fn a_parameter_that_was_given_what_its_default_is_not_is_named_with_the_mistake() {
    let text = "parameter footprint = [[0, 0], [4, 0], [0, 3]] parameter height = 2 + 1\nprism(footprint, height)";
    let list = Value::from_json(&serde_json::json!([1, 2])).unwrap();
    for (name, value, wanted) in [
        (
            "footprint",
            Value::Number(4.0),
            "`footprint` was given a number, and its default is a list",
        ),
        (
            "height",
            list.clone(),
            "`height` was given a list, and its default is a number",
        ),
    ] {
        let settings = Settings {
            parameters: [(name.to_owned(), value)].into(),
            ..Settings::default()
        };
        let refused = grow(&read(text).unwrap(), &settings).unwrap_err().to_string();
        assert!(refused.starts_with("test.dcg, line 2, column "), "{refused}");
        assert_eq!(refused.lines().last(), Some(format!("    {wanted}").as_str()));
    }
    // It may be innocent.
    let both = "parameter posts = 3 for i in posts box(1, 1, 1)\n";
    let settings = Settings {
        parameters: [("posts".to_owned(), list)].into(),
        ..Settings::default()
    };
    assert_eq!(grow(&read(both).unwrap(), &settings).unwrap().usage.triangles, 24);
    for (wrong, said) in [
        ("box(1, 1 / 0, 1)", "division by zero"),
        ("rule r() { r() } r()", "more than 64 levels"),
        ("box(-1, 1, 1)", "it must be from 0"),
        ("let a = [1] box(a[1], 1, 1)", "there is no item 1"),
        ("scale(0) box(1, 1, 1)", "a scale must be"),
        ("box(power(2, 0.5), 1, 1)", "a power must be"),
        ("box(sqrt(-1), 1, 1)", "what a root is taken of must be"),
        ("lathe([[-1, 0], [1, 1]])", "a radius of a profile must be"),
        ("prism([[0, 0], [1, 1]], 1)", "this outline must be"),
        ("polygon([[0, 0, 0], [1, 0, 0], [0, 2e6, 0]])", "a point must be"),
        ("polygon([[0, 0, 0], [1, 0, 0]])", "a face must be"),
        (
            "material m { colour = [0, 0, 2] } paint m box(1, 1, 1)",
            "a colour must be",
        ),
        (
            "part p() within [1, 1, 1] to [0, 0, 0] { box(1, 1, 1) } p()",
            "`within` must be",
        ),
        ("impostor(size = 3)", "size must be"),
    ] {
        let refused = grow(&read(&format!("{both}{wrong}")).unwrap(), &settings).unwrap_err();
        assert_eq!(refused.given, None, "{wrong}");
        assert!(refused.to_string().contains(said), "{refused}");
    }
}

/// The same where one file gives it to another: the outermost that was given such is named.
#[test]
fn what_a_file_gives_another_in_place_of_a_list_is_named_too() {
    struct Wood;
    impl Loader for Wood {
        fn load(&self, path: &str) -> Result<String, String> {
            Ok(match path {
                "tree.dcg" => "parameter height = 2 from 0 to 9 parameter at = [0, 1] parameter size = 1 box(at[0] + size, height, 1)",
                _ => "import \"tree.dcg\" as tree parameter size = 3 tree(size = size)",
            }
            .to_owned())
        }
    }
    let told = |text: &str| {
        let program = Program::read(
            "test.dcg",
            format!("import \"tree.dcg\" as tree import \"wood.dcg\" as wood\n{text}"),
            &Wood,
        );
        grow(&program.unwrap(), &Settings::default()).unwrap_err().to_string()
    };
    let last = |text: &str| told(text).lines().last().unwrap().trim().to_owned();
    assert_eq!(
        told("tree(at = 3)"),
        "tree.dcg, line 1, column 81: what has items must be a list, and this is a number\n    \
         parameter height = 2 from 0 to 9 parameter at = [0, 1] parameter size = 1 box(at[0] + size, height, 1)\n    \
         called from line 2, column 1 of test.dcg\n    \
         `at` of \"tree.dcg\" was given a number, and its default is a list"
    );
    assert_eq!(
        last("tree(size = [1])"),
        "`size` of \"tree.dcg\" was given a list, and its default is a number"
    );
    assert_eq!(
        last("wood(size = [1])"),
        "`size` of \"wood.dcg\" was given a list, and its default is a number"
    );
    // What names the parameter itself needs nobody to.
    assert_eq!(
        told("tree(height = [1])"),
        "test.dcg, line 2, column 6: `height` has a range and must be a number, and this is a list\n    tree(height = [1])"
    );
}

/// A letter that looks like one that names have is none, and a name is never taken for itself.
#[test]
fn what_looks_like_a_known_name_is_told_by_its_odd_letter() {
    let told = |name: &str| {
        let settings = Settings {
            parameters: [(name.to_owned(), Value::Number(3.0))].into(),
            ..Settings::default()
        };
        let program = read("parameter height = 2 box(1, height, 1)").unwrap();
        grow(&program, &settings).unwrap_err().to_string()
    };
    for (name, number) in [("h\u{435}ight", "U+0435"), ("height\u{200b}", "U+200B")] {
        assert_eq!(
            told(name),
            format!("`{name}`, with {number}, is not a parameter of `test.dcg`; did you mean `height`?")
        );
    }
    assert_eq!(nearest("height", ["height"]), None);
    assert_eq!(nearest("height", ["height", "Height"]).as_deref(), Some("Height"));
}

/// What Unicode 17 lets anybody leave out when it is shown (`Default_Ignorable_Code_Point`): in no name, but for joiners and variation
/// selectors.
#[test]
fn nothing_is_in_a_name_that_leaves_no_trace() {
    let ignorable = [
        0xad..=0xad,
        0x34f..=0x34f,
        0x61c..=0x61c,
        0x115f..=0x1160,
        0x17b4..=0x17b5,
        0x180b..=0x180f,
        0x200b..=0x200f,
        0x202a..=0x202e,
        0x2060..=0x206f,
        0x3164..=0x3164,
        0xfe00..=0xfe0f,
        0xfeff..=0xfeff,
        0xffa0..=0xffa0,
        0xfff0..=0xfff8,
        0x1bca0..=0x1bca3,
        0x1d173..=0x1d17a,
        0xe0000..=0xe0fff,
    ];
    for c in ignorable.into_iter().flatten().filter_map(char::from_u32) {
        let stays = matches!(c, '\u{200c}' | '\u{200d}' | '\u{180b}'..='\u{180d}' | '\u{180f}' | '\u{fe00}'..='\u{fe0f}' | '\u{e0100}'..='\u{e01ef}');
        assert_eq!(read(&format!("called \"a{c}\" box(1, 1, 1)")).is_ok(), stays, "{c:?}");
        assert!(read(&format!("called \"{c}\" box(1, 1, 1)")).is_err(), "{c:?}");
    }
}

/// A name that is given from outside may be as long as who gives it likes.
#[test]
fn no_more_is_repeated_of_what_was_given_than_of_a_line() {
    let settings = Settings {
        parameters: [("x".repeat(100_000), Value::Number(3.0))].into(),
        ..Settings::default()
    };
    let program = read(&format!("parameter size = [{}] box(1, 1, 1)", "1, ".repeat(1000))).unwrap();
    let refused = grow(&program, &settings).unwrap_err().to_string();
    assert_eq!(
        refused,
        format!(
            "`{}…` is not a parameter of `test.dcg`; it takes `size`",
            "x".repeat(120)
        )
    );
    let told: Vec<String> = program.parameters_told().collect();
    assert_eq!(told.len(), 1);
    assert!(told[0].ends_with('…') && told[0].chars().count() < 150, "{}", told[0]);
}

#[test]
fn parameters_are_told_with_ranges_and_defaults() {
    let text = "parameter size = 2 from 1 to 3 // metres\nparameter lean = size *\n 2\nbox(size, 1, 1)";
    let told: Vec<String> = read(text).unwrap().parameters_told().collect();
    assert_eq!(told, ["size from 1 to 3, else 2", "lean, else size * 2"]);
}
