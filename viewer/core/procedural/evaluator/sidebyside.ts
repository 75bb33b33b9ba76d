/**
 * What do several turns of a loop do at one go? Statements that make no choice: their numbers are computed for all turns side
 * by side, and drawn when it is known that nothing is amiss. Else nothing has been done, and the turns are visited one by one,
 * which says what and where. As `straight` in `crates/scene/src/procedural/evaluator`; it does not matter for what grows, what
 * it takes and what is said of mistakes.
 */
import { WIDTH } from "../plain/columns.ts";
import type { Scope } from "../plain/machine.ts";
import type { Plan, Planned, Pose, Tail } from "../plain/plan.ts";
import { planOf } from "../plain/planner.ts";
import { step } from "../random.ts";
import { FARTHEST, LONGEST, type Simple } from "../ranges.ts";
import type { Row, Statement } from "../syntax.ts";
import { FRAME, SIZE } from "../turtles.ts";
import { Calls } from "./calls.ts";
import { type Turtle, withPath } from "./state.ts";

/** Fewer turns are visited one by one. */
const LEAST_TURNS = 3;

type For = Extract<Statement, { kind: "for" }>;

export abstract class SideBySide extends Calls {
  /** Loops in which something was amiss. */
  private readonly unsound = new Set<For>();

  /** Visits the turns of a loop that counts; before which one that ended. */
  protected turnsAtOnce(scope: Scope, turtle: Turtle, statement: For, path: number, count: number): number {
    const { slots, body } = statement;
    if (statement.plan === null || count < LEAST_TURNS || slots.length !== 1) return 0;
    statement.plan ??= planOf(this.module(scope.module), slots[0] as number, body);
    const { plan } = statement;
    if (!plan || this.unsound.has(statement) || !this.turtles.mayTurn(turtle, LONGEST, FARTHEST)) return 0;
    if (!this.starts(plan, scope, turtle, count)) return this.isUnsound(statement, 0);
    const materials = this.materialsOf(plan, scope);
    if (!materials) return 0;
    const { paths } = this;
    const { columns } = plan;
    for (let first = 0; first < count; first += WIDTH) {
      const turns = Math.min(WIDTH, count - first);
      for (let i = 0; i < turns; i += 1) {
        columns[plan.turn * WIDTH + i] = first + i;
        paths[i] = step(path, first + i);
      }
      if (plan.tail) {
        if (!this.computesTurns(plan, scope, turns)) return this.isUnsound(statement, first);
        const done = this.visitTails(plan, plan.tail, materials, scope, turtle, path, first, turns);
        // Calls may have come here again.
        if (done < first + turns || (done < count && !this.starts(plan, scope, turtle, count))) return done;
      } else {
        if (!this.computedTurns(plan, scope, turns)) return this.isUnsound(statement, first);
        this.drawTurns(plan, materials, scope, turtle, turns);
      }
    }
    return count;
  }

  private isUnsound(statement: For, turn: number): number {
    this.unsound.add(statement);
    return turn;
  }

  /** Gives a plan where the turtle is, and how many calls of rules are open; whether all is well that turns have in common. */
  private starts(plan: Plan, scope: Scope, turtle: Turtle, count: number): boolean {
    const { columns, frame, levels } = plan;
    const { numbers } = this.turtles;
    for (let i = 0; i < FRAME; i += 1) columns[(frame + i) * WIDTH] = numbers[turtle + i] as number;
    for (let i = 0; i < levels.length; i += 2) {
      columns[(levels[i + 1] as number) * WIDTH] = this.openCallsOf(scope.module, levels[i] as number);
    }
    return this.prepared(plan, scope, count);
  }

  /** The materials of a plan that is prepared, when all have been computed before. */
  private materialsOf(plan: Plan, scope: Scope): readonly number[] | undefined {
    if (plan.materials) return plan.materials;
    const materials: number[] = [];
    for (const paint of plan.paints) {
      const material = this.knownSurface(scope, paint);
      if (material === undefined) return undefined;
      materials.push(material);
    }
    plan.materials = materials;
    return materials;
  }

  /** Visits the calls with which turns end, each when it is paid what is computed for it; before which one that ended. */
  private visitTails(
    plan: Plan,
    { call, pose, given, nesting }: Tail,
    materials: readonly number[],
    scope: Scope,
    turtle: Turtle,
    path: number,
    first: number,
    turns: number,
  ): number {
    const { stack } = this;
    const { columns } = plan;
    const material = this.materialOf(pose, materials, turtle);
    // The call may come here again: what is computed is kept before, the last turn lowest.
    const kept = stack.open(turns * given.length);
    for (let turn = turns - 1; turn >= 0; turn -= 1) {
      this.turtles.among(turtle, columns, pose, turn, material, turns - 1 - turn);
      for (let i = 0; i < given.length; i += 1) {
        stack.numbers[kept + turn * given.length + i] = columns[(given[i] as number) * WIDTH + turn] as number;
      }
    }
    const inner = withPath(scope, path);
    let turn = 0;
    for (; turn < turns && this.affords(scope, plan) && this.paid(scope); turn += 1) {
      inner.path = step(path, first + turn);
      this.nesting += nesting;
      this.followGiven(inner, turtle + (turns - turn) * SIZE, call, kept + turn * given.length);
      this.nesting -= nesting;
    }
    stack.close(kept);
    return first + turn;
  }

  private materialOf({ paint }: Pose, materials: readonly number[], turtle: Turtle): number {
    return paint < 0 ? this.turtles.material(turtle) : (materials[paint] as number);
  }

  /** Draws what so many turns do, turn by turn; a solid that is alone in all of them. */
  private drawTurns(plan: Plan, materials: readonly number[], scope: Scope, turtle: Turtle, count: number): void {
    const isAlone = plan.solids.length === 1;
    for (let turn = 0; turn < count; ) {
      let next = turn + 1;
      for (const planned of plan.solids) {
        const material = this.materialOf(planned.pose, materials, turtle);
        const end = this.addSheaf(plan, planned, material, turn, isAlone ? count : turn + 1);
        if (end === turn) this.drawTurn(plan, planned, material, scope, turtle, turn);
        else next = end;
      }
      turn = next;
    }
  }

  /** Draws a solid of one turn. */
  private drawTurn(
    plan: Plan,
    { at, solid, list, pose, numbers, faces }: Planned,
    material: number,
    scope: Scope,
    turtle: Turtle,
    turn: number,
  ): void {
    const placed = this.turtles.among(turtle, plan.columns, pose, turn, material);
    if (faces) {
      this.takeTurn(plan, numbers, turn);
      this.addMesh(scope, at, placed, list as Row, numbers.length / 3, faces);
    } else {
      this.giveTurn(plan, numbers, turn);
      this.add(scope, at, placed, solid as Simple);
    }
  }
}
