/**
 * Which statements make no choice? Solids, what moves and paints them, and rules that do nothing else: in a loop they become a
 * plan. As `plan` in `crates/scene/src/procedural/evaluator/straight`.
 */
import { FARTHEST, HEIGHT, LEAST_SCALE, LONGEST, MAX_COUNT, MAX_LENGTH, MOVE, RANGES, type Range } from "../ranges.ts";
import { Faces } from "../solid/flat.ts";
import { type Expr, type Module, notGiven, type Row, type Statement } from "../syntax.ts";
import { FRAME } from "../turtles.ts";
import * as code from "./code.ts";
import { isThere, MOST_STEPS, NOT_PLAIN, outermost, type Reach, within } from "./compiler.ts";
import type { Plan, Planned, Pose, Tail } from "./plan.ts";
import { FOR_ALL, IN_TURN, StagedCompiler } from "./staged.ts";

/** Calls inside each other. */
const MOST_CALLS = 16;

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
  const plan = within(
    module,
    () => make(planner),
    ({ columns }) => columns,
  );
  // What was looked at in vain counts too, so that rules that many loops call are not looked at without end.
  module.room -= planner.visited;
  return plan;
}

class Planner extends StagedCompiler {
  private readonly levels: [rule: number, to: number][] = [];
  private readonly solids: Planned[] = [];
  private readonly paints: number[] = [];
  /** The call with which turns end, and what becomes of it. */
  private last: Statement | undefined;
  private tail: Tail | undefined;

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
    const { solids, tail, paints } = this;
    const levels = Int32Array.from(this.levels.flat());
    const unknown = { file: undefined, isSound: false, materials: undefined };
    return { ...this.compiled(), levels, turn, all, frame, solids, tail, paints, result, ...unknown };
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
        const origin = this.posed(code.MOVED, 3, from, [x, y, z]);
        this.near(origin, 3, FARTHEST);
        return { ...pose, origin };
      }
      case "turn": {
        const swung = this.posed(code.SWUNG, 6, [pose.z, pose.x], [x]);
        return { ...pose, z: swung, x: swung + 3 };
      }
      case "tilt": {
        const swung = this.posed(code.SWUNG, 6, [pose.y, pose.z], [x]);
        return { ...pose, y: swung, z: swung + 3 };
      }
      case "roll": {
        const swung = this.posed(code.SWUNG, 6, [pose.x, pose.y], [x]);
        return { ...pose, x: swung, y: swung + 3 };
      }
      case "scale": {
        for (const factor of numbers) this.must(code.APART, factor, this.constant(LEAST_SCALE, undefined));
        const axis = (of: number, factor: number) => {
          const to = this.posed(code.STRETCHED, 3, [of], [factor]);
          this.near(to, 3, LONGEST);
          return to;
        };
        return { ...pose, x: axis(pose.x, x), y: axis(pose.y, y), z: axis(pose.z, z) };
      }
    }
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
    for (const slot of notGiven(call, rule.formals)) {
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
