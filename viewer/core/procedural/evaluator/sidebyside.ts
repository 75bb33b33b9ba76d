/**
 * What do several turns of a loop do at one go? Statements that make no choice are visited once for all of them: each row of
 * expressions is computed for all turns side by side, and what is drawn waits until it is known that nothing is amiss. Else
 * nothing has been done, and the turns are visited one by one, which says what and where. As `straight` in
 * `crates/scene/src/procedural/evaluator`; it does not matter for what grows, what it takes and what is said of mistakes.
 */
import { type Frame, WIDTH } from "../plain/columns.ts";
import type { Scope } from "../plain/machine.ts";
import { isWithin, type Pose, poseOf, transformed, turtleOf } from "../poses.ts";
import type { Faces } from "../solid/flat.ts";
import type { Row, Statement } from "../syntax.ts";
import { FARTHEST, LEAST_SCALE, MOVE } from "../turtles.ts";
import { Calls } from "./calls.ts";
import { isConstant, MAX_LENGTH } from "./outlines.ts";
import type { Turtle } from "./state.ts";
import { RANGES, type Simple } from "./terminals.ts";

/** Fewer turns are visited one by one. */
const LEAST_TURNS = 3;
/** Most nodes of a turn, and calls inside each other. */
const MOST_NODES = 1024;
const MOST_CALLS = 16;

type Kind<K extends Statement["kind"]> = Extract<Statement, { kind: K }>;

/** A solid that waits. */
interface Drawn {
  readonly scope: Scope;
  readonly statement: Kind<"solid">;
  readonly pose: Pose;
  /** Where its numbers begin among the columns, or those of its points when it has faces. */
  readonly numbers: number;
  readonly count: number;
  readonly faces: Faces | undefined;
}

export abstract class SideBySide extends Calls {
  private readonly waiting: Drawn[] = [];
  /** Statements that make a choice, or with which something was amiss. */
  private readonly choosing = new Set<Statement>();
  /** Whether what was amiss may be well the next time. */
  private isEarly = false;
  /** Nodes of a turn so far. */
  private nodes = 0;

  /** Visits the turns of a loop that counts; before which one that ended. */
  protected turnsAtOnce(
    scope: Scope,
    turtle: Turtle,
    { slots, body }: Kind<"for">,
    path: number,
    count: number,
  ): number {
    if (slots.length !== 1 || count < LEAST_TURNS || this.choosing.has(body)) return 0;
    if (!this.turtles.isWithin(turtle, FARTHEST)) return 0;
    const { columns } = this;
    for (let first = 0; first < count; first += WIDTH) {
      this.beginTurns(Math.min(WIDTH, count - first));
      const number = columns.open(1);
      for (let i = 0; i < columns.count; i += 1) columns.numbers[number + i] = first + i;
      const frame: Frame = { scope, path: columns.pathsOfTurns(path, first), columns: [], hasStack: true };
      frame.columns[slots[0] as number] = number;
      if (!this.prepares(frame, turtle, body) || !this.paysForTurns()) return first;
      this.drawWaiting(turtle);
    }
    return count;
  }

  /** Whether all that a statement draws waits now. */
  private prepares(frame: Frame, turtle: Turtle, body: Statement): boolean {
    this.waiting.length = 0;
    this.nodes = 0;
    this.isEarly = false;
    if (this.visitTurns(frame, poseOf(this.columns, this.turtles, turtle), body, 1, 0)) return true;
    if (!this.isEarly) this.choosing.add(body);
    return false;
  }

  /** Draws it, turn by turn; a mesh that is alone in all of them. */
  private drawWaiting(turtle: Turtle): void {
    const { waiting } = this;
    const { count } = this.columns;
    for (let turn = 0; turn < count; ) {
      let next = turn + 1;
      for (const drawn of waiting) next = this.drawTurns(turtle, drawn, turn, waiting.length === 1 ? count : turn + 1);
      turn = next;
    }
  }

  /** Draws a solid in turns from one on; before which one that ended. */
  private drawTurns(turtle: Turtle, drawn: Drawn, turn: number, end: number): number {
    const { scope, statement, pose, numbers, count, faces } = drawn;
    const { at, solid, lists } = statement;
    if (faces) {
      const next = this.addSheaf(pose, numbers, count / 3, faces, turn, end);
      if (next > turn) return next;
    }
    const placed = turtleOf(this.columns, pose, turn, this.turtles, turtle);
    if (faces) {
      this.takeTurn(numbers, count, turn);
      this.addMesh(scope, at, placed, lists[1] as Row, count / 3, faces);
    } else {
      this.giveTurn(numbers, count, turn);
      this.add(scope, at, placed, solid as Simple);
    }
    return turn + 1;
  }

