/** Which words does a text consist of? As `crates/scene/src/procedural/lexer.rs`. */
import { COMMENT, cut, Fault, shown } from "./error.ts";
import { MAX_NAME, reached } from "./limits.ts";
import { noWord } from "./signs.ts";

export type Word =
  | { readonly kind: "name"; readonly text: string; readonly at: number }
  | { readonly kind: "number"; readonly value: number; readonly at: number }
  | { readonly kind: "text"; readonly text: string; readonly at: number }
  | { readonly kind: "colour"; readonly channels: readonly [number, number, number]; readonly at: number }
  | { readonly kind: "symbol"; readonly text: string; readonly at: number }
  | { readonly kind: "end"; readonly at: number };

/** How a word is called in an error. */
export function described(word: Word): string {
  switch (word.kind) {
    case "name":
    case "symbol":
      return `\`${word.text}\``;
    case "number":
      return `the number ${shown(word.value)}`;
    case "text":
      return `"${cut(word.text)}"`;
    case "colour":
      return "a colour";
    case "end":
      return "the end of the file";
  }
}

const BLANK = /(?:[ \t\r\n\ufeff]|\/\/[^\r\n]*)*/y;
const NAME = /[A-Za-z_][A-Za-z0-9_]*/y;
/** Whatever begins like a number; checked as a whole. */
const NUMBER = /[0-9](?:[A-Za-z0-9._]*[eE][-+][A-Za-z0-9]*|[A-Za-z0-9._]*)/y;
const SOUND_NUMBER = /^[0-9]+(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?$/;
const COLOUR = /#([A-Za-z0-9]*)/y;
const TEXT = /"([^"\r\n]*)"/y;
const SYMBOL = /<=|>=|==|!=|[()[\]{},=<>+\-*/.]/y;

/** The words of a text, with an end behind the last. */
export function words(text: string): Word[] {
  const found: Word[] = [];
  let at = 0;
  const match = (pattern: RegExp): RegExpExecArray | undefined => {
    pattern.lastIndex = at;
    return pattern.exec(text) ?? undefined;
  };
  for (;;) {
    at += match(BLANK)?.[0].length ?? 0;
    if (at >= text.length) return [...found, { kind: "end", at }];
    const first = text[at] as string;
    const taken = match(NAME) ?? match(NUMBER) ?? match(COLOUR) ?? match(TEXT) ?? match(SYMBOL);
    if (!taken) {
      if (first === '"') throw new Fault(at, 'this text has no end; close it with `"` on the same line');
      const character = String.fromCodePoint(text.codePointAt(at) ?? 0);
      throw new Fault(at, noWord(character));
    }
    if (text.startsWith("/*", at)) throw new Fault(at, COMMENT);
    found.push(wordOf(first, taken[0], taken[1] ?? "", at));
    at += taken[0].length;
  }
}

function wordOf(first: string, taken: string, inner: string, at: number): Word {
  if (/[A-Za-z_]/.test(first)) {
    if (taken.length > MAX_NAME) throw new Fault(at, reached("letters in a name", MAX_NAME));
    return { kind: "name", text: taken, at };
  }
  if (/[0-9]/.test(first)) {
    const value = Number(taken);
    if (!SOUND_NUMBER.test(taken) || !Number.isFinite(value)) {
      throw new Fault(at, `\`${cut(taken)}\` is not a number; write \`0.5\`, \`12\` or \`1e-3\``);
    }
    return { kind: "number", value, at };
  }
  if (first === "#") return { kind: "colour", channels: channelsOf(inner, at), at };
  if (first === '"') return { kind: "text", text: inner, at };
  return { kind: "symbol", text: taken, at };
}

function channelsOf(digits: string, at: number): [number, number, number] {
  const sound = /^(?:[0-9a-fA-F]{3}|[0-9a-fA-F]{6})$/.test(digits);
  if (!sound) {
    const wayOut = "write `#rgb` or `#rrggbb` with hexadecimal digits; comments begin with `//`";
    throw new Fault(at, `\`#${cut(digits)}\` is not a colour; ${wayOut}`);
  }
  const width = digits.length / 3;
  const channel = (i: number) => {
    const pair = digits.slice(i * width, (i + 1) * width);
    return Number.parseInt(width === 1 ? pair + pair : pair, 16) / 255;
  };
  return [channel(0), channel(1), channel(2)];
}
