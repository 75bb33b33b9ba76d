import { expect, it } from "vitest";
import { readProgram } from "./link.ts";

const LENGTHS =
  "parameter size = 2 let wide = 3 let get_wide = 4 function half(x, y = 2) = x / y rule post() { box(size, wide, 1) }";

// The same sentences as in Rust: `crates/scene/src/procedural/tests/foreign.rs`.
it.each([
  [
    "l.size",
    'values of other files cannot be read, as `size` of "lib/lengths.dcg"; declare a function there, as in `function get_size() = size`, and write `l.get_size()`',
  ],
  [
    "l.wide",
    'values of other files cannot be read, as `wide` of "lib/lengths.dcg"; declare a function there, as in `function get_wide_() = wide`, and write `l.get_wide_()`',
  ],
  ["l.half", "`l.half` is a function: write `l.half(x, y)`"],
  ["l.post", "`post` is a rule, and a function is wanted here"],
  ["l.sizes", '`sizes` is not a value or function of "lib/lengths.dcg"; did you mean `size`?'],
  [
    "l.nothing",
    '`nothing` is not a value or function of "lib/lengths.dcg"; it declares `half`, `size`, `wide`, `get_wide`',
  ],
  ["n.size", '`size` is not a value or function of "none.dcg"; it declares none'],
])("tells what another file has where %s is read", (value, wanted) => {
  const text = `import "lib/lengths.dcg" as l import "none.dcg" as n\nbox(${value}, 1, 1)`;
  const load = (path: string) => (path === "none.dcg" ? "box(1, 1, 1)" : LENGTHS);
  expect(() => readProgram("test.dcg", text, load)).toThrow(
    `test.dcg, line 2, column 5: ${wanted}\n    box(${value}, 1, 1)`,
  );
});
