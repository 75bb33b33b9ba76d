/** What is wrong with a procedural model, where, and what would put it right? The same sentences as in Rust. */
import { columnsBefore } from "./columns.ts";
import { nearest } from "./spelling.ts";

/** Longest part of a line, or of a word, that an error repeats, characters. */
const MOST_SHOWN = 120;

/** Most callers that an error names. */
const MOST_CALLERS = 3;

/** A place in a file. Line and column count from 1. */
export interface Caller {
  readonly file: string;
  readonly line: number;
  readonly column: number;
}

/**
 * Which of the problems it is, of those that who tells of them must know: something else was expected, no statement begins so, a name
 * is known for something else or for nothing, a list stands in place of a number or a number in place of a list.
 */
export type Kind = "expected" | "no statement" | "other kind" | "unknown" | "of value" | "list in range";

/** Something wrong at a place of a text that is not told yet: the parser knows one file only. */
export class Fault extends Error {
  constructor(
    /** Index in the text. */
    readonly at: number,
    readonly problem: string,
    readonly kind?: Kind,
  ) {
    super(problem);
  }
}

/**
 * Why a model was refused. Line and column count from 1, columns in characters; both are 0 where no place of the text is wrong
 * but what it was given.
 */
export class DcgError extends Error {
  override readonly name = "DcgError";
  /** The calls that led there, the innermost first, and not all of many. */
  readonly callers: Caller[] = [];
  private told: string;
  private given: string | undefined;

  private constructor(
    readonly file: string,
    readonly line: number,
    readonly column: number,
    /** The line, without the spaces around it; of a long one what is around the place. */
    readonly text: string,
    /** How many characters of it stand before the place, where it is not the whole line. */
    readonly mark: number | undefined,
    readonly problem: string,
    readonly kind: Kind | undefined,
  ) {
    const place = line === 0 ? "" : `${file}, line ${line}, column ${column}: `;
    const shown = text ? `\n    ${printable(text)}` : "";
    super(printable(place + problem) + shown + (mark === undefined ? "" : `\n    ${columnsBefore(text, mark)}^`));
    this.told = this.message;
  }

  /** An error in what a file was given, which says itself which file that is. */
  static ofWhole(file: string, problem: string): DcgError {
    return new DcgError(file, 0, 0, "", undefined, problem, undefined);
  }

  static at(file: string, whole: string, place: number, problem: string, kind?: Kind): DcgError {
    const { line, column, text } = placeOf(whole, place);
    const { shown, mark } = excerpt(text, column);
    return new DcgError(file, line, column, shown, mark, problem, kind);
  }

  /** Notes a call in which it happened, unless that is the place which was named last, as where a recursion has no end. */
  addCaller(file: string, whole: string, at: number): void {
    if (this.callers.length === MOST_CALLERS) return;
    const { line, column } = placeOf(whole, at);
    const last = this.callers.at(-1) ?? this;
    if (last.file === file && last.line === line && last.column === column) return;
    this.callers.push({ file, line, column });
    this.told += `\n    called from line ${line}, column ${column} of ${printable(file)}`;
    this.tell();
  }

  /** Notes what a file was given that may be why, in a sentence: what the outermost was given is nearest to who is to mend it. */
  addGiven(given: string): void {
    this.given = given;
    this.tell();
  }

  private tell(): void {
    this.message = this.told + (this.given === undefined ? "" : `\n    ${this.given}`);
  }
}

/**
 * What is shown of a line: all of a short one; of a long one what is around the character at `column`, and how much of that stands
 * before it.
 */
function excerpt(line: string, column: number): { shown: string; mark?: number } {
  const blank = /^[ \t]*/.exec(line)?.[0].length ?? 0;
  const letters = [...line.replace(/^[ \t]+|[ \t]+$/g, "")];
  if (letters.length <= MOST_SHOWN) return { shown: letters.join("") };
  const place = Math.min(Math.max(column - 1 - blank, 0), letters.length);
  const start = Math.min(Math.max(place - MOST_SHOWN / 2, 0), letters.length - MOST_SHOWN);
  const end = start + MOST_SHOWN;
  const before = start > 0 ? "…" : "";
  const after = end < letters.length ? "…" : "";
  return { shown: before + letters.slice(start, end).join("") + after, mark: before.length + place - start };
}

