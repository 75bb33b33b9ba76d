/**
 * What do the words of a code compute? Numbers, in registers: nothing is made on the way. Where anything is amiss it gives
 * up, and the nodes are visited one by one, which says what and where.
 */
import { atan2, cosine, power, sine } from "../arithmetic.ts";
import { fractal, isWhole, random } from "../operation.ts";
import { type Globals, NO_NUMBER, type Stack } from "../stack.ts";
import type { List, Value } from "../value.ts";
import * as code from "./code.ts";

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
  /** Registers of the last run. */
  registers: Float64Array = new Float64Array(code.MOST_REGISTERS);
  /** What it took. */
  steps = 0;
  nesting = 0;
  levels = 0;
  private readonly given = new Float64Array(code.MOST_REGISTERS);

  constructor(
    private readonly seed: number,
    private readonly detail: number,
  ) {}

  /** Whether all results are in their registers now: finite numbers. */
  run(made: code.Code, scope: Scope, stack: Stack, file: Globals): boolean {
    const { registers, locals, results } = made;
    const { numbers } = stack;
    this.registers = registers;
    if (made.file !== file) this.load(made, file);
    for (let i = 0; i < locals.length; i += 2) {
      registers[locals[i + 1] as number] = numbers[scope.base + (locals[i] as number)] as number;
    }
    registers[code.LEVEL] = scope.level;
    this.skip(made);
    if (made.words.length > 1 && !this.compute(made, scope, stack, file)) return false;
    // Of what is not finite, nothing is 0.
    let amiss = 0;
    for (let i = code.RESULTS; i < code.RESULTS + results; i += 1) {
      amiss += (registers[i] as number) - (registers[i] as number);
    }
    return amiss === 0;
  }

  /** Takes what a code takes that has no branches. */
  skip({ cost }: code.Code): void {
    this.steps = cost.steps;
    this.nesting = cost.nesting;
    this.levels = cost.levels;
  }

  /** Puts other numbers in place of results. */
  put(numbers: readonly number[]): void {
    this.registers = this.given;
    this.registers.set(numbers, code.RESULTS);
  }

  private load(made: code.Code, file: Globals): void {
    const { registers, globals } = made;
    for (let i = 0; i < globals.length; i += 2) {
      registers[globals[i + 1] as number] = file.numbers[globals[i] as number] as number;
    }
    registers[code.DETAIL] = this.detail;
    made.file = file;
  }

  /** Whether it came to its end. What is not finite shows in the results, but where it is compared or divided by. */
  private compute({ registers, words }: code.Code, scope: Scope, stack: Stack, file: Globals): boolean {
    const { seed } = this;
    for (let at = 0; ; ) {
      const word = words[at] as number;
      at = (at + 1) | 0;
      const to = (word >>> 8) & 0xff;
      const left = (word >>> 16) & 0xff;
      const right = word >>> 24;
      // Not all words are about registers; what is read for nothing does no harm.
      const a = registers[left] as number;
      const b = registers[right] as number;
      switch (word & 0xff) {
        case 0 satisfies typeof code.END:
          return true;
        case 1 satisfies typeof code.MOVE:
          registers[to] = a;
          break;
        case 2 satisfies typeof code.ADD:
          registers[to] = a + b;
          break;
        case 3 satisfies typeof code.SUBTRACT:
          registers[to] = a - b;
          break;
        case 4 satisfies typeof code.MULTIPLY:
          registers[to] = a * b;
          break;
        case 5 satisfies typeof code.DIVIDE:
          if (b - b !== 0) return false;
          registers[to] = a / b;
          break;
        case 6 satisfies typeof code.EQUAL:
          if (a - a + (b - b) !== 0) return false;
          registers[to] = a === b ? 1 : 0;
          break;
        case 7 satisfies typeof code.UNEQUAL:
          if (a - a + (b - b) !== 0) return false;
          registers[to] = a === b ? 0 : 1;
          break;
        case 8 satisfies typeof code.LESS:
          if (a - a + (b - b) !== 0) return false;
          registers[to] = a < b ? 1 : 0;
          break;
        case 9 satisfies typeof code.AT_MOST:
          if (a - a + (b - b) !== 0) return false;
          registers[to] = a <= b ? 1 : 0;
          break;
        case 10 satisfies typeof code.MINUS:
          registers[to] = -a;
          break;
        case 11 satisfies typeof code.NOT:
          if (a - a !== 0) return false;
          registers[to] = a === 0 ? 1 : 0;
          break;
        case 12 satisfies typeof code.TRUTH:
          if (a - a !== 0) return false;
          registers[to] = a === 0 ? 0 : 1;
          break;
        case 13 satisfies typeof code.ABS:
          registers[to] = Math.abs(a);
          break;
        case 14 satisfies typeof code.ATAN2:
          if (a - a + (b - b) !== 0) return false;
          registers[to] = atan2(a, b);
          break;
        case 15 satisfies typeof code.CEIL:
          registers[to] = -Math.floor(-a);
          break;
        case 16 satisfies typeof code.COS:
          registers[to] = cosine(a);
          break;
        case 17 satisfies typeof code.FLOOR:
          registers[to] = Math.floor(a);
          break;
        case 18 satisfies typeof code.MAX:
          if (a - a + (b - b) !== 0) return false;
          registers[to] = a > b ? a : b;
          break;
        case 19 satisfies typeof code.MIN:
          if (a - a + (b - b) !== 0) return false;
          registers[to] = a < b ? a : b;
          break;
        case 20 satisfies typeof code.MOD:
          registers[to] = a - b * Math.floor(a / b);
          break;
        case 21 satisfies typeof code.NOISE:
          registers[to] = fractal(seed, a, b, 1);
          break;
        case 22 satisfies typeof code.POWER:
          if (a - a !== 0 || !isWhole(b)) return false;
          registers[to] = power(a, b);
          break;
        case 23 satisfies typeof code.ROUND:
          registers[to] = Math.floor(a + 0.5);
          break;
        case 24 satisfies typeof code.SIN:
          registers[to] = sine(a);
          break;
        case 25 satisfies typeof code.SQRT:
          registers[to] = Math.sqrt(a);
          break;
        case 26 satisfies typeof code.RANDOM: {
          const sites = words[at] as number;
          registers[to] = random(scope.path, words, at + 1, sites);
          at += 1 + sites;
          break;
        }
        case 27 satisfies typeof code.RANDOM_BETWEEN: {
          const sites = words[at] as number;
          registers[to] = a + (b - a) * random(scope.path, words, at + 1, sites);
          at += 1 + sites;
          break;
        }
        case 28 satisfies typeof code.CLAMP: {
          const c = registers[words[at] as number] as number;
          if (a - a + (b - b) + (c - c) !== 0) return false;
          registers[to] = a < b ? b : a > c ? c : a;
          at += 1;
          break;
        }
        case 29 satisfies typeof code.MIX:
          registers[to] = a + (b - a) * (registers[words[at] as number] as number);
          at += 1;
          break;
        case 30 satisfies typeof code.FRACTAL: {
          const octaves = Math.floor(registers[words[at] as number] as number);
          registers[to] = fractal(seed, a, b, octaves);
          this.steps += octaves;
          at += 1;
          break;
        }
        case 31 satisfies typeof code.ITEM: {
          const slot = words[at] as number;
          const list = left === code.AMONG_LOCALS ? listed(stack, scope.base + slot) : listed(file, slot);
          const count = words[at + 1] as number;
          registers[to] = itemOf(list, registers, words, at + 2, count);
          at += 2 + count;
          break;
        }
        case 32 satisfies typeof code.COUNT: {
          const slot = words[at] as number;
          const list = left === code.AMONG_LOCALS ? listed(stack, scope.base + slot) : listed(file, slot);
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
          if (a - a !== 0) return false;
          at = a === 0 ? (words[at] as number) : at + 1;
          break;
      }
    }
  }
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
