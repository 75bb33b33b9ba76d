//! What is told of a value that is read of an imported file?

use crate::procedural::{Loader, Program};

struct Lengths;

impl Loader for Lengths {
    fn load(&self, path: &str) -> Result<String, String> {
        Ok(match path {
            "none.dcg" => "box(1, 1, 1)",
            _ => "parameter size = 2 let wide = 3 let get_wide = 4 function half(x, y = 2) = x / y rule post() { box(size, wide, 1) }",
        }
        .to_owned())
    }
}

/// What the file has is proposed, and no name that it has for something else.
#[test]
fn a_value_of_another_file_is_told_with_what_that_has() {
    for (value, wanted) in [
        (
            "l.size",
            "values of other files cannot be read, as `size` of \"lib/lengths.dcg\"; declare a function there, as in \
             `function get_size() = size`, and write `l.get_size()`",
        ),
        (
            "l.wide",
            "values of other files cannot be read, as `wide` of \"lib/lengths.dcg\"; declare a function there, as in \
             `function get_wide_() = wide`, and write `l.get_wide_()`",
        ),
        ("l.half", "`l.half` is a function: write `l.half(x, y)`"),
        ("l.post", "`post` is a rule, and a function is wanted here"),
        (
            "l.sizes",
            "`sizes` is not a value or function of \"lib/lengths.dcg\"; did you mean `size`?",
        ),
        (
            "l.nothing",
            "`nothing` is not a value or function of \"lib/lengths.dcg\"; it declares `half`, `size`, `wide`, `get_wide`",
        ),
        (
            "n.size",
            "`size` is not a value or function of \"none.dcg\"; it declares none",
        ),
    ] {
        let text = format!("import \"lib/lengths.dcg\" as l import \"none.dcg\" as n\nbox({value}, 1, 1)");
        let refused = Program::read("test.dcg", text, &Lengths).unwrap_err().to_string();
        let wanted = format!("test.dcg, line 2, column 5: {wanted}\n    box({value}, 1, 1)");
        assert_eq!(refused, wanted);
    }
}
