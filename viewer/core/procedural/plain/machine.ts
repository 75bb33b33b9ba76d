/**
 * What do the words of a code compute? Numbers, in registers: nothing is made on the way. Where anything is amiss it gives
 * up, and the nodes are visited one by one, which says what and where.
 */

import { atan2, cosine, power, sine } from "../arithmetic.ts";
import { num } from "../numbers.ts";
import { fractals, fractalsOf, isWhole, randoms, randomsBetween } from "../operation.ts";
import { move, stretch, swing } from "../poses.ts";
import { type Globals, NO_NUMBER, type Stack } from "../stack.ts";
import type { List, Value } from "../value.ts";
import * as code from "./code.ts";
import { copy, WIDTH } from "./columns.ts";

/** Where names are looked up, and which random numbers belong here. */
export interface Scope {
  readonly module: number;
  readonly instance: number;
  /** Where the values of the rule begin on the stack. */
  readonly base: number;
  path: number;
  /** Calls inside each other. */
  readonly depth: number;
  /** Calls of this rule inside each other. */
  level: number;
}

export class Machine {
  /** Registers of the last run: one number in each, or a column of them. */
  registers: Float64Array = new Float64Array(code.MOST_REGISTERS);
  /** What it took, in all turns together. */
  steps = 0;
  nesting = 0;
  levels = 0;
  private readonly given = new Float64Array(code.MOST_REGISTERS);
  private readonly path = new Int32Array(1);

  constructor(
    private readonly seed: number,
    private readonly detail: number,
  ) {}

  /** Whether all results are in their registers now: finite numbers. */
  run(made: code.Code, scope: Scope, stack: Stack, file: Globals): boolean {
    const { registers, globals, locals } = made;
    const { numbers } = stack;
    this.registers = registers;
    if (made.file !== file) {
      for (let i = 0; i < globals.length; i += 2) {
        registers[globals[i + 1] as number] = file.numbers[globals[i] as number] as number;
      }
      registers[code.DETAIL] = this.detail;
      made.file = file;
    }
    for (let i = 0; i < locals.length; i += 2) {
      registers[locals[i + 1] as number] = numbers[scope.base + (locals[i] as number)] as number;
    }
    registers[code.LEVEL] = scope.level;
    this.path[0] = scope.path;
    this.skip(made, 1);
    const { words } = made;
    if (!code.isEmpty(words) && !this.compute(words, registers, 1, 1, this.path, scope, stack, file)) return false;
    // Of what is not finite, nothing is 0.
    return amissIn(registers, code.RESULTS, made.results) === 0;
  }

  /** Takes what a code takes in so many turns that has no branches. */
  skip({ cost }: { readonly cost: Readonly<code.Cost> }, turns: number): void {
    this.steps = cost.steps * turns;
    this.nesting = cost.nesting;
    this.levels = cost.levels;
  }

  /** Puts other numbers in place of results. */
  put(numbers: readonly number[]): void {
    this.registers = this.given;
    this.registers.set(numbers, code.RESULTS);
  }

  /** The same with those of one turn, in the columns of these registers. */
  putTurn(columns: Float64Array, registers: Int32Array, turn: number): void {
    const { given } = this;
    this.registers = given;
    for (let i = 0; i < registers.length; i += 1) {
      given[code.RESULTS + i] = columns[(registers[i] as number) * WIDTH + turn] as number;
    }
  }

