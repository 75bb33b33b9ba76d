/**
 * Where is to blame that an operator ends a line, a block or the file, or a word of the language follows, and no value does? Line breaks
 * mean nothing, and values may be called by most words, so the parser takes what stands next for the value, and is surprised by that or
 * by what comes behind. As `crates/scene/src/procedural/parser/dangling.rs`.
 */
import { expected, Fault, type Kind, placeOf } from "../error.ts";
import { described, type Word, words } from "../lexer.ts";
import { solidNamed } from "../solid/kinds.ts";
import { DECLARATIONS, OPERATORS } from "./cursor.ts";
import { STATEMENTS } from "./statements.ts";
import { LATER } from "./usage.ts";

/** Signs and words behind which a value must stand. */
const SIGNS = ["+", "-", "*", "/", "==", "!=", "<=", ">=", "<", ">"];
const WORDS = ["and", "or", "not"];
/** Words behind which values are named. */
const NAMING = ["let", "parameter", "for", "edges", "as"];
/** What may be said of a word that was taken for a value, or of what stands behind one. */
const OF_NO_VALUE: readonly (Kind | undefined)[] = ["expected", "no statement", "other kind", "unknown"];

/**
 * A mistake on a line that begins with no value where the line before ends with an operator is told behind that, and so is one where
 * something ends behind an operator or something else begins; all others stay as they are.
 */
export function atItsOperator(text: string, fault: Fault): Fault {
  return (OF_NO_VALUE.includes(fault.kind) ? moved(text, fault) : undefined) ?? fault;
}

function moved(text: string, { at, kind }: Fault): Fault | undefined {
  const all = wordsOf(text);
  const before = text.slice(0, at);
  const lineAt = Math.max(before.lastIndexOf("\n"), before.lastIndexOf("\r")) + 1;
  const line = firstFrom(all, lineAt);
  const place = firstFrom(all, at);
  const ends = all[place]?.at === at && isEnd(all[place]) && isBehind(all, place);
  const begun = begunIn(all, line, place);
  const first = ends ? place : (begun ?? line);
  const [operator, found] = [all[first - 1], all[first]];
  const sign = operator && signOf(operator);
  if (!operator || sign === undefined || !found) return undefined;
  if (begun !== first && !beginsNone(all.slice(first), found.at === at, kind)) return undefined;
  const behind = operator.at + sign.length;
  const { line: foundOn } = placeOf(text, found.at);
  const where = found.kind === "end" || foundOn === placeOf(text, behind).line ? "" : ` on line ${foundOn}`;
  return new Fault(behind, expected(`a value behind \`${sign}\``, `${described(found)}${where}`), "expected");
}

/** The first word from there on, or as many as there are. */
function firstFrom(all: readonly Word[], at: number): number {
  const first = all.findIndex((word) => word.at >= at);
  return first < 0 ? all.length : first;
}

/** Whether no value begins so, and what stands before it ends there. */
function isEnd(word: Word): boolean {
  if (word.kind === "end") return true;
  // A number that begins with it has an advice of its own, and so have `if` and `not`.
  if (word.kind === "symbol") return word.text !== ".";
  return word.kind === "name" && ["then", "else", "and", "or"].includes(word.text);
}

/** Whether a word stands behind an operator. */
function isBehind(all: readonly Word[], index: number): boolean {
  const before = all[index - 1];
  return before !== undefined && signOf(before) !== undefined;
}

/** Whether a word begins a statement or a declaration. */
function begins(word: string): boolean {
  return STATEMENTS.includes(word) || DECLARATIONS.includes(word);
}

/**
 * The last word, on the line of a mistake, with which something else begins behind an operator, where that was taken for a value; a
 * word that stands further on in something is none if the mistake is not met with it, or right behind. Values may be called like any.
 */
function begunIn(all: readonly Word[], line: number, mistake: number): number | undefined {
  for (let index = mistake; index >= line; index -= 1) {
    const word = all[index];
    if (word?.kind !== "name" || !isBehind(all, index)) continue;
    const isLater = LATER.has(word.text) && mistake - index <= 1;
    if (((begins(word.text) && word.text !== "if") || isLater) && !isNamed(all, word.text)) return index;
  }
  return undefined;
}

/** Whether a text names a value so. */
function isNamed(all: readonly Word[], name: string): boolean {
  const isOne = (word: Word | undefined, kind: Word["kind"], known: readonly string[]) =>
    word?.kind === kind && "text" in word && known.includes(word.text);
  return all.some((word, i) => {
    const [before, behind] = [all[i - 1], all[i + 1]];
    if (!isOne(word, "name", [name]) || !before) return false;
    const isListed = isOne(before, "symbol", ["(", ","]) && isOne(behind, "symbol", [")", ","]);
    return isListed || isOne(before, "name", NAMING) || isOne(behind, "symbol", ["="]);
  });
}

/** The words of a text; none of one that has no meaning. */
function wordsOf(text: string): readonly Word[] {
  try {
    return words(text);
  } catch (error) {
    if (error instanceof Fault) return [];
    throw error;
  }
}

function signOf(word: Word): string | undefined {
  const known = word.kind === "symbol" ? SIGNS : word.kind === "name" ? WORDS : [];
  return "text" in word && known.includes(word.text) ? word.text : undefined;
}

/** Whether words begin with none of a value; `isMet` says whether the mistake is at the first of them. */
function beginsNone(found: readonly Word[], isMet: boolean, kind: Kind | undefined): boolean {
  const [first] = found;
  switch (first?.kind) {
    case "name": {
      const { text } = first;
      if (text === "if") return !isValue(found);
      if (begins(text)) return true;
      const isNoValue = solidNamed(text) !== undefined || (OPERATORS.includes(text) && text !== "not");
      return isMet && (isNoValue || kind === "other kind");
    }
    case "symbol":
    case "text":
    case "end":
      return isMet;
    default:
      return false;
  }
}

/** Whether an `if` is that of a value: its `then` comes before any statement does. */
function isValue(found: readonly Word[]): boolean {
  const isKnown = (word: string) => word === "then" || begins(word) || solidNamed(word) !== undefined;
  const first = found.slice(1).find((word) => word.kind === "name" && isKnown(word.text));
  return first?.kind === "name" && first.text === "then";
}