  /** As `visit`, so many nodes and calls deep; whether that was possible. */
  private visitTurns(frame: Frame, pose: Pose, statement: Statement, nesting: number, calls: number): boolean {
    this.owe(this.columns.count, nesting, 0);
    this.nodes += 1;
    if (this.nodes > MOST_NODES) return false;
    switch (statement.kind) {
      case "group":
        return statement.of.every((inner) => this.visitTurns(frame, pose, inner, nesting + 1, calls));
      case "let":
        if (!this.computedForTurns(frame, statement.value, nesting)) return false;
        frame.columns[statement.slot] = this.keptColumns(0, 1);
        return true;
      case "place": {
        const placed = this.placedForTurns(frame, pose, statement, nesting);
        return placed !== undefined && this.visitTurns(frame, placed, statement.body, nesting + 1, calls);
      }
      case "paint": {
        const material = this.knownSurface(frame.scope, statement.call);
        this.isEarly = material === "not yet";
        if (typeof material !== "number") return false;
        return this.visitTurns(frame, { ...pose, material }, statement.body, nesting + 1, calls);
      }
      case "call":
        return calls < MOST_CALLS && this.followsForTurns(frame, pose, statement.call, nesting, calls + 1);
      case "solid":
        return this.waits(frame, pose, statement, nesting);
      default:
        return false;
    }
  }

  private placedForTurns(frame: Frame, pose: Pose, statement: Kind<"place">, nesting: number): Pose | undefined {
    const { transform, by } = statement;
    if (!this.rangedForTurns(frame, by, MOVE, nesting)) return undefined;
    const { columns } = this;
    const isOne = by.of.length === 1;
    const x = this.keptColumns(0, by.of.length);
    const y = isOne ? x : x + WIDTH;
    const z = isOne ? x : y + WIDTH;
    if (transform === "scale" && !columns.areApart(x, by.of.length, LEAST_SCALE)) return undefined;
    const placed = transformed(columns, pose, transform, x, y, z);
    return isWithin(columns, placed, pose, FARTHEST) ? placed : undefined;
  }

  private followsForTurns(outer: Frame, pose: Pose, index: number, nesting: number, calls: number): boolean {
    const call = this.called(outer.scope, index);
    const rule = this.module(call.module).rules[call.index];
    if (call.alias !== undefined || !rule || rule.isPart || rule.levels) return false;
    const scope: Scope = { ...outer.scope, depth: outer.scope.depth + 1, level: 0 };
    this.owe(0, 0, scope.depth);
    const inner: Frame = { scope, path: this.columns.pathsBehind(outer.path, call.site), columns: [], hasStack: false };
    if (call.slots.length > 0 && !this.computedForTurns(outer, call.row, nesting)) return false;
    for (const [i, slot] of call.slots.entries()) inner.columns[slot] = this.keptColumns(i, 1);
    for (const slot of call.missing) {
      if (!this.computedForTurns(inner, rule.formals[slot]?.initial as Row, nesting)) return false;
      inner.columns[slot] = this.keptColumns(0, 1);
    }
    scope.level = this.openCallsOf(call.module, call.index);
    return this.visitTurns(inner, pose, rule.body, nesting + 1, calls);
  }

  /** Whether a solid waits now. */
  private waits(frame: Frame, pose: Pose, statement: Kind<"solid">, nesting: number): boolean {
    const { solid, lists, numbers } = statement;
    const { scope } = frame;
    if (solid === "mesh") {
      const points = this.computedForTurns(frame, lists[0] as Row, nesting);
      if (points?.width !== 3) return false;
      const first = this.keptColumns(0, points.results);
      if (!this.columns.areWithin(first, points.results, MAX_LENGTH)) return false;
      const faces = this.facesForTurns(scope, lists[1] as Row, points.lengths.length, nesting);
      if (!faces) return false;
      this.waiting.push({ scope, statement, pose, numbers: first, count: points.results, faces });
      return true;
    }
    if (solid !== "box" && solid !== "cone" && solid !== "cylinder" && solid !== "sphere") return false;
    if (!this.rangedForTurns(frame, numbers, RANGES[solid], nesting)) return false;
    const count = numbers.of.length;
    this.waiting.push({ scope, statement, pose, numbers: this.keptColumns(0, count), count, faces: undefined });
    return true;
  }

  /** Faces that are written out, between so many points. */
  private facesForTurns(scope: Scope, row: Row, points: number, nesting: number): Faces | undefined {
    const code = this.codeFor(scope, row);
    this.isEarly = code !== null && isConstant(code) && !code.faces;
    if (!code?.faces?.areSound || code.faces.last >= points) return undefined;
    const { count } = this.columns;
    this.owe(count * (code.cost.steps + code.faces.looks), nesting + code.cost.nesting, scope.depth + code.cost.levels);
    return code.faces;
  }
}
