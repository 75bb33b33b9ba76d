/** How are words read one after the other? The cursor knows the next word, and which values are in reach. */
import {
  declarationBehind,
  declarationInside,
  emptyName,
  expected,
  Fault,
  isUnseen,
  lineOf,
  NO_FILE,
  orderIn,
  reserved,
  twice,
  unclosed,
  unreadableIn,
  unseen,
} from "../error.ts";
import { described, type Word } from "../lexer.ts";
import { MAX_AROUND, MAX_CHAIN, MAX_NAME, MAX_NESTING, reached } from "../limits.ts";
import type { At, Module } from "../syntax.ts";
import { Reach } from "./reach.ts";
import { VALUE } from "./usage.ts";

/** Words of expressions, which no value can be called. */
export const OPERATORS = ["if", "then", "else", "and", "or", "not"];

/** Words with which a declaration begins. */
export const DECLARATIONS = ["import", "parameter", "material", "function", "rule", "part"];

export interface NamedAt {
  readonly name: string;
  readonly at: At;
}

/** Names, and where each was given. */
export type Given = Map<string, At>;

export class Cursor {
  private position = 0;
  private nesting = 0;
  /** Words of statements and values that stand around what is read. */
  private around = 0;
  /** Whether what is read belongs to a part. */
  protected inPart = false;
  /** Braces that are open. */
  private readonly open: At[] = [];
  /** The values in reach. */
  private scope = new Reach();
  /** Most values that were in reach at once. */
  protected slots = 0;
  /** Values of which a `let` is all that stands behind what it is for, and where the first of each is. */
  protected readonly lone = new Map<string, At>();
  /** Where a `let` of a block reads what it names, of which there may be another in the file. */
  protected readonly own = new Set<At>();
  /** Calls, loops and random numbers so far in this rule. */
  private sites = 0;

  constructor(
    readonly module: Module,
    private readonly words: readonly Word[],
  ) {}

  get next(): Word {
    return this.words[Math.min(this.position, this.words.length - 1)] as Word;
  }

  get afterNext(): Word | undefined {
    return this.words[this.position + 1];
  }

  skip(count = 1): void {
    this.position += count;
  }

  isSymbol(symbol: string): boolean {
    const { next } = this;
    return next.kind === "symbol" && next.text === symbol;
  }

  takes(symbol: string): boolean {
    const found = this.isSymbol(symbol);
    if (found) this.skip();
    return found;
  }

  takesWord(word: string): boolean {
    const found = this.isWord(word);
    if (found) this.skip();
    return found;
  }

  expected(what: string): Fault {
    return new Fault(this.next.at, expected(what, described(this.next)), "expected");
  }

  /** A sign, without which `what` is missing. */
  expect(symbol: string, what = symbol === "=" ? VALUE : `\`${symbol}\``): void {
    if (!this.takes(symbol)) throw this.expected(what);
  }

  /** An opening brace, without which `what` is missing. */
  protected opens(what: string): void {
    this.open.push(this.next.at);
    this.expect("{", what);
  }

  /** Whether the brace that was opened last is closed here. */
  protected closes(): boolean {
    const found = this.takes("}");
    if (found) this.open.pop();
    return found;
  }

  /** The word of a declaration that begins here, where only something else may. */
  protected declares(): string | undefined {
    const { next, afterNext } = this;
    if (next.kind !== "name" || !DECLARATIONS.includes(next.text)) return undefined;
    // Values may be called so, and whoever writes brackets means a rule.
    const isOther = afterNext?.kind === "symbol" && ["(", ".", "="].includes(afterNext.text);
    return isOther ? undefined : next.text;
  }

  /** What is wrong where a declaration stands in braces, or behind what a statement belongs to. */
  protected misplaced(word: string): Fault {
    const opened = this.open.at(-1);
    const isInside = opened !== undefined;
    return new Fault(this.next.at, isInside ? declarationInside(this.module.text, opened) : declarationBehind(word));
  }

  /** Refuses a name that was given before. */
  protected give(given: Given, { name, at }: NamedAt): void {
    const first = given.get(name);
    if (first !== undefined) throw new Fault(at, twice(name, this.line(first)));
    given.set(name, at);
  }

  isWord(word: string): boolean {
    const { next } = this;
    return next.kind === "name" && next.text === word;
  }

  /** A word that stands where it does in `usage`. */
  expectWord(word: string, usage: string): void {
    if (!this.takesWord(word)) throw this.expected(`\`${word}\`, as in \`${usage}\``);
  }

  /** A comma between items, unless the bracket that was opened closes behind this one. */
  separated(opened: At, open: string, close: string): void {
    if (this.isSymbol(close) || this.takes(",")) return;
    if (this.next.kind === "end") throw new Fault(opened, unclosed(open, close));
    throw this.expected(`\`,\` or \`${close}\``);
  }