/** Where something lies for who reads the text. Line and column count from 1, columns in characters; `text` is the whole line. */
export function placeOf(whole: string, place: number): { line: number; column: number; text: string } {
  // A mark of the byte order may stand before a text and is no part of it.
  const source = whole.replace(/^\ufeff/, "");
  const at = Math.max(0, place - (whole.length - source.length));
  const before = source.slice(0, at);
  const start = Math.max(before.lastIndexOf("\n"), before.lastIndexOf("\r")) + 1;
  const text = /^[^\r\n]*/.exec(source.slice(start))?.[0] ?? "";
  return { line: lineOf(source, at), column: [...before.slice(start)].length + 1, text };
}

/** What is none but an order to who shows a text: a control character, a break of the line, or a mark that turns the way of writing. */
const ORDER = /[\p{Cc}\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]/u;
const ORDERS = new RegExp(ORDER, "gu");

/** What a terminal would take for an order, to write from right to left too, becomes a replacement character. */
function printable(text: string): string {
  return text.replace(ORDERS, (order) => (order === "\n" || order === "\t" ? order : "\ufffd"));
}

/** The first character of a text that is none but an order to who shows it. */
export function orderIn(text: string): string | undefined {
  return ORDER.exec(text)?.[0];
}

/**
 * What leaves no trace in a name, which then looks like another: fillers, tags, marks of where a word may be broken, and the like.
 * No blanks, and neither joiners nor variation selectors, which scripts and emoji need.
 */
const HIDDEN =
  /\u034f|\u17b4|\u17b5|\u180e|[\u00ad\u115f\u1160\u200b\u2060-\u206f\u3164\ufeff\uffa0\ufff0-\ufffb\u{1bca0}-\u{1bca3}\u{1d173}-\u{1d17a}\u{e0000}-\u{e00ff}\u{e01f0}-\u{e0fff}]/u;

/** The first character of a name that is not for who reads it. */
export function unreadableIn(name: string): string | undefined {
  return [...name].find((character) => ORDER.test(character) || HIDDEN.test(character));
}

/** Of a parameter whose default is a list, or is none; of the file that is named, where an other one gave it. */
export function givenInstead(name: string, isList: boolean, file?: string): string {
  const [given, initial] = isList ? ["number", "list"] : ["list", "number"];
  const of = file === undefined ? "" : ` of "${cut(file)}"`;
  return `\`${name}\`${of} was given a ${given}, and its default is a ${initial}`;
}

/** Of a name in which nothing is seen, behind a word. */
export function emptyName(word: string): string {
  return `this name is empty; say what it is, as people call it, as in \`${word} "The old well"\``;
}

/** Of an order to who shows the text, in a name or path. */
export function unseen(character: string): string {
  return `${numberOf(character)} is not seen, and has no place in a name or path; leave it out`;
}

/** How people name a character that is not seen. */
export function numberOf(character: string): string {
  return `U+${character.codePointAt(0)?.toString(16).toUpperCase().padStart(4, "0")}`;
}

/** The line in which a place lies, counted from 1. Lines end as on any machine, old ones too. */
export function lineOf(text: string, at: number): number {
  return text.slice(0, at).split(/\r\n|\r|\n/).length;
}

/** A word of a text, which may be as long as the text: no more of it than of a line. */
export function cut(word: string): string {
  const letters = [...word];
  return letters.length > MOST_SHOWN ? `${letters.slice(0, MOST_SHOWN).join("")}…` : word;
}

