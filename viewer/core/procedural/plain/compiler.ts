/**
 * Which code computes a row of expressions at one go? Most of what rules compute is numbers made of numbers; functions are
 * written out where they are called. As `made_plain` in `crates/scene/src/procedural/evaluator/plain.rs`.
 */
import { MAX_OCTAVES } from "../operation.ts";
import { type Expr, type FunctionRule, type Module, notGiven, type Row, type Written } from "../syntax.ts";
import * as code from "./code.ts";

/** Thrown at what cannot be computed at one go. */
export class NotPlain extends Error {}

export const NOT_PLAIN = new NotPlain();

/** Most that one code visits, and how deep: functions that call each other twice would make it long, and deep. */
export const MOST_STEPS = 4096;
const MOST_NESTING = 128;

/** What a code takes besides its words and registers, about, in words. */
const OVERHEAD = 64;

/** The code of a row of a module; `null` when it is to be visited node by node. */
export function codeOf(module: Module, row: Row): code.Code | null {
  return within(
    module,
    () => new Compiler(module).row(row),
    ({ registers }) => registers,
  );
}

/** What is made, where a module has room for it; `null` when nodes are to be visited one by one. */
export function within<M extends { readonly words: Int32Array }>(
  module: Module,
  make: () => M,
  numbersOf: (made: M) => Float64Array,
): M | null {
  try {
    const made = make();
    const taken = OVERHEAD + made.words.length + 2 * numbersOf(made).length;
    if (taken > module.room) return null;
    module.room -= taken;
    return made;
  } catch (error) {
    if (error instanceof NotPlain) return null;
    throw error;
  }
}

/** What is in reach where an expression stands. */
export interface Reach {
  /** Registers of values by their slots: what a loop or a call gives. */
  readonly given: (number | undefined)[];
  /** Whether other values lie on the stack. */
  readonly hasStack: boolean;
  /** The register of the level; a function has none. */
  readonly level: (() => number) | undefined;
  /** Words that calls have added to the path. */
  readonly sites: readonly number[];
  /** Functions that are being written out, and how many rules around them. */
  readonly functions: readonly FunctionRule[];
  readonly calls: number;
}

/** Where the visit of a statement of a rule begins. */
export function outermost(): Reach {
  return { given: [], hasStack: true, level: () => code.LEVEL, sites: [], functions: [], calls: 0 };
}

type Kind<K extends Expr["kind"]> = Extract<Expr, { kind: K }>;

export class Compiler {
  protected readonly words: number[] = [];
  protected readonly constants: [value: number, to: number][] = [];
  /** Registers of what was computed, by how. */
  protected readonly known = new Map<string, number>();
  protected readonly globals: [slot: number, to: number][] = [];
  protected readonly locals: [slot: number, to: number][] = [];
  protected registers = code.RESULTS;
  visited = 0;
  /** Branches around what is being made. */
  private forks = 0;
  protected cost: code.Cost = { steps: 0, nesting: 0, levels: 0 };

  constructor(protected readonly module: Module) {}

  row({ of, as }: Row): code.Code {
    const { cost } = this;
    const reach = outermost();
    const lengths: number[] = [];
    const wanted = as === "rows" ? this.items(of[0] as Expr, 0, lengths) : of;
    this.registers += wanted.length;
    if (this.registers > code.MOST_REGISTERS) throw NOT_PLAIN;
    wanted.forEach((expr, i) => {
      const to = code.RESULTS + i;
      if (as === "numbers") this.number(expr, 0, reach, to);
      else this.value(expr, as === "rows" ? 2 : 0, reach, to);
    });
    this.emit(...code.wordsOf(code.END, 0, 0, 0));
    const registers = new Float64Array(this.registers);
    for (const [value, to] of this.constants) registers[to] = value;
    return {
      words: Int32Array.from(this.words),
      results: wanted.length,
      lengths,
      width: lengths.every((length) => length === lengths[0]) ? (lengths[0] ?? 0) : 0,
      registers,
      globals: Int32Array.from(this.globals.flat()),
      locals: Int32Array.from(this.locals.flat()),
      file: undefined,
      cost,
      faces: undefined,
    };
  }

