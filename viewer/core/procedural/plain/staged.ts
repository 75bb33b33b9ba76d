/**
 * When is something computed? Once for each file, once for all turns of a loop, or in each of them: words are put where they
 * belong (hoisting of loop invariants), and what numbers must be is looked at no oftener than it has to be.
 */
import * as code from "./code.ts";
import { fill, WIDTH } from "./columns.ts";
import { Compiler, NOT_PLAIN, type Reach } from "./compiler.ts";
import { Extents } from "./extents.ts";
import type { Plan, Prelude } from "./plan.ts";

/** Columns of registers take more room than registers. */
const MOST_COLUMNS = 2048;

// When something is computed: once for each file, once for all turns, or in each of them.
const ONCE = 0;
export const FOR_ALL = 1;
export const IN_TURN = 2;
export type When = typeof ONCE | typeof FOR_ALL | typeof IN_TURN;

/** The part of a plan that computes. */
type Computing = Pick<Plan, "once" | "forAll" | "words" | "columns" | "globals" | "locals" | "cost">;

export class StagedCompiler extends Compiler {
  /** When each register has its number. */
  private readonly whens: When[] = [ONCE, FOR_ALL];
  private readonly preludes: readonly [number[], number[]] = [[], []];
  /** What numbers of registers must be; looked at when all of them are known. */
  private readonly wanted: [register: number, min: number, max: number][] = [];
  protected readonly extents = new Extents();
  /** Registers that turns ask for. */
  private readonly asked = new Set<number>();
  /** What a turn takes depends on its numbers. */
  protected varies = false;

  /** All that was compiled. */
  protected compiled(): Computing {
    this.look();
    const columns = new Float64Array(WIDTH * this.registers);
    for (const [number, to] of this.constants) fill(columns, WIDTH * to, number, WIDTH);
    return {
      once: this.prelude(ONCE),
      forAll: this.prelude(FOR_ALL),
      words: ended(this.words),
      columns,
      globals: Int32Array.from(this.globals.flat()),
      locals: Int32Array.from(this.locals.flat()),
      cost: this.cost,
    };
  }

  private prelude(when: typeof ONCE | typeof FOR_ALL): Prelude {
    const constants = new Set(this.constants.map(([, to]) => to));
    const spread = [...this.asked].filter((register) => this.whens[register] === when && !constants.has(register));
    return { words: ended(this.preludes[when]), spread: Int32Array.from(spread) };
  }

  protected override register(): number {
    if (this.registers === MOST_COLUMNS) throw NOT_PLAIN;
    this.whens[this.registers] = ONCE;
    this.registers += 1;
    return this.registers - 1;
  }

  /** The first of so many registers. */
  protected registersFor(count: number, when: When): number {
    const first = this.registers;
    for (let i = 0; i < count; i += 1) this.whens[this.register()] = when;
    return first;
  }

  protected ask(...registers: readonly number[]): void {
    for (const register of registers) this.asked.add(register);
  }

  /** Emits words about registers that have their numbers by then. */
  private emitFor(when: When, words: readonly number[], of: readonly number[]): void {
    const to = when === IN_TURN ? this.words : this.preludes[when];
    to.push(...words);
    if (to.length > code.MOST_WORDS) throw NOT_PLAIN;
    if (when === IN_TURN) this.ask(...of);
  }

  private whenOf(registers: readonly number[]): When {
    return Math.max(...registers.map((register) => this.whens[register] as When)) as When;
  }

  protected override made(
    word: number,
    to: number | undefined,
    a: number,
    b: number,
    ...more: readonly number[]
  ): number {
    const key = [word, a, b, ...more].join();
    const known = this.known.get(key);
    if (known !== undefined) return known;
    const isRandom = word === code.RANDOM || word === code.RANDOM_BETWEEN;
    const of = isRandom || word === code.NOISE ? [a, b] : [a, b, ...more];
    // Octaves are counted in each turn.
    const when = isRandom || word === code.FRACTAL ? IN_TURN : this.whenOf(of);
    if (word === code.FRACTAL) this.varies = true;
    const result = to ?? this.register();
    this.whens[result] = when;
    this.extents.compute(result, word, of);
    this.emitFor(when, [...code.wordsOf(word, result, a, b), ...more], of);
    if (word !== code.FRACTAL) this.known.set(key, result);
    return result;
  }

  protected override local(slot: number, reach: Reach, to: number | undefined): number {
    const register = super.local(slot, reach, to);
    if (reach.given[slot] === undefined) this.whens[register] = FOR_ALL;
    return register;
  }

  protected override branches(): never {
    throw NOT_PLAIN;
  }

  protected override listed(): never {
    throw NOT_PLAIN;
  }

  /** Words that give up where a number is not as it must be. */
  protected must(word: number, register: number, ...than: readonly number[]): void {
    const key = ["must", word, register, ...than].join();
    if (this.known.has(key)) return;
    this.known.set(key, register);
    const [a = 0, ...more] = than;
    this.emitFor(this.whenOf([register]), [...code.wordsOf(word, 0, register, a), ...more], [register]);
  }

  protected override constant(value: number, to: number | undefined): number {
    const register = super.constant(value, to);
    this.extents.set(register, value, value);
    return register;
  }

  protected override checked(register: number): void {
    this.within(register, -Number.MAX_VALUE, Number.MAX_VALUE);
  }

  protected within(register: number, min: number, max: number): void {
    this.wanted.push([register, min, max]);
  }

  /** Has words look at what must be, where it is not so anyway; what is computed of others behind them. */
  private look(): void {
    for (const [register, min, max] of this.wanted.sort(([a, , most], [b, , other]) => a - b || most - other)) {
      if (this.extents.areWithin(register, min, max)) continue;
      if (max === Number.MAX_VALUE) this.must(code.CHECK, register);
      else this.must(code.WITHIN, register, this.constant(min, undefined), this.constant(max, undefined));
      this.extents.set(register, min, max);
    }
  }

  /** What becomes of axes and origins, three registers each, by some numbers. */
  protected posed(word: number, count: number, of: readonly number[], by: readonly number[]): number {
    const first = this.registersFor(count, IN_TURN);
    const differing =
      word === code.STRETCHED ? [] : [of.reduce((bits, axis, i) => bits | (this.differs(axis) << i), 0)];
    const [a = 0, b = 0, ...more] = [...of, ...by, ...differing];
    this.emitFor(IN_TURN, [...code.wordsOf(word, first, a, b), ...more], by);
    for (const axis of of) if (word === code.STRETCHED || this.differs(axis)) this.ask(axis, axis + 1, axis + 2);
    return first;
  }

  private differs(register: number): number {
    return this.whens[register] === IN_TURN ? 1 : 0;
  }
}

function ended(words: readonly number[]): Int32Array {
  return Int32Array.from([...words, ...code.wordsOf(code.END, 0, 0, 0)]);
}
