/** How are words read one after the other? The cursor knows the next word, and which values are in reach. */
import { expected, Fault, lineOf, reserved, unclosed } from "../error.ts";
import { described, type Word } from "../lexer.ts";
import { MAX_CHAIN, MAX_NESTING, reached } from "../limits.ts";
import type { At, Module } from "../syntax.ts";

/** Words of expressions, which no value can be called. */
export const OPERATORS = ["if", "then", "else", "and", "or", "not"];

export interface NamedAt {
  readonly name: string;
  readonly at: At;
}

export class Cursor {
  private position = 0;
  private nesting = 0;
  /** Names of the values in reach; their places are their slots. */
  protected scope: string[] = [];
  /** Most values that were in reach at once. */
  protected slots = 0;
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
    const { next } = this;
    const found = next.kind === "name" && next.text === word;
    if (found) this.skip();
    return found;
  }

  expected(what: string): Fault {
    return new Fault(this.next.at, expected(what, described(this.next)));
  }

  expect(symbol: string): void {
    if (!this.takes(symbol)) throw this.expected(`\`${symbol}\``);
  }

  expectWord(word: string): void {
    if (!this.takesWord(word)) throw this.expected(`\`${word}\``);
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
    this.scope.push(name);
    this.slots = Math.max(this.slots, this.scope.length);
    return this.scope.length - 1;
  }

  slotOf(name: string): number {
    return this.scope.lastIndexOf(name);
  }

  /** Runs `read`, after which what it bound is out of reach. */
  enclosed<T>(read: () => T): T {
    const reach = this.scope.length;
    const result = read();
    this.scope.length = reach;
    return result;
  }

  /** Runs `read` with nothing in reach, and says how many values it needed. */
  framed<T>(read: () => T): [T, number] {
    const { scope, slots, sites } = this;
    this.scope = [];
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
