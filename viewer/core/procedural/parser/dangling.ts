/**
 * Which line is to blame where an operator ends one and no value follows? Line breaks mean nothing, so the parser takes what stands
 * on the next line for the value, and is surprised by that. As `crates/scene/src/procedural/parser/dangling.rs`.
 */
import { expected, Fault, isOfNoValue, isOfOtherKind, placeOf } from "../error.ts";
import { described, type Word, words } from "../lexer.ts";
import { solidNamed } from "../solid/kinds.ts";
import { DECLARATIONS, OPERATORS } from "./cursor.ts";
import { STATEMENTS } from "./statements.ts";

/** Signs and words behind which a value must stand. */
const SIGNS = ["+", "-", "*", "/", "==", "!=", "<=", ">=", "<", ">"];
const WORDS = ["and", "or", "not"];

/**
 * A mistake on a line that begins with no value where the line before ends with an operator is told behind that; all others stay
 * as they are.
 */
export function atItsOperator(text: string, fault: Fault): Fault {
  return (isOfNoValue(fault.problem) ? moved(text, fault) : undefined) ?? fault;
}

function moved(text: string, { at, problem }: Fault): Fault | undefined {
  const all = wordsOf(text);
  const before = text.slice(0, at);
  const lineAt = Math.max(before.lastIndexOf("\n"), before.lastIndexOf("\r")) + 1;
  const first = all.findIndex((word) => word.at >= lineAt);
  const [operator, found] = [all[first - 1], all[first]];
  const sign = operator && signOf(operator);
  if (sign === undefined || found === undefined || !beginsNone(all.slice(first), found.at === at, problem))
    return undefined;
  const where = found.kind === "end" ? "" : ` on line ${placeOf(text, found.at).line}`;
  const told = expected(`a value behind \`${sign}\``, `${described(found)}${where}`);
  return new Fault((operator as Word).at + sign.length, told);
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
function beginsNone(found: readonly Word[], isMet: boolean, problem: string): boolean {
  const [first] = found;
  switch (first?.kind) {
    case "name": {
      const { text } = first;
      if (text === "if") return !isValue(found);
      if (STATEMENTS.includes(text) || DECLARATIONS.includes(text)) return true;
      const isNoValue = solidNamed(text) !== undefined || (OPERATORS.includes(text) && text !== "not");
      return isMet && (isNoValue || isOfOtherKind(problem));
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