  /**
   * Whether it came to its end in so many turns, which lie side by side in registers of that width. What is not finite shows in
   * the results, but where it is compared, divided by, or given to a function that may not look at it: some look themselves, for
   * others words come before or behind.
   */
  compute(
    words: Int32Array,
    registers: Float64Array,
    width: number,
    count: number,
    paths: Int32Array,
    scope: Scope,
    stack: Stack,
    file: Globals,
  ): boolean {
    const { seed } = this;
    for (let at = 0; ; ) {
      const word = words[at] as number;
      const sides = words[at + 1] as number;
      at = (at + 2) | 0;
      const to = Math.imul(word >>> 8, width);
      // Not all words are about registers; what is not is not read.
      const a = Math.imul(sides & 0xffff, width);
      const b = Math.imul(sides >>> 16, width);
      switch (word & 0xff) {
        case 0 satisfies typeof code.END:
          return true;
        case 1 satisfies typeof code.MOVE:
          copy(registers, a, registers, to, count);
          break;
        case 2 satisfies typeof code.ADD:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = num(registers, a + i) + num(registers, b + i);
          break;
        case 3 satisfies typeof code.SUBTRACT:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = num(registers, a + i) - num(registers, b + i);
          break;
        case 4 satisfies typeof code.MULTIPLY:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = num(registers, a + i) * num(registers, b + i);
          break;
        case 5 satisfies typeof code.DIVIDE:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = num(registers, a + i) / num(registers, b + i);
          break;
        case 6 satisfies typeof code.EQUAL:
          if (amissIn(registers, a, count) + amissIn(registers, b, count) !== 0) return false;
          for (let i = 0; i < count; i += 1)
            registers[(to + i) | 0] = num(registers, a + i) === num(registers, b + i) ? 1 : 0;
          break;
        case 7 satisfies typeof code.UNEQUAL:
          if (amissIn(registers, a, count) + amissIn(registers, b, count) !== 0) return false;
          for (let i = 0; i < count; i += 1)
            registers[(to + i) | 0] = num(registers, a + i) === num(registers, b + i) ? 0 : 1;
          break;
        case 8 satisfies typeof code.LESS:
          if (amissIn(registers, a, count) + amissIn(registers, b, count) !== 0) return false;
          for (let i = 0; i < count; i += 1)
            registers[(to + i) | 0] = num(registers, a + i) < num(registers, b + i) ? 1 : 0;
          break;
        case 9 satisfies typeof code.AT_MOST:
          if (amissIn(registers, a, count) + amissIn(registers, b, count) !== 0) return false;
          for (let i = 0; i < count; i += 1)
            registers[(to + i) | 0] = num(registers, a + i) <= num(registers, b + i) ? 1 : 0;
          break;
        case 10 satisfies typeof code.MINUS:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = -num(registers, a + i);
          break;
        case 11 satisfies typeof code.NOT:
          if (amissIn(registers, a, count) !== 0) return false;
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = num(registers, a + i) === 0 ? 1 : 0;
          break;
        case 12 satisfies typeof code.TRUTH:
          if (amissIn(registers, a, count) !== 0) return false;
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = num(registers, a + i) === 0 ? 0 : 1;
          break;
        case 13 satisfies typeof code.ABS:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = Math.abs(num(registers, a + i));
          break;
        case 14 satisfies typeof code.ATAN2:
          if (amissIn(registers, a, count) + amissIn(registers, b, count) !== 0) return false;
          for (let i = 0; i < count; i += 1)
            registers[(to + i) | 0] = atan2(num(registers, a + i), num(registers, b + i));
          break;
        case 15 satisfies typeof code.CEIL:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = -Math.floor(-num(registers, a + i));
          break;
        case 16 satisfies typeof code.COS:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = cosine(num(registers, a + i));
          break;
        case 17 satisfies typeof code.FLOOR:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = Math.floor(num(registers, a + i));
          break;
        case 18 satisfies typeof code.MAX:
          if (amissIn(registers, a, count) + amissIn(registers, b, count) !== 0) return false;
          for (let i = 0; i < count; i += 1) {
            registers[(to + i) | 0] =
              num(registers, a + i) > num(registers, b + i) ? num(registers, a + i) : num(registers, b + i);
          }
          break;
        case 19 satisfies typeof code.MIN:
          if (amissIn(registers, a, count) + amissIn(registers, b, count) !== 0) return false;
          for (let i = 0; i < count; i += 1) {
            registers[(to + i) | 0] =
              num(registers, a + i) < num(registers, b + i) ? num(registers, a + i) : num(registers, b + i);
          }
          break;
        case 20 satisfies typeof code.MOD:
          for (let i = 0; i < count; i += 1) {
            const whole = Math.floor(num(registers, a + i) / num(registers, b + i));
            registers[(to + i) | 0] = num(registers, a + i) - num(registers, b + i) * whole;
          }
          break;
        case 21 satisfies typeof code.NOISE:
          fractals(seed, registers, a, b, words[at] as number, count, to);
          at += 1;
          break;
        case 22 satisfies typeof code.POWER:
          if (amissIn(registers, a, count) !== 0) return false;
          for (let i = 0; i < count; i += 1) {
            if (!isWhole(num(registers, b + i))) return false;
            registers[(to + i) | 0] = power(num(registers, a + i), num(registers, b + i));
          }
          break;
        case 23 satisfies typeof code.ROUND:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = Math.floor(num(registers, a + i) + 0.5);
          break;
        case 24 satisfies typeof code.SIN:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = sine(num(registers, a + i));
          break;
        case 25 satisfies typeof code.SQRT:
          for (let i = 0; i < count; i += 1) registers[(to + i) | 0] = Math.sqrt(num(registers, a + i));
          break;
        case 26 satisfies typeof code.RANDOM: {
          const sites = words[at] as number;
          randoms(paths, words, at + 1, sites, count, registers, to);
          at += 1 + sites;
          break;
        }
        case 27 satisfies typeof code.RANDOM_BETWEEN: {
          const sites = words[at] as number;
          randomsBetween(paths, words, at + 1, sites, count, registers, a, b, to);
          at += 1 + sites;
          break;
        }
        case 28 satisfies typeof code.CLAMP: {
          const c = (words[at] as number) * width;
          for (let i = 0; i < count; i += 1) {
            const number = num(registers, a + i);
            const least = num(registers, b + i);
            const most = num(registers, c + i);
            registers[(to + i) | 0] = number < least ? least : number > most ? most : number;
          }
          at += 1;
          break;
        }
        case 29 satisfies typeof code.MIX: {
          const part = (words[at] as number) * width;
          for (let i = 0; i < count; i += 1) {
            const from = num(registers, a + i);
            registers[(to + i) | 0] = from + (num(registers, b + i) - from) * num(registers, part + i);
          }
          at += 1;
          break;
        }
        case 30 satisfies typeof code.FRACTAL: {
          const octaves = (words[at] as number) * width;
          for (let i = 0; i < count; i += 1) this.steps += Math.floor(num(registers, octaves + i));
          fractalsOf(seed, registers, a, b, octaves, count, to);
          at += 1;
          break;
        }
        case 31 satisfies typeof code.ITEM: {
          const slot = words[at] as number;
          const list = a === code.AMONG_LOCALS ? listed(stack, scope.base + slot) : listed(file, slot);
          const count = words[at + 1] as number;
          registers[to] = itemOf(list, registers, words, at + 2, count);
          at += 2 + count;
          break;
        }
        case 32 satisfies typeof code.COUNT: {
          const slot = words[at] as number;
          const list = a === code.AMONG_LOCALS ? listed(stack, scope.base + slot) : listed(file, slot);
          if (!list) return false;
          registers[to] = list.items.length;
          at += 1;
          break;
        }
        case 33 satisfies typeof code.COST:
          this.steps += words[at] as number;
          this.nesting = Math.max(this.nesting, words[at + 1] as number);
          this.levels = Math.max(this.levels, words[at + 2] as number);
          at += 3;
          break;
        case 34 satisfies typeof code.JUMP:
          at = words[at] as number;
          break;
        case 35 satisfies typeof code.JUMP_IF_NOT:
          if (amissIn(registers, a, 1) !== 0) return false;
          at = registers[a] === 0 ? (words[at] as number) : at + 1;
          break;
        case 36 satisfies typeof code.CHECK:
          if (amissIn(registers, a, count) !== 0) return false;
          break;
        case 37 satisfies typeof code.WITHIN: {
          const least = num(registers, b);
          const most = num(registers, (words[at] as number) * width);
          for (let i = 0; i < count; i += 1) {
            const number = num(registers, a + i);
            if (!(least <= number && number <= most)) return false;
          }
          at += 1;
          break;
        }
        case 38 satisfies typeof code.APART: {
          const least = num(registers, b);
          for (let i = 0; i < count; i += 1) if (!(Math.abs(num(registers, a + i)) >= least)) return false;
          break;
        }
        case 39 satisfies typeof code.MOVED:
          move(registers, to, a, b, words, at, width, count);
          at += 6;
          break;
        case 40 satisfies typeof code.SWUNG:
          swing(registers, to, a, b, words, at, width, count);
          at += 2;
          break;
        case 41 satisfies typeof code.STRETCHED:
          stretch(registers, to, a, b, width, count);
          break;
      }
    }
  }
}

/** 0 when all of so many numbers are finite, else not a number. */
function amissIn(registers: Float64Array, at: number, count: number): number {
  let amiss = 0;
  for (let i = 0; i < count; i += 1) amiss += num(registers, at + i) - num(registers, at + i);
  return amiss;
}

/** The list at a place, if there is one. */
function listed({ numbers, lists }: Stack | Globals, at: number): List | undefined {
  return Number.isNaN(numbers[at]) ? lists[at] : undefined;
}

/** An item of a list, or of lists in it, by so many numbers; not a number when there is none. */
function itemOf(
  list: List | undefined,
  registers: Float64Array,
  words: Int32Array,
  first: number,
  count: number,
): number {
  let value: Value | undefined = list;
  for (let at = first; at < first + count; at += 1) {
    if (typeof value !== "object") return NO_NUMBER;
    value = value.items[Math.floor(registers[words[at] as number] as number)];
  }
  return typeof value === "number" ? value : NO_NUMBER;
}
