/**
 * What are the values of a row of expressions, computed at one go? It is known what that takes, so limits are asked once
 * for all of it. As `crates/scene/src/procedural/evaluator/plain.rs`.
 */
import { type Amounts, MAX_HELD, MAX_LIST } from "../limits.ts";
import type { Program } from "../link.ts";
import { type Code, RESULTS } from "../plain/code.ts";
import { codeOf } from "../plain/compiler.ts";
import { Machine, type Scope } from "../plain/machine.ts";
import type { Plan } from "../plain/plan.ts";
import { Turns } from "../plain/turns.ts";
import type { Row } from "../syntax.ts";
import { type Boxes, State } from "./state.ts";

/** What is computed at one go holds less than this, one list at a time. */
const ROOM = 2 * MAX_LIST;

export class Plain extends State {
  private readonly machine: Machine;
  private readonly turns: Turns;

  constructor(program: Program, seed: number, detail: number, limits: Readonly<Amounts>, boxes: Boxes) {
    super(program, seed, detail, limits, boxes);
    this.machine = new Machine(seed, detail);
    this.turns = new Turns(this.machine, detail);
  }

  /** A number of the row that was computed last. */
  protected taken(index: number): number {
    return this.machine.registers[RESULTS + index] as number;
  }

  /** Numbers that were computed node by node, in place of results. */
  protected give(...numbers: readonly number[]): void {
    this.machine.put(numbers);
  }

  /** The same with those of one turn of a plan. */
  protected giveTurn({ columns }: Plan, registers: Int32Array, turn: number): void {
    this.machine.putTurn(columns, registers, turn);
  }

  /** Whether a row was computed, within limits; {@link paid} when it will do, else its nodes are to be visited. */
  protected computes(scope: Scope, row: Row): boolean {
    const code = row.code === undefined ? this.codeFor(scope, row) : row.code;
    if (code === null || !this.machine.run(code, scope, this.stack, this.globals(scope))) return false;
    return this.isWithinLimits(scope);
  }

  /** The same of a code or a turn whose results are known. */
  protected affords(scope: Scope, code: Pick<Code, "cost">): boolean {
    this.machine.skip(code, 1);
    return this.isWithinLimits(scope);
  }

  /** Whether all is computed that so many turns have in common. */
  protected prepared(plan: Plan, scope: Scope, most: number): boolean {
    return this.turns.prepare(plan, scope, this.stack, this.globals(scope), most);
  }

  /** The paths of turns that are computed next. */
  protected get paths(): Int32Array {
    return this.turns.paths;
  }

  /** Whether so many turns were computed, and could be paid. */
  protected computedTurns(plan: Plan, scope: Scope, count: number): boolean {
    return this.computesTurns(plan, scope, count) && this.isWithinLimits(scope) && this.paid(scope);
  }

  /** Whether they were computed. */
  protected computesTurns(plan: Plan, scope: Scope, count: number): boolean {
    return this.turns.run(plan, scope, this.stack, this.globals(scope), count);
  }

  private isWithinLimits({ depth }: Scope): boolean {
    const { limits, machine } = this;
    return (
      this.stack.held <= MAX_HELD - ROOM &&
      this.usage.steps + machine.steps <= limits.steps &&
      this.nesting + machine.nesting <= limits.nesting &&
      depth + machine.levels <= limits.levels
    );
  }

  /** Counts what the row that was computed last has taken. */
  protected paid(scope: Scope): true {
    const { machine, usage } = this;
    usage.steps += machine.steps;
    const nesting = this.nesting + machine.nesting;
    if (nesting > usage.nesting) usage.nesting = nesting;
    const levels = scope.depth + machine.levels;
    if (levels > usage.levels) usage.levels = levels;
    return true;
  }

  protected codeFor(scope: Scope, row: Row): Code | null {
    if (row.code === undefined) row.code = codeOf(this.module(scope.module), row);
    return row.code;
  }
}
