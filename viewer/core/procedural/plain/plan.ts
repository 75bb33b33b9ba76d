/**
 * Which statements make no choice? Solids, what moves and paints them, and rules that do nothing else: in a loop all that its
 * turns do is known beforehand, and becomes a list of solids with words that compute their numbers for several turns side by
 * side. What is the same in all turns is computed once. As `plan` in `crates/scene/src/procedural/evaluator/straight`.
 */
import { FARTHEST, HEIGHT, LEAST_SCALE, MAX_COUNT, MAX_LENGTH, MOVE, RANGES, type Range } from "../ranges.ts";
import { Faces } from "../solid/flat.ts";
import type { SolidKind } from "../solid/kinds.ts";
import type { Globals } from "../stack.ts";
import type { At, Expr, Module, Row, Statement } from "../syntax.ts";
import { FRAME } from "../turtles.ts";
import * as code from "./code.ts";
import { fill, WIDTH } from "./columns.ts";
import { Compiler, isThere, MOST_STEPS, NOT_PLAIN, NotPlain, OVERHEAD, outermost, type Reach } from "./compiler.ts";
import { Extents } from "./extents.ts";

/** Longest axes with which a turtle may turn: as it turns, none gets beyond {@link FARTHEST}. */
export const LONGEST = 1e8;
/** Calls inside each other. */
const MOST_CALLS = 16;
/** Columns of registers take more room than registers. */
const MOST_REGISTERS = 2048;

// When something is computed: once for each file, once for all turns, or in each of them.
const ONCE = 0;
const FOR_ALL = 1;
const IN_TURN = 2;
type When = typeof ONCE | typeof FOR_ALL | typeof IN_TURN;

/** Words, and registers of one number that is then put into all of their column. */
export interface Prelude {
  readonly words: Int32Array;
  readonly spread: Int32Array;
}

/** Where a turtle is: registers at which three axes and an origin begin, three each. */
export interface Pose {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly origin: number;
  /** Which of the paints; −1 for that of the turtle outside. */
  readonly paint: number;
}

/** A solid with the registers of its numbers, or those of its points when it has faces. */
export interface Planned {
  readonly at: At;
  readonly solid: SolidKind;
  /** Where its faces are said. */
  readonly list: Row | undefined;
  readonly pose: Pose;
  readonly numbers: Int32Array;
  readonly faces: Faces | undefined;
}

/** A call that is visited, turn by turn, when the numbers of all turns are computed: the last thing that a turn does. */
export interface Tail {
  readonly call: number;
  readonly pose: Pose;
  /** Registers of its arguments. */
  readonly given: Int32Array;
  /** How many nodes it lies in. */
  readonly nesting: number;
}

/** What turns do. */
export interface Plan {
  readonly once: Prelude;
  readonly forAll: Prelude;
  readonly words: Int32Array;
  /** A column for each register. */
  readonly columns: Float64Array;
  /** Pairs of a slot, or of a rule whose level is asked for, and a register. */
  readonly globals: Int32Array;
  readonly locals: Int32Array;
  readonly levels: Int32Array;
  /** Registers of what a turn is given, and of what all turns are. */
  readonly turn: number;
  readonly all: number;
  /** The first of those of the turtle. */
  readonly frame: number;
  readonly solids: readonly Planned[];
  readonly tail: Tail | undefined;
  /** Calls of materials. */
  readonly paints: readonly number[];
  /** What is computed, if that is not solids. */
  readonly result: number;
  /** What a turn takes, but for octaves. */
  readonly cost: Readonly<code.Cost>;
  /** Whose globals were put in last, whether what is computed of them is sound, and which materials its paints are. */
  file: Globals | undefined;
  isSound: boolean;
  materials: number[] | undefined;
}

/** The plan of what a loop does, which gives its number to a slot; `null` when it makes a choice. */
export function planOf(module: Module, slot: number, body: Statement): Plan | null {
  return (
    made(module, (planner) => planner.loop(slot, body, undefined)) ??
    made(module, (planner) => planner.loop(slot, body, lastOf(body)))
  );
}