export function unknown(kind: string, name: string, known: readonly string[]): string {
  const article = /^[aeiou]/.test(kind) ? "an" : "a";
  const wayOut = ABSENT.get(`${kind} ${name}`) ?? perhaps(nearest(name, known)) ?? instead(kind, name);
  return `\`${name}\` is not ${article} ${kind} here; ${wayOut}`;
}

const ELSE_IF = "write `else if`, as in `if a > 1 box(1, 1, 1) else if a > 0 sphere(1)`";

function perhaps(suggestion: string | undefined): string | undefined {
  return suggestion === undefined ? undefined : `did you mean \`${suggestion}\`?`;
}

/** What other languages have and this one has not, and what to write instead. */
const ABSENT = new Map([
  ["value true", "truth is a number: write `1`"],
  ["value false", "truth is a number: write `0`"],
  ["statement elif", ELSE_IF],
  ["statement elsif", ELSE_IF],
  ["statement elseif", ELSE_IF],
  ["rule elif", ELSE_IF],
  ["rule elsif", ELSE_IF],
  ["rule elseif", ELSE_IF],
  ["value pi", "angles are degrees, and half a turn is 180"],
  ["value PI", "angles are degrees, and half a turn is 180"],
  ["function tan", "write `sin(x) / cos(x)`"],
  ["function atan", "write `atan2(y, x)`, which gives degrees"],
  ["function asin", "write `atan2(x, sqrt(1 - x * x))`"],
  ["function acos", "write `atan2(sqrt(1 - x * x), x)`"],
]);

/** Colours by their names elsewhere. */
const COLOURS = new Map([
  ["red", "#f00"],
  ["green", "#080"],
  ["blue", "#00f"],
  ["yellow", "#ff0"],
  ["white", "#fff"],
  ["black", "#000"],
  ["grey", "#888"],
  ["gray", "#888"],
  ["brown", "#853"],
]);

/** How a name is given. */
function instead(kind: string, name: string): string {
  const colour = COLOURS.get(name);
  if (kind === "value" && colour !== undefined) return `colours have no names, write \`${colour}\``;
  return `declare it, as in \`${declared(kind, name)}\``;
}

function declared(kind: string, name: string): string {
  switch (kind) {
    case "rule":
      return `rule ${name}() { … }`;
    case "function":
      return `function ${name}(x) = …`;
    case "material":
      return `material ${name} { colour = ${COLOURS.get(name) ?? "#888"} }`;
    case "imported file":
      return `import "${name}.dcg" as ${name}`;
    default:
      return `let ${name} = …`;
  }
}

/** Most names that a message lists. */
const MOST_LISTED = 12;

/** A name that was meant, or all that there are, as they are shown. */
function meant(name: string, takes: string, known: readonly string[], shown = known): string {
  const suggestion = perhaps(nearest(name, known));
  if (suggestion !== undefined) return suggestion;
  if (known.length === 0) return `it ${takes} none`;
  const names = shown.slice(0, MOST_LISTED).map((name) => `\`${name}\``);
  return `it ${takes} ${names.join(", ")}${known.length > MOST_LISTED ? ", …" : ""}`;
}

/** Of a name that the file does not declare of which it is asked. */
export function unknownOfFile(kind: string, name: string, file: string, known: readonly string[]): string {
  return `\`${name}\` is not a ${kind} of "${file}"; ${meant(name, "declares", known)}`;
}

/** @param shown How those that are known are shown, if not by their names alone. */
export function unknownArgument(name: string, callee: string, known: readonly string[], shown = known): string {
  return `\`${cut(name)}\`${oddIn(name)} is not a parameter of \`${callee}\`; ${meant(name, "takes", known, shown)}`;
}

/** The first letter of a name that names here do not have, by its number: it may look like one that they have. */
function oddIn(name: string): string {
  const odd = [...name].find((letter) => letter > "\x7f");
  return odd === undefined ? "" : `, with ${numberOf(odd)},`;
}

export function listInRange(name: string): string {
  return `\`${name}\` has a range and must be a number, and this is a list`;
}

