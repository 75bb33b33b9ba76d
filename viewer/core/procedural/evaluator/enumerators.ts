/**
 * How often, and where? Enumerators visit their statement once for each member of a population. Each visit has a path of
 * its own, so that each member has random numbers of its own. As `crates/scene/src/procedural/evaluator/enumerate.rs`.
 */
import type { Affine } from "../affine.ts";
import type { Scope } from "../plain/machine.ts";
import { fraction, step } from "../random.ts";
import { MAX_COUNT, type Range } from "../ranges.ts";
import { outline } from "../solid/polygon.ts";
import type { At, Statement } from "../syntax.ts";
import { listedOf, type Value } from "../value.ts";
import { SideBySide } from "./sidebyside.ts";
import { type Turtle, withPath } from "./state.ts";

/** Largest extent of one, metres. */
const MAX_EXTENT = 1e6;
/** The plastic number's inverse and its square: steps of the most even sequence in the plane (Roberts 2018). */
const EVEN_STEPS = [0.7548776662466927, 0.5698402909980532] as const;

const SCATTER: readonly Range[] = [
  { what: "a count", min: 0, max: MAX_COUNT },
  { what: "a width", min: 0, max: MAX_EXTENT },
  { what: "a depth", min: 0, max: MAX_EXTENT },
];

type Kind<K extends Statement["kind"]> = Extract<Statement, { kind: K }>;

export abstract class Enumerators extends SideBySide {
  /** `for`: over numbers from 0, or over the items of a list. */
  protected repeat(scope: Scope, turtle: Turtle, statement: Kind<"for">): void {
    const { site, slots, over, body } = statement;
    const path = step(scope.path, site);
    const inner = withPath(scope, path);
    const at = over.places[0] as At;
    const value = this.single(scope, over);
    const isCount = typeof value === "number";
    this.hold(scope.module, at, listedOf(value));
    const count = isCount ? Math.floor(this.within(scope, at, value, "a count", 0, MAX_COUNT)) : value.items.length;
    this.foresee(scope, count, body);
    const done = isCount ? this.turnsAtOnce(scope, turtle, statement, path, count) : 0;
    for (let i = done; i < count; i += 1) {
      this.assignAll(scope, at, slots, isCount ? i : (value.items[i] as Value));
      inner.path = step(path, i);
      this.visit(inner, turtle, body);
    }
    this.release(listedOf(value));
  }

  /** One name takes a value as it is, several take the items of a list. */
  private assignAll(scope: Scope, at: At, slots: readonly number[], value: Value): void {
    if (slots.length === 1) {
      this.put(scope.module, at, scope.base + (slots[0] as number), value);
      return;
    }
    if (typeof value === "number" || value.items.length !== slots.length) {
      const wanted = "a list of lists with an item for each name";
      throw this.unfit(scope.module, at, "what `for` goes over", wanted);
    }
    for (let i = 0; i < slots.length; i += 1) {
      this.put(scope.module, at, scope.base + (slots[i] as number), value.items[i] as Value);
    }
  }

  /** `scatter`: evenly over a rectangle around the origin, beginning anywhere. */
  protected scatter(scope: Scope, turtle: Turtle, { site, slots, over, body }: Kind<"scatter">): void {
    const path = step(scope.path, site);
    const inner = withPath(scope, path);
    this.rangedRow(scope, over, SCATTER);
    const members = Math.floor(this.taken(0));
    const extents = [this.taken(1), this.taken(2)] as const;
    const start = [fraction(step(path, 0)), fraction(step(path, 1))] as const;
    this.foresee(scope, members, body);
    for (let i = 0; i < members; i += 1) {
      for (const axis of [0, 1] as const) {
        const along = start[axis] + i * EVEN_STEPS[axis];
        this.assign(scope, slots[axis], extents[axis] * (along - Math.floor(along) - 0.5));
      }
      inner.path = step(path, 2 + i);
      this.visit(inner, turtle, body);
    }
  }

  /** `edges`: along each edge of a polygon, with x along the edge and z outwards. */
  protected followEdges(scope: Scope, turtle: Turtle, { site, slots, polygon, body }: Kind<"edges">): void {
    const path = step(scope.path, site);
    const inner = withPath(scope, path);
    const count = this.takePolygon(scope, polygon);
    outline(this.points, count);
    // What is drawn along the edges takes points of its own.
    const corners = this.points.slice(0, 2 * count);
    for (let i = 0; i < count; i += 1) {
      const next = (i + 1) % count;
      const [x, z] = [corners[2 * i] as number, corners[2 * i + 1] as number];
      const dx = (corners[2 * next] as number) - x;
      const dz = (corners[2 * next + 1] as number) - z;
      const length = Math.sqrt(dx * dx + dz * dz);
      if (length === 0) continue;
      const ux = dx / length;
      const uz = dz / length;
      const edge: Affine = { x: [ux, 0, uz], y: [0, 1, 0], z: [-uz, 0, ux], origin: [x, 0, z] };
      this.assign(scope, slots[0] as number, length);
      if (slots.length > 1) this.assign(scope, slots[1] as number, i);
      inner.path = step(path, i);
      this.visit(inner, this.turtles.after(turtle, edge), body);
    }
  }
}
