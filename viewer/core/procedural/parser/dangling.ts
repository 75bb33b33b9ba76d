/**
 * Where is to blame that an operator ends a line, a block or the file, and no value follows? Line breaks mean nothing, so the parser takes
 * what stands next for the value, and is surprised by that. As `crates/scene/src/procedural/parser/dangling.rs`.
 */
import { expected, Fault, type Kind, placeOf } from "../error.ts";
import { described, type Word, words } from "../lexer.ts";
import { solidNamed } from "../solid/kinds.ts";
import { DECLARATIONS, OPERATORS } from "./cursor.ts";
import { STATEMENTS } from "./statements.ts";

/** Signs and words behind which a value must stand. */
const SIGNS = ["+", "-", "*", "/", "==", "!=", "<=", ">=", "<", ">"];
const WORDS = ["and", "or", "not"];
/** What closes brackets, or ends an argument. */
const CLOSERS = ["}", ")", "]", ","];
/** What may be said of a word that was taken for a value, or of what stands behind one. */
const OF_NO_VALUE: readonly (Kind | undefined)[] = ["expected", "no statement", "other kind", "unknown"];

/**
 * A mistake on a line that begins with no value where the line before ends with an operator is told behind that, and so is one where
 * something ends behind an operator; all others stay as they are.
 */
export function atItsOperator(text: string, fault: Fault): Fault {
  return (OF_NO_VALUE.includes(fault.kind) ? moved(text, fault) : undefined) ?? fault;
}

function moved(text: string, { at, kind }: Fault): Fault | undefined {
  const all = wordsOf(text);
  const before = text.slice(0, at);
  const lineAt = Math.max(before.lastIndexOf("\n"), before.lastIndexOf("\r")) + 1;
  const ends = all.findIndex((word) => word.at === at && isEnd(word));
  const first = ends < 0 ? all.findIndex((word) => word.at >= lineAt) : ends;
  const [operator, found] = [all[first - 1], all[first]];
  const sign = operator && signOf(operator);
  if (!operator || sign === undefined || !found) return undefined;
  if (!beginsNone(all.slice(first), found.at === at, kind)) return undefined;
  const behind = operator.at + sign.length;
  const { line } = placeOf(text, found.at);
  const where = found.kind === "end" || line === placeOf(text, behind).line ? "" : ` on line ${line}`;
  return new Fault(behind, expected(`a value behind \`${sign}\``, `${described(found)}${where}`), "expected");
}

/** Whether it ends what stands before it. */
function isEnd(word: Word): boolean {
  return word.kind === "end" || (word.kind === "symbol" && CLOSERS.includes(word.text));
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
      if (STATEMENTS.includes(text) || DECLARATIONS.includes(text)) return true;
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
  const begins = (word: string) =>
    word === "then" || STATEMENTS.includes(word) || DECLARATIONS.includes(word) || solidNamed(word) !== undefined;
  const first = found.slice(1).find((word) => word.kind === "name" && begins(word.text));
  return first?.kind === "name" && first.text === "then";
}