/** The call with which a statement ends. */
function lastOf(statement: Statement | undefined): Statement {
  switch (statement?.kind) {
    case "group":
      return lastOf(statement.of.at(-1));
    case "place":
    case "paint":
      return lastOf(statement.body);
    case "call":
      return statement;
    default:
      throw NOT_PLAIN;
  }
}

/** The same of heights over x and z, at several x. */
export function fieldOf(module: Module, slots: readonly [number, number], height: Row): Plan | null {
  return made(module, (planner) => planner.field(slots, height));
}

type Kind<K extends Statement["kind"]> = Extract<Statement, { kind: K }>;

function made(module: Module, make: (planner: Planner) => Plan): Plan | null {
  if (module.room < MOST_STEPS) return null;
  const planner = new Planner(module);
  try {
    const plan = make(planner);
    const taken = OVERHEAD + plan.words.length + 2 * plan.columns.length;
    if (taken > module.room) return null;
    module.room -= taken;
    return plan;
  } catch (error) {
    if (error instanceof NotPlain) return null;
    throw error;
  } finally {
    // What was looked at in vain counts too, so that rules that many loops call are not looked at without end.
    module.room -= planner.visited;
  }
}

class Planner extends Compiler {
  /** When each register has its number. */
  private readonly whens: When[] = [ONCE, FOR_ALL];
  private readonly preludes: readonly [number[], number[]] = [[], []];
  /** What numbers of registers must be; looked at when all of them are known. */
  private readonly wanted: [register: number, min: number, max: number][] = [];
  private readonly extents = new Extents();
  /** Registers that turns ask for. */
  private readonly asked = new Set<number>();
  private readonly levels: [rule: number, to: number][] = [];
  private readonly solids: Planned[] = [];
  private readonly paints: number[] = [];
  private last: Statement | undefined;
  private tail: Tail | undefined;
  /** What a turn takes depends on its numbers. */
  private varies = false;

  /** Turns that do nothing else, or nothing before their last call. */
  loop(slot: number, body: Statement, last: Statement | undefined): Plan {
    const reach = outermost();
    const turn = this.registersFor(1, IN_TURN);
    reach.given[slot] = turn;
    this.extents.set(turn, 0, MAX_COUNT);
    const x = this.registersFor(FRAME, FOR_ALL);
    const pose = { x, y: x + 3, z: x + 6, origin: x + 9, paint: -1 };
    this.last = last;
    this.statement(body, pose, 1, reach);
    if (last && (this.solids.length > 0 || this.varies)) throw NOT_PLAIN;
    return this.plan(turn, 0, x, 0);
  }

  field([x, z]: readonly [number, number], height: Row): Plan {
    const reach = outermost();
    const turn = this.registersFor(1, IN_TURN);
    const all = this.registersFor(1, FOR_ALL);
    reach.given[x] = turn;
    reach.given[z] = all;
    const [result] = this.ranged(height, HEIGHT, 0, reach) as [number];
    this.ask(result);
    return this.plan(turn, all, 0, result);
  }

  private plan(turn: number, all: number, frame: number, result: number): Plan {
    this.look();
    const columns = new Float64Array(WIDTH * this.registers);
    for (const [number, to] of this.constants) fill(columns, WIDTH * to, number, WIDTH);
    const ended = (words: number[]) => Int32Array.from([...words, ...code.wordsOf(code.END, 0, 0, 0)]);
    const constants = new Set(this.constants.map(([, to]) => to));
    const spread = (when: When) =>
      Int32Array.from([...this.asked].filter((register) => this.whens[register] === when && !constants.has(register)));
    return {
      once: { words: ended(this.preludes[0]), spread: spread(ONCE) },
      forAll: { words: ended(this.preludes[1]), spread: spread(FOR_ALL) },
      words: ended(this.words),
      columns,
      globals: Int32Array.from(this.globals.flat()),
      locals: Int32Array.from(this.locals.flat()),
      levels: Int32Array.from(this.levels.flat()),
      turn,
      all,
      frame,
      solids: this.solids,
      tail: this.tail,
      paints: this.paints,
      result,
      cost: this.cost,
      file: undefined,
      isSound: false,
      materials: undefined,
    };
  }