export function unknownProperty(name: string, known: readonly string[]): string {
  return `\`${name}\` is not a property of a material; ${meant(name, "takes", known)}`;
}

/** Of a value of another file. */
export function valueOfFile(file: string, name: string, getter: string, call: string): string {
  const wayOut = `declare a function there, as in \`function ${getter}() = ${name}\`, and write \`${call}\``;
  return `values of other files cannot be read, as \`${name}\` of "${file}"; ${wayOut}`;
}

export function notComputed(name: string, wayOut: string): string {
  return `\`${name}\` is not computed yet; ${wayOut}`;
}

/** Of two signs in the order of other languages. */
export function comparison(written: string, meant: string): string {
  return `\`${written}\` means nothing here; write \`${meant}\``;
}

export function beyondDeclared(part: string, towards: string, byM: number): string {
  return `part \`${part}\` reaches ${shown(byM)} m beyond what it declares with \`within\`, towards ${towards}; widen that`;
}

export function expected(what: string, found: string): string {
  return `expected ${what}, found ${found}`;
}

/** Of a parameter or value of the file that would never be read. */
export function ownValue(name: string): string {
  return `\`${name}\` is a value that the language gives itself, and this one would never be read; choose another name`;
}

export function reserved(name: string): string {
  return `\`${name}\` is a word of the language; choose another name`;
}

export function twice(name: string, firstLine: number): string {
  return `\`${name}\` was already given on line ${firstLine}; rename one of the two`;
}

export function noStatement(word: string, known: readonly string[]): string {
  const brackets = `a rule is called with brackets, as in \`${word}()\``;
  const wayOut = ABSENT.get(`statement ${word}`) ?? perhaps(nearest(word, known)) ?? brackets;
  return `no statement begins with \`${word}\`; ${wayOut}`;
}

export const LEVELS_OF_PART = "a part cannot have `levels`; write a rule with `levels` and call it in the part";

/** Of a declaration in braces of which the last was opened there. */
export function declarationInside(text: string, opened: number): string {
  const { line, column } = placeOf(text, opened);
  const place = `the \`{\` of line ${line}, column ${column} is not closed before this one`;
  return `declarations stand outside of braces, and ${place}; close it with \`}\``;
}

/** Of a declaration where what stands before wants a statement. */
export function declarationBehind(word: string): string {
  const wayOut = "write one, such as `box(1, 2, 1)`, before it";
  return `\`${word}\` begins a declaration, and a statement is wanted here; ${wayOut}`;
}

/** Of a word that stands further on in what it belongs to. */
export function later(word: string, usage: string): string {
  return `no statement begins with \`${word}\`; it belongs into one or into a declaration, as in \`${usage}\``;
}

/** Of what changes a statement at the end of the file or of braces. */
export function nothingBehind(word: string): string {
  const wayOut = "write one, such as `box(1, 2, 1)`, or braces with several";
  return `\`${word}\` is for the statement behind it, and there is none; ${wayOut}`;
}

export function withoutLet(name: string): string {
  return `a value is named with \`let\`: write \`let ${name} = …\`; it never changes`;
}

export function otherKind(name: string, is: string, wanted: string): string {
  return `\`${name}\` is a ${is}, and a ${wanted} is wanted here`;
}

export function unclosed(open: string, close: string): string {
  return `this \`${open}\` has no \`${close}\``;
}

export function tooManyArguments(callee: string, most: number): string {
  const counted = most === 0 ? "no arguments" : most === 1 ? "1 argument" : `${most} arguments`;
  return `\`${callee}\` takes ${counted}; remove this one`;
}

/** Of what is called like `usage`. */
export function tooFewArguments(callee: string, usage: string): string {
  return `\`${callee}\` needs more arguments; write ${usage}`;
}

export function namedArgument(callee: string, usage: string): string {
  return `arguments of \`${callee}\` have no names; write ${usage}`;
}

