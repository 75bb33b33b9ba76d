/**
 * What to write in place of a character that means nothing here? Many look like one that does, and some are of other languages. As
 * `crates/scene/src/procedural/signs.rs`.
 */
import { hasNoPicture, numberOf } from "./error.ts";

type Signs = readonly (readonly [signs: string, told: string])[];

/** Signs and what to write for them. */
const WRITTEN: Signs = [
  ["−‐‑‒–—―﹣➖", "-"],
  ["×⋅·∙∗✕✖⨯﹡", "*"],
  ["÷∕⁄➗", "/"],
  ["﹢➕", "+"],
  ["≤≦⩽", "<="],
  ["≥≧⩾", ">="],
  ["≠", "!="],
  ["≡", "=="],
  ["﹦", "="],
  ["‹〈﹤", "<"],
  ["›〉﹥", ">"],
  ["﹙❨", "("],
  ["﹚❩", ")"],
  ["【〔", "["],
  ["】〕", "]"],
  ["﹛❴", "{"],
  ["﹜❵", "}"],
  ["、､﹐", ","],
  ["。｡", "."],
  ["&∧⋀", "and"],
  ["|∨⋁", "or"],
  ["¬", "not"],
  ["^", "power(x, whole)"],
  ["%", "mod(a, b)"],
  ["√", "sqrt(x)"],
  ["²", "power(x, 2)"],
  ["³", "power(x, 3)"],
  ["½", "0.5"],
  ["¼", "0.25"],
  ["¾", "0.75"],
];

/** Signs for which there is nothing to write, and why. */
const UNWRITTEN: Signs = [
  [";", "nothing stands between statements, and `,` between arguments"],
  [":", "arguments and properties are named with `=`"],
  ["!", "write `not`, or `!=` between what should differ"],
  ["?", "write `if … then … else …`"],
  ["°", "angles are degrees anyway"],
  ["'“”„‟«»″‘’‚′", 'texts stand between `"`'],
];

/** Those of which the language is made, besides letters and digits. */
const OWN = '()[]{},=<>+-*/.#_"';

/** Of a character that means nothing. */
export function noWord(character: string): string {
  return `${shownSign(character)} means nothing here; ${inPlaceOf(character)}`;
}

/** A character as it is, by its number where one would not see it, and both where it may look like one that the language has. */
function shownSign(character: string): string {
  if (hasNoPicture(character)) return numberOf(character);
  return character > "\x7f" ? `\`${character}\` (${numberOf(character)})` : `\`${character}\``;
}

function inPlaceOf(character: string): string {
  // As wide as what stands in a column of Chinese or Japanese.
  const isWide = character >= "\uff01" && character <= "\uff5e";
  const narrow = isWide ? String.fromCharCode(character.charCodeAt(0) - 0xfee0) : character;
  if (isWide && (/[0-9A-Za-z]/.test(narrow) || OWN.includes(narrow))) return `write \`${narrow}\``;
  const of = (signs: Signs) => signs.find(([signs]) => signs.includes(narrow))?.[1];
  const written = of(WRITTEN);
  if (written !== undefined) return `write \`${written}\``;
  return of(UNWRITTEN) ?? otherwise(character);
}

function otherwise(character: string): string {
  if (hasNoPicture(character)) return "write a space in its place, or nothing";
  if (/^\p{Alphabetic}$/u.test(character)) return "names are made of the letters a to z, digits and `_`";
  if (/^\p{N}$/u.test(character)) return "numbers are made of the digits 0 to 9";
  if (character <= "\x7f") return "comments begin with `//`, colours with `#`";
  return 'such signs stand in texts between `"` and in comments behind `//`, and nowhere else';
}