  name(what: string): NamedAt {
    const { next } = this;
    if (next.kind !== "name") throw this.expected(what);
    if (OPERATORS.includes(next.text)) throw new Fault(next.at, reserved(next.text));
    this.skip();
    return { name: next.text, at: next.at };
  }

  text(what: string): string {
    const { next } = this;
    if (next.kind !== "text") throw this.expected(what);
    this.skip();
    return next.text;
  }

  /** The name of something, which people read or are read: `word` stands before it. */
  protected named(word: string, what: string): string {
    const { at } = this.next;
    const name = this.text(what);
    if (isUnseen(name)) throw new Fault(at, emptyName(word));
    refuseUnseen(name, at, "letters in a name", unreadableIn);
    return name;
  }

  /** The path of a file. */
  protected path(what: string): string {
    const { at } = this.next;
    const path = tidied(this.text(what));
    if (isBlank(path)) throw new Fault(at, NO_FILE);
    refuseUnseen(path, at, "letters in a path", orderIn);
    return path;
  }

  /** Runs `read` one level deeper. */
  nested<T>(read: () => T): T {
    if (this.nesting === MAX_NESTING) {
      throw new Fault(this.next.at, reached("brackets and blocks inside each other", MAX_NESTING));
    }
    this.nesting += 1;
    const result = read();
    this.nesting -= 1;
    return result;
  }

  /** Counts what stands around what comes next, which is as deep in the tree as brackets make it. */
  protected surrounds(): void {
    if (this.around === MAX_AROUND) {
      throw new Fault(this.next.at, reached("transforms, loops and conditions around one another", MAX_AROUND));
    }
    this.around += 1;
  }

  /** Ends so much of that. */
  protected leaves(count: number): void {
    this.around -= count;
  }

  /** A long chain of operators is as deep a tree as brackets make. */
  chained(count: number): number {
    if (count >= MAX_CHAIN) throw new Fault(this.next.at, reached("operators in a row", MAX_CHAIN));
    return count + 1;
  }

  site(): number {
    this.sites += 1;
    return this.sites;
  }

  /** Brings a value into reach. */
  bind(name: string): number {
    const slot = this.scope.push(name);
    this.slots = Math.max(this.slots, this.scope.length);
    return slot;
  }

  /** How many values are in reach. */
  protected get reach(): number {
    return this.scope.length;
  }

  /** Notes that the value that came into reach last is one of those. */
  protected standsAlone(at: At): void {
    const { last } = this.scope;
    if (last !== undefined && !this.lone.has(last)) this.lone.set(last, at);
  }

  /** Leaves only the first ones in reach. */
  protected truncate(reach: number): void {
    this.scope.truncate(reach);
  }

  slotOf(name: string): number | undefined {
    return this.scope.slotOf(name);
  }

  /** Runs `read`, after which what it bound is out of reach. */
  enclosed<T>(read: () => T): T {
    const reach = this.scope.length;
    const result = read();
    this.scope.truncate(reach);
    return result;
  }

  /** Runs `read` with nothing in reach, and says how many values it needed. */
  framed<T>(read: () => T): [T, number] {
    const { scope, slots, sites } = this;
    this.scope = new Reach();
    this.slots = 0;
    this.sites = 0;
    const result = read();
    const needed = this.slots;
    this.scope = scope;
    this.slots = slots;
    this.sites = sites;
    return [result, needed];
  }

  line(at: At): number {
    return lineOf(this.module.text, at);
  }
}

/** Refuses a text that is longer than anybody reads, or has a character in it that is not for who reads it. */
function refuseUnseen(text: string, at: At, letters: string, otherIn: (text: string) => string | undefined): void {
  if ([...text].length > MAX_NAME) throw new Fault(at, reached(letters, MAX_NAME));
  const other = otherIn(text);
  if (other !== undefined) throw new Fault(at, unseen(other));
}

/**
 * The same file, however its path is written: with `./` before it, or through folders that it leaves again. One that leaves the
 * folder of the first file keeps what it leaves it by.
 */
function tidied(written: string): string {
  const path = written.replace(/^(\.\/)+/, "");
  const all = path.split("/");
  if (!all.includes("..")) return path;
  const parts: string[] = [];
  for (const part of all.filter((part) => part !== ".")) {
    const last = parts.at(-1) ?? "";
    if (part === ".." && last !== "" && last !== "..") parts.pop();
    else parts.push(part);
  }
  return parts.join("/");
}

/** Whether a path names no file: there is nothing in it but the language's own blanks. */
function isBlank(path: string): boolean {
  return /^[ \t\r\n]*$/.test(path);
}