export function missingNumber(callee: string, name: string, usage: string): string {
  return `\`${callee}\` needs \`${name}\`; write ${usage}`;
}

export function missingArgument(callee: string, name: string): string {
  return `\`${callee}\` needs \`${name}\`; give it, or a default where \`${callee}\` is defined`;
}

export function argumentTwice(name: string): string {
  return `\`${name}\` is given twice; remove one of the two`;
}

export function outOfRange(what: string, value: number, min: number, max: number): string {
  return `${what} is ${shown(value)}; it must be from ${shown(min)} to ${shown(max)}`;
}

/** A number as Rust writes it. */
export function shown(number: number): string {
  return `${number}`.replace("e+", "e");
}

export const NO_FILE = 'no file is named here; write its path from the folder of the first file, as in `"tree.dcg"`';

/** Of a face with a corner that is no point. */
export function noPoint(face: number, corner: number, points: number): string {
  const there = points === 1 ? "is 1 point" : `are ${points} points`;
  const counts = `there ${there}; faces and points are counted from 0`;
  return `face ${face} has a corner ${shown(corner)}, and ${counts}`;
}

export const DIVISION_BY_ZERO = "division by zero; test the divisor with `if` before";
export const RANGE_OF_LOOP =
  "`for` takes how often or a list, and no range: write `for i in 5`, which counts from 0 to 4, or `for i in [1, 2, 3]`";
export const ELSE = "`else` follows the statement of an `if`; there is none before this";
export const THEN = "`then` stands in values; the statement of an `if` follows its condition at once";
export const LET_IN_CHOOSE =
  "`choose` does one of its statements, and a `let` alone does nothing; put it before the `choose`, or in braces with " +
  "the statement that it is for";
/** Of a value of which a `let` is all that stands behind an `if`, a loop or a transform. */
export function loneLet(name: string): string {
  const why = "behind `if`, a loop or a transform, a `let` alone does nothing";
  return `\`${name}\` is not a value here: ${why}; put braces around it and what uses it`;
}

/** Of a value that is made of itself. */
export function ofItself(name: string): string {
  const wayOut = "make it of other values, or give it another name than what it is made of";
  return `\`${name}\` has no value yet where it is named; ${wayOut}`;
}

/** Of what closes something that is not open. */
export function unopened(close: string, open: string): string {
  return `this \`${close}\` has no \`${open}\` before it; remove it, or write what is missing`;
}

/** Of the name of a function where a value is wanted. */
export function functionAsValue(name: string, formals: readonly string[]): string {
  return `\`${name}\` is a function: write \`${name}(${formals.join(", ")})\``;
}

export const THEN_WITHOUT_LEVELS = "`then` says what a rule draws when its `levels` are used up; give it `levels`";
export const EQUALS = "`=` gives a value a name; compare with `==`";
export const COMPARED = "a comparison cannot follow another; join them with `and`, as in `a < b and b < c`";
export const COMMENT = "comments begin with `//` and end with their line";
export const POLYGON = "this polygon crosses itself or has no area; list its corners in order around it";

/** Of corners that lie so far off a plane, as a part of the longest side of a box around them. */
export function notFlat(off: number): string {
  const found = `its corners lie up to ${shown(Math.ceil(100 * off))} % of its size off a plane, where 1 % is allowed`;
  return `this polygon is not flat: ${found}; move them, or give \`mesh\` the faces that it is folded into`;
}

/** Blanks that are none of the language, and what has no picture at all. */
const UNSEEN = /\p{VS}|[\p{Cc}\u00a0\u061c\u1680\u180e\u2000-\u200f\u2028-\u202f\u205f\u2800\u3000]/u;

/** Whether there is nothing to see in a text. */
export function isUnseen(text: string): boolean {
  return [...text].every((character) => character === " " || hasNoPicture(character));
}

export function hasNoPicture(character: string): boolean {
  return UNSEEN.test(character) || HIDDEN.test(character);
}