  /** All numbers of a list of lists that is written out. */
  protected items(list: Expr, nesting: number, lengths: number[]): readonly Expr[] {
    if (list.kind !== "list") throw NOT_PLAIN;
    this.take(nesting + 1);
    return list.items.flatMap((row) => {
      if (row.kind !== "list") throw NOT_PLAIN;
      this.take(nesting + 2);
      lengths.push(row.items.length);
      return row.items;
    });
  }

  /** A node so deep inside of others. */
  protected take(nesting: number): void {
    this.cost.steps += 1;
    this.cost.nesting = Math.max(this.cost.nesting, nesting);
    this.visited += 1;
    if (this.visited > MOST_STEPS || nesting > MOST_NESTING) throw NOT_PLAIN;
  }

  protected register(): number {
    if (this.registers === code.MOST_REGISTERS) throw NOT_PLAIN;
    this.registers += 1;
    return this.registers - 1;
  }

  private emit(...words: readonly number[]): void {
    this.words.push(...words);
    if (this.words.length > code.MOST_WORDS) throw NOT_PLAIN;
  }

  /** Code for a number, where one is wanted; the register in which it lies, `to` when that is given. */
  protected number(expr: Expr, nesting: number, reach: Reach, to?: number): number {
    return expr.kind === "number" || expr.kind === "local"
      ? this.computed(expr, nesting, reach, to)
      : this.value(expr, nesting, reach, to);
  }

  /** The same where any value is wanted: that visits numbers and locals too. */
  protected value(expr: Expr, nesting: number, reach: Reach, to?: number): number {
    this.take(nesting + 1);
    return this.computed(expr, nesting + 1, reach, to);
  }

  private computed(expr: Expr, nesting: number, reach: Reach, to?: number): number {
    const number = (of: Expr) => this.number(of, nesting, reach);
    switch (expr.kind) {
      case "number":
        return this.constant(expr.value, to);
      case "local":
        return this.local(expr.slot, reach, to);
      case "global":
        return this.loaded(this.globals, this.slotOf(expr), to);
      case "detail":
        return this.moved(code.DETAIL, to);
      case "level":
        return reach.level ? this.moved(reach.level(), to) : this.constant(0, to);
      case "minus":
        // −0 is a number of its own among the constants.
        if (expr.of.kind === "number") return this.constant(-expr.of.value, to);
        return this.made(code.MINUS, to, number(expr.of), 0);
      case "not":
        return this.made(code.NOT, to, number(expr.of), 0);
      case "binary": {
        const [left, right] = [number(expr.left), number(expr.right)];
        // What is not finite would not show.
        if (expr.operator === "/" && expr.right.kind !== "number") this.checked(right);
        const isTurned = expr.operator === ">" || expr.operator === ">=";
        return this.made(code.OPERATORS[expr.operator], to, isTurned ? right : left, isTurned ? left : right);
      }
      case "and":
      case "or":
      case "if":
        return this.branches(expr, nesting, reach, to ?? this.register());
      case "item":
        return this.item(expr, nesting, reach, to);
      case "builtin":
        return this.builtIn(expr, nesting, reach, to);
      case "call":
        return this.call(expr.call, nesting, reach, to);
      default:
        throw NOT_PLAIN;
    }
  }

  protected made(word: number, to: number | undefined, a: number, b: number, ...more: readonly number[]): number {
    const key = [word, a, b, ...more].join();
    const known = this.known.get(key);
    if (known !== undefined) return this.moved(known, to);
    const result = to ?? this.register();
    this.emit(...code.wordsOf(word, result, a, b), ...more);
    // What is computed only sometimes is not there at other times; octaves are counted when they are computed.
    if (this.forks === 0 && word !== code.MOVE && word !== code.FRACTAL) this.known.set(key, result);
    return result;
  }

  private moved(from: number, to: number | undefined): number {
    return to === undefined ? from : this.made(code.MOVE, to, from, 0);
  }

  protected constant(value: number, to: number | undefined): number {
    return this.loaded(this.constants, value, to);
  }

