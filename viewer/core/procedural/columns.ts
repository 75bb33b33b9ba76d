/**
 * How many columns of a terminal does a letter take? As `crates/scene/src/procedural/columns.rs`: East Asian wide ones two (Unicode,
 * *UAX #11*), marks upon others and what is not seen none (M. Kuhn, *wcwidth*, 2007), all others one. By blocks, so that both languages
 * know the same whatever Unicode theirs is of.
 */

/** Letters that take none, by their numbers. */
const NONE: readonly (readonly [first: number, last: number])[] = [
  [0x300, 0x36f],
  [0x483, 0x489],
  [0x591, 0x5bd],
  [0x610, 0x61a],
  [0x64b, 0x65f],
  [0x941, 0x948],
  [0x94d, 0x94d],
  [0xe31, 0xe31],
  [0xe34, 0xe3a],
  [0xe47, 0xe4e],
  [0x1160, 0x11ff],
  [0x1ab0, 0x1aff],
  [0x1dc0, 0x1dff],
  [0x200b, 0x200f],
  [0x202a, 0x202e],
  [0x2060, 0x206f],
  [0x20d0, 0x20ff],
  [0x302a, 0x302d],
  [0x3099, 0x309a],
  [0xfe00, 0xfe0f],
  [0xfe20, 0xfe2f],
  [0xfeff, 0xfeff],
  [0xe0000, 0xe0fff],
];

/** Those that take two. */
const TWO: readonly (readonly [first: number, last: number])[] = [
  [0x1100, 0x115f],
  [0x2e80, 0x303e],
  [0x3041, 0x4dbf],
  [0x4e00, 0xa4cf],
  [0xa960, 0xa97f],
  [0xac00, 0xd7a3],
  [0xf900, 0xfaff],
  [0xfe30, 0xfe6f],
  [0xff01, 0xff60],
  [0xffe0, 0xffe6],
  [0x1b000, 0x1b2ff],
  [0x1f300, 0x1f64f],
  [0x1f680, 0x1f6ff],
  [0x1f900, 0x1f9ff],
  [0x20000, 0x3fffd],
];

function columnsOf(letter: string): number {
  const code = letter.codePointAt(0) ?? 0;
  const isIn = (ranges: typeof NONE) => ranges.some(([first, last]) => first <= code && code <= last);
  return isIn(NONE) ? 0 : isIn(TWO) ? 2 : 1;
}

/** Blanks as wide as so many letters of a text, so that what stands behind them is below the next one. */
export function columnsBefore(text: string, letters: number): string {
  const before = [...text].slice(0, letters);
  return before.map((letter) => (letter === "\t" ? letter : " ".repeat(columnsOf(letter)))).join("");
}