  protected override register(): number {
    if (this.registers === MOST_REGISTERS) throw NOT_PLAIN;
    this.whens[this.registers] = ONCE;
    this.registers += 1;
    return this.registers - 1;
  }

  /** The first of so many registers. */
  private registersFor(count: number, when: When): number {
    const first = this.registers;
    for (let i = 0; i < count; i += 1) this.whens[this.register()] = when;
    return first;
  }

  private ask(...registers: readonly number[]): void {
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
  private must(word: number, register: number, ...than: readonly number[]): void {
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

  private within(register: number, min: number, max: number): void {
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

  /** Registers of a row of numbers, each within a range of its own. */
  private ranged({ of }: Row, ranges: readonly Range[], nesting: number, reach: Reach): number[] {
    return of.map((expr, i) => {
      const register = this.number(expr, nesting, reach);
      const { min, max } = ranges[i] as Range;
      this.within(register, min, max);
      return register;
    });
  }

  /** The register of a value that is kept: a number. */
  private kept(expr: Expr, as: Row["as"], nesting: number, reach: Reach): number {
    const register = as === "numbers" ? this.number(expr, nesting, reach) : this.value(expr, nesting, reach);
    if (!isThere(expr, reach) || expr.kind === "local") this.checked(register);
    return register;
  }

  private statement(statement: Statement, pose: Pose, nesting: number, reach: Reach): void {
    this.take(nesting);
    switch (statement.kind) {
      case "group":
        for (const inner of statement.of) this.statement(inner, pose, nesting + 1, reach);
        return;
      case "let": {
        const { of, as } = statement.value;
        reach.given[statement.slot] = this.kept(of[0] as Expr, as, nesting, reach);
        return;
      }
      case "place":
        this.statement(statement.body, this.placed(statement, pose, nesting, reach), nesting + 1, reach);
        return;
      case "paint": {
        const call = this.module.calls[statement.call];
        if (!call || call.alias !== undefined || this.module.materials[call.index]?.slots !== 0) throw NOT_PLAIN;
        const paint = this.paints.push(statement.call) - 1;
        this.statement(statement.body, { ...pose, paint }, nesting + 1, reach);
        return;
      }
      case "call":
        if (statement === this.last) this.end(statement.call, pose, nesting, reach);
        else this.rule(statement.call, pose, nesting, reach);
        return;
      case "solid":
        this.solid(statement, pose, nesting, reach);
        return;
      default:
        throw NOT_PLAIN;
    }
  }

  private placed({ transform, by }: Kind<"place">, pose: Pose, nesting: number, reach: Reach): Pose {
    const numbers = this.ranged(by, MOVE, nesting, reach);
    const [x, y = x, z = x] = numbers as [number, number?, number?];
    switch (transform) {
      case "move": {
        const from = [pose.x, pose.y, pose.z, pose.origin];
        const origin = this.moved3(code.MOVED, 3, from, [x, y, z]);
        this.near(origin, 3, FARTHEST);
        return { ...pose, origin };
      }
      case "turn": {
        const swung = this.moved3(code.SWUNG, 6, [pose.z, pose.x], [x]);
        return { ...pose, z: swung, x: swung + 3 };
      }
      case "tilt": {
        const swung = this.moved3(code.SWUNG, 6, [pose.y, pose.z], [x]);
        return { ...pose, y: swung, z: swung + 3 };
      }
      case "roll": {
        const swung = this.moved3(code.SWUNG, 6, [pose.x, pose.y], [x]);
        return { ...pose, x: swung, y: swung + 3 };
      }
      case "scale": {
        for (const factor of numbers) this.must(code.APART, factor, this.constant(LEAST_SCALE, undefined));
        const axis = (of: number, factor: number) => {
          const to = this.moved3(code.STRETCHED, 3, [of], [factor]);
          this.near(to, 3, LONGEST);
          return to;
        };
        return { ...pose, x: axis(pose.x, x), y: axis(pose.y, y), z: axis(pose.z, z) };
      }
    }
  }

  /** What becomes of axes and origins, three registers each, by some numbers. */
  private moved3(word: number, count: number, of: readonly number[], by: readonly number[]): number {
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

  private near(first: number, count: number, most: number): void {
    for (let register = first; register < first + count; register += 1) this.within(register, -most, most);
  }

  private rule(index: number, pose: Pose, nesting: number, outer: Reach): void {
    const call = this.module.calls[index];
    const rule = this.module.rules[call?.index ?? -1];
    if (!call || call.alias !== undefined || !rule || rule.isPart || rule.levels) throw NOT_PLAIN;
    if (outer.calls === MOST_CALLS) throw NOT_PLAIN;
    const calls = outer.calls + 1;
    this.cost.levels = Math.max(this.cost.levels, calls);
    const given: (number | undefined)[] = [];
    const sites = [...outer.sites, call.site];
    // Its level is known when its parameters are.
    const early: Reach = { given, hasStack: false, level: undefined, sites, functions: [], calls };
    for (const [i, slot] of call.slots.entries()) {
      given[slot] = this.kept(call.row.of[i] as Expr, "values", nesting, outer);
    }
    for (const slot of call.missing) {
      const initial = rule.formals[slot]?.initial as Row;
      const { of, as } = initial;
      given[slot] = this.kept(of[0] as Expr, as, nesting, early);
    }
    this.statement(rule.body, pose, nesting + 1, { ...early, level: () => this.levelOf(call.index) });
  }

  /** Ends in a call of this file that is not looked into. */
  private end(index: number, pose: Pose, nesting: number, reach: Reach): void {
    const call = this.module.calls[index];
    if (!call || call.alias !== undefined || call.index < 0) throw NOT_PLAIN;
    const given = call.row.of.map((expr) => this.kept(expr, "values", nesting, reach));
    this.ask(...given);
    this.askFor(pose);
    this.tail = { call: index, pose, given: Int32Array.from(given), nesting };
  }

  private askFor({ x, y, z, origin }: Pose): void {
    for (const axis of [x, y, z, origin]) this.ask(axis, axis + 1, axis + 2);
  }

  /** The register of how many calls of a rule are open. */
  private levelOf(index: number): number {
    const known = this.levels.find(([rule]) => rule === index);
    if (known) return known[1];
    const register = this.registersFor(1, FOR_ALL);
    this.levels.push([index, register]);
    return register;
  }

  private solid(statement: Kind<"solid">, pose: Pose, nesting: number, reach: Reach): void {
    const { at, solid, lists, numbers: row } = statement;
    let numbers: number[];
    let faces: Faces | undefined;
    const list = lists[1];
    if (solid === "mesh") {
      const lengths: number[] = [];
      numbers = this.items((lists[0] as Row).of[0] as Expr, nesting, lengths).map((expr) => {
        const register = this.value(expr, nesting + 2, reach);
        this.within(register, -MAX_LENGTH, MAX_LENGTH);
        return register;
      });
      if (lengths.some((length) => length !== 3)) throw NOT_PLAIN;
      faces = this.faces(list as Row, lengths.length, nesting);
    } else if (solid === "box" || solid === "cone" || solid === "cylinder" || solid === "sphere") {
      numbers = this.ranged(row, RANGES[solid], nesting, reach);
    } else {
      throw NOT_PLAIN;
    }
    this.ask(...numbers);
    this.askFor(pose);
    this.solids.push({ at, solid, list, pose, numbers: Int32Array.from(numbers), faces });
  }

  /** Faces that are written out, between so many points. */
  private faces({ of }: Row, points: number, nesting: number): Faces {
    const lengths: number[] = [];
    const corners = this.items(of[0] as Expr, nesting, lengths).map((expr) => {
      this.take(nesting + 3);
      if (expr.kind !== "number" || !(expr.value >= 0 && expr.value < points)) throw NOT_PLAIN;
      return expr.value;
    });
    const faces = new Faces();
    let next = 0;
    for (const length of lengths) {
      for (const end = next + length; next < end; next += 1) faces.add(corners[next] as number);
      faces.end();
    }
    if (!faces.areSound) throw NOT_PLAIN;
    this.cost.steps += faces.looks;
    return faces;
  }
}