  /** A register to which a value is copied before: the result's own, unless that has other values in other branches. */
  private loaded(pairs: [of: number, to: number][], slot: number, to: number | undefined): number {
    if (to !== undefined && this.forks > 0) return this.moved(this.loaded(pairs, slot, undefined), to);
    const known = to === undefined ? pairs.find(([of]) => Object.is(of, slot)) : undefined;
    if (known) return known[1];
    const register = to ?? this.register();
    pairs.push([slot, register]);
    return register;
  }

  protected local(slot: number, { given, hasStack }: Reach, to: number | undefined): number {
    const register = given[slot];
    if (register !== undefined) return this.moved(register, to);
    if (!hasStack) throw NOT_PLAIN;
    return this.loaded(this.locals, slot, to);
  }

  private slotOf({ use }: Kind<"global">): number {
    return this.module.uses[use]?.slot ?? 0;
  }

  /** What is computed only sometimes; what that takes is counted on the way. */
  protected branches(expr: Kind<"and" | "or" | "if">, nesting: number, reach: Reach, to: number): number {
    if (expr.kind === "if") {
      const condition = this.number(expr.condition, nesting, reach);
      this.fork(
        condition,
        () => this.value(expr.yes, nesting, reach, to),
        () => this.value(expr.no, nesting, reach, to),
      );
      return to;
    }
    const left = this.number(expr.left, nesting, reach);
    const right = () => this.made(code.TRUTH, to, this.number(expr.right, nesting, reach), 0);
    if (expr.kind === "and") this.fork(left, right, () => this.made(code.MOVE, to, this.constant(0, undefined), 0));
    else this.fork(left, () => this.made(code.MOVE, to, this.constant(1, undefined), 0), right);
    return to;
  }

  /** One or the other. */
  private fork(condition: number, yes: () => void, no: () => void): void {
    this.emit(...code.wordsOf(code.JUMP_IF_NOT, 0, condition, 0), 0);
    const otherwise = this.words.length - 1;
    this.counted(yes);
    this.emit(...code.wordsOf(code.JUMP, 0, 0, 0), 0);
    const end = this.words.length - 1;
    this.words[otherwise] = this.words.length;
    this.counted(no);
    this.words[end] = this.words.length;
  }

  /** Code that says what it takes. */
  private counted(make: () => void): void {
    const outer = this.cost;
    this.forks += 1;
    this.cost = { steps: 0, nesting: 0, levels: 0 };
    this.emit(...code.wordsOf(code.COST, 0, 0, 0), 0, 0, 0);
    const at = this.words.length - 3;
    make();
    this.forks -= 1;
    const { steps, nesting, levels } = this.cost;
    this.words.splice(at, 3, steps, nesting, levels);
    this.cost = outer;
  }

  /** An item of a list of the rule or of the file, or of a list in it. */
  private item(expr: Kind<"item">, nesting: number, reach: Reach, to: number | undefined): number {
    const levels: [index: Expr, nesting: number][] = [];
    let of: Expr = expr;
    let inner = nesting;
    for (; of.kind === "item"; of = of.of) {
      levels.unshift([of.index, inner]);
      inner += 1;
      this.take(inner);
    }
    const [where, slot] = this.listed(of, reach);
    const numbers = levels.map(([index, nesting]) => this.number(index, nesting, reach));
    return this.made(code.ITEM, to, where, 0, slot, numbers.length, ...numbers);
  }

  protected listed(of: Expr, { hasStack }: Reach): readonly [where: number, slot: number] {
    if (of.kind === "global") return [code.AMONG_GLOBALS, this.slotOf(of)];
    // Arguments of functions lie in registers, and lists cannot.
    if (of.kind !== "local" || !hasStack) throw NOT_PLAIN;
    return [code.AMONG_LOCALS, of.slot];
  }

