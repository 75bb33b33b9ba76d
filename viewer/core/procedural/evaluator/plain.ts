/**
 * What are the values of a row of expressions, computed at one go? It is known what that takes, so limits are asked once
 * for all of it. As `crates/scene/src/procedural/evaluator/plain.rs`.
 */
import type { Amounts } from "../limits.ts";
import type { Program } from "../link.ts";
import { type Code, RESULTS } from "../plain/code.ts";
import { Columns, type Frame, WIDTH } from "../plain/columns.ts";
import { codeOf } from "../plain/compiler.ts";
import { Machine, type Scope } from "../plain/machine.ts";
import type { Row } from "../syntax.ts";
import { State } from "./state.ts";

export class Plain extends State {
  /** What differs from turn to turn, where turns of a loop are computed side by side. */
  protected readonly columns = new Columns();
  private readonly machine: Machine;
  private readonly due = { steps: 0, nesting: 0, levels: 0 };

  constructor(program: Program, seed: number, detail: number, limits: Readonly<Amounts>) {
    super(program, seed, detail, limits);
    this.machine = new Machine(seed, detail);
  }

  /** A number of the row that was computed last. */
  protected taken(index: number): number {
    return this.machine.registers[RESULTS + index] as number;
  }

  /** The same of one of several turns. */
  protected takenInTurn(index: number, turn: number): number {
    return this.machine.registers[(RESULTS + index) * WIDTH + turn] as number;
  }

  /** Numbers that were computed node by node, in place of results. */
  protected give(...numbers: readonly number[]): void {
    this.machine.put(numbers);
  }

  /** The same with those of one turn, in so many columns. */
  protected giveTurn(first: number, count: number, turn: number): void {
    this.machine.putTurn(this.columns.numbers, first + turn, count);
  }

  /** Whether a row was computed, within limits; {@link paid} when it will do, else its nodes are to be visited. */
  protected computes(scope: Scope, row: Row): boolean {
    const code = row.code === undefined ? this.codeFor(scope, row) : row.code;
    if (code === null || !this.machine.run(code, scope, this.stack, this.globals(scope))) return false;
    return this.isWithinLimits(scope);
  }

  /** The same of a code whose results are known. */
  protected affords(scope: Scope, code: Code): boolean {
    this.machine.skip(code, 1);
    return this.isWithinLimits(scope);
  }

  /** So many turns are computed side by side from now on. */
  protected beginTurns(count: number): void {
    this.columns.begin(count);
    this.due.steps = 0;
    this.due.nesting = 0;
    this.due.levels = 0;
  }

  /** The code that has computed a row for all turns, so many nodes deep; nothing when that is not possible. */
  protected computedForTurns(frame: Frame, row: Row, nesting: number): Code | undefined {
    const { scope } = frame;
    const code = row.code === undefined ? this.codeFor(scope, row) : row.code;
    if (!code?.isStraight) return undefined;
    const { machine, columns } = this;
    if (!code.columns && !this.hasRoomFor(scope, code)) return undefined;
    if (!machine.runTurns(code, frame, columns, this.stack, this.globals(scope))) return undefined;
    this.owe(machine.steps, nesting + machine.nesting, scope.depth + machine.levels);
    return code;
  }

  /** Keeps so many results of all turns; where their columns begin. */
  protected keptColumns(index: number, count: number): number {
    return this.columns.copied(this.machine.registers, (RESULTS + index) * WIDTH, count);
  }

  /** Counts what all turns together take, before it is known whether that can be paid. */
  protected owe(steps: number, nesting: number, levels: number): void {
    const { due } = this;
    due.steps += steps;
    if (nesting > due.nesting) due.nesting = nesting;
    if (levels > due.levels) due.levels = levels;
  }

  /** Counts what was owed, if it is within limits. */
  protected paysForTurns(): boolean {
    const { due, limits, usage } = this;
    const steps = usage.steps + due.steps;
    const nesting = this.nesting + due.nesting;
    if (steps > limits.steps || nesting > limits.nesting || due.levels > limits.levels) return false;
    usage.steps = steps;
    if (nesting > usage.nesting) usage.nesting = nesting;
    if (due.levels > usage.levels) usage.levels = due.levels;
    return true;
  }

  /** Whether there is room for columns of the registers of a code. */
  private hasRoomFor({ module }: Scope, { registers }: Code): boolean {
    const file = this.module(module);
    const taken = 2 * WIDTH * registers.length;
    if (taken > file.room) return false;
    file.room -= taken;
    return true;
  }

  private isWithinLimits({ depth }: Scope): boolean {
    const { limits, machine } = this;
    return (
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