  private builtIn(expr: Kind<"builtin">, nesting: number, reach: Reach, to: number | undefined): number {
    const { name, args, site } = expr;
    if (name === "count") {
      this.take(nesting + 1);
      const [where, slot] = this.listed((args[0] as Written).of, reach);
      return this.made(code.COUNT, to, where, 0, slot);
    }
    const take = name === "mix" ? this.value : this.number;
    const [a = 0, b = 0] = args.slice(0, 2).map(({ of }) => take.call(this, of, nesting, reach));
    const third = args[2] && this.number(args[2].of, nesting, reach);
    const sites = [...reach.sites, site];
    if (name === "random") {
      return args.length === 0
        ? this.made(code.RANDOM, to, 0, 0, sites.length, ...sites)
        : this.made(code.RANDOM_BETWEEN, to, a, b, sites.length, ...sites);
    }
    if (third !== undefined) {
      if (name === "mix") this.cost.steps += 1;
      if (name === "clamp") {
        for (const [i, register] of [a, b, third].entries()) if (args[i]?.of.kind !== "number") this.checked(register);
      }
      const octaves = args[2]?.of.kind === "number" ? Math.floor(args[2].of.value) : 0;
      if (name === "fractal" && octaves >= 1 && octaves <= MAX_OCTAVES) {
        this.cost.steps += octaves;
        return this.made(code.NOISE, to, a, b, octaves);
      }
      const word = name === "clamp" ? code.CLAMP : name === "mix" ? code.MIX : code.FRACTAL;
      return this.made(word, to, a, b, third);
    }
    if (name === "noise") {
      this.cost.steps += 1;
      return this.made(code.NOISE, to, a, b, 1);
    }
    // By squaring that is the same, and what is not finite shows.
    if (name === "power" && args[1]?.of.kind === "number" && args[1].of.value === 2) {
      return this.made(code.MULTIPLY, to, a, a);
    }
    return this.made(code.FUNCTIONS[name] as number, to, a, b);
  }

  /** A function of the same file, written out here. */
  private call(index: number, nesting: number, reach: Reach, to: number | undefined): number {
    const call = this.module.calls[index];
    const rule = this.module.functions[call?.index ?? -1];
    if (!call || !rule || call.alias !== undefined || reach.functions.includes(rule)) throw NOT_PLAIN;
    const functions = [...reach.functions, rule];
    this.cost.levels = Math.max(this.cost.levels, reach.calls + functions.length);
    const given: number[] = [];
    const missing = notGiven(call, rule.formals);
    const defaults = missing.map((slot) => rule.formals[slot]?.initial?.of[0] as Expr);
    // What is amiss with an argument must not be lost with it.
    const give = (slot: number, expr: Expr, reach: Reach) => {
      const register = this.value(expr, nesting, reach);
      given[slot] = register;
      if (!isThere(expr, reach) && ![rule.value.of, ...defaults].some((of) => shows(of, slot))) this.checked(register);
    };
    call.slots.forEach((slot, i) => {
      give(slot, call.row.of[i] as Expr, reach);
    });
    const sites = [...reach.sites, call.site];
    const inner: Reach = { given, hasStack: false, level: undefined, sites, functions, calls: reach.calls };
    missing.forEach((slot, i) => {
      give(slot, defaults[i] as Expr, inner);
    });
    return this.value(rule.value.of, nesting, inner, to);
  }

  /** Code that gives up where a register holds no finite number. */
  protected checked(register: number): void {
    const key = `${code.CHECK},${register}`;
    if (this.known.has(key)) return;
    this.emit(...code.wordsOf(code.CHECK, 0, register, 0));
    if (this.forks === 0) this.known.set(key, register);
  }
}

/** Whether an expression is a finite number before anything is computed, or a list. */
export function isThere(expr: Expr, reach: Reach): boolean {
  if (expr.kind === "minus") return expr.of.kind === "number";
  return (
    expr.kind === "number" ||
    expr.kind === "detail" ||
    expr.kind === "level" ||
    (expr.kind === "local" && reach.hasStack && reach.given[expr.slot] === undefined)
  );
}

/** Whether what is not finite in a slot shows in the value of an expression, or is noticed on the way, whatever it computes. */
function shows(of: Expr, slot: number): boolean {
  switch (of.kind) {
    case "local":
      return of.slot === slot;
    case "minus":
    case "not":
      return shows(of.of, slot);
    case "binary":
      return shows(of.left, slot) || shows(of.right, slot);
    case "and":
    case "or":
      return shows(of.left, slot);
    case "if":
      return shows(of.condition, slot) || (shows(of.yes, slot) && shows(of.no, slot));
    case "builtin":
      return of.args.some((argument) => shows(argument.of, slot));
    // Items are of lists; what calls are given is not looked at again.
    default:
      return false;
  }
}
