/**
 * What grows out of the rules? A traversal of the graph, depth first and from left to right (Schmalstieg 1997, §8.3), as
 * `crates/scene/src/procedural/evaluator` does it: the same steps, the same counts, the same bits.
 */
import { type Affine, after, moved, scaled, turned, type Vector } from "../affine.ts";
import type { Grown, Part } from "../grown.ts";
import { type Amounts, FINEST, LIMITS } from "../limits.ts";
import type { Program } from "../link.ts";
import { fraction, step } from "../random.ts";
import { type Corner, outline } from "../solid/polygon.ts";
import type { At, Expr, Statement, Transform } from "../syntax.ts";
import type { Value } from "../value.ts";
import { Calls } from "./calls.ts";
import { type Scope, type Turtle, withPath } from "./state.ts";

/** What can be chosen besides the text. */
export interface Settings {
  /** Where random numbers come from: 32 bits. */
  readonly seed?: number;
  /** Level of detail, from 0 (coarsest) to {@link FINEST}. */
  readonly detail?: number;
  /** Values for parameters of the first file. */
  readonly parameters?: ReadonlyMap<string, Value>;
  /** What may be taken; what is not said is as by default. */
  readonly limits?: Readonly<Partial<Amounts>>;
}

/** Farthest move and largest scale, so that a model stays within reach of numbers. */
const MAX_LENGTH = 1e9;
/** Smallest scale, either way. */
const MIN_SCALE = 1e-6;
/** Most members of one population. */
const MAX_COUNT = 1_048_576;
/** Largest extent of one, metres. */
const MAX_EXTENT = 1e6;
/** The plastic number's inverse and its square: steps of the most even sequence in the plane (Roberts 2018). */
const EVEN_STEPS = [0.7548776662466927, 0.5698402909980532] as const;

/** Grows a model: all its triangles. Throws a `DcgError`. */
export function grow(program: Program, settings: Settings = {}): Grown {
  const limits = { ...LIMITS, ...settings.limits };
  const detail = Math.min(settings.detail ?? FINEST, FINEST);
  return new Evaluator(program, (settings.seed ?? 0) | 0, detail, limits).grow(settings.parameters ?? new Map());
}

type Kind<K extends Statement["kind"]> = Extract<Statement, { kind: K }>;

class Evaluator extends Calls {
  grow(parameters: ReadonlyMap<string, Value>): Grown {
    this.growModel(parameters);
    return { parts: this.parts, materials: this.materials, usage: this.usage };
  }

  protected override visit(scope: Scope, turtle: Turtle, statement: Statement): void {
    this.descend(scope, this.placeOf(scope, statement));
    this.act(scope, turtle, statement);
    this.ascend();
  }

  private act(scope: Scope, turtle: Turtle, statement: Statement): void {
    switch (statement.kind) {
      case "group":
        for (const inner of statement.of) this.visit(scope, turtle, inner);
        return;
      case "let":
        this.assign(scope, statement.slot, this.value(scope, statement.at, statement.value));
        return;
      case "if": {
        const { yes, no } = statement;
        const chosen = this.condition(scope, statement.at, statement.condition) ? yes : no;
        if (chosen) this.visit(scope, turtle, chosen);
        return;
      }
      case "choose": {
        const number = Math.floor(this.number(scope, statement.at, statement.number, "what is chosen by"));
        const chosen = statement.of[Math.max(0, Math.min(number, statement.of.length - 1))];
        if (chosen) this.visit(scope, turtle, chosen);
        return;
      }
      case "place": {
        const frame = this.placed(scope, turtle.frame, statement);
        this.visit(scope, { frame, material: turtle.material }, statement.body);
        return;
      }
      case "paint":
        this.visit(scope, { ...turtle, material: this.surface(scope, statement.call) }, statement.body);
        return;
      case "called":
        this.visitCalled(scope, turtle, statement.name, statement.body);
        return;
      case "call":
        this.follow(scope, turtle, statement.call);
        return;
      case "solid":
        this.add(scope, statement.at, turtle, this.solid(scope, statement.at, statement.solid, statement.args));
        return;
      case "viewpoint":
        this.countPlacements(scope, 0, 1);
        this.keepName(scope.module, statement.name);
        (this.parts[this.part] as Part).viewpoints.push({ name: statement.name, frame: turtle.frame });
        return;
      case "impostor":
        (this.parts[this.part] as Part).impostor = this.impostor(scope, statement.at, statement.args);
        return;
      case "model":
        this.countPlacements(scope, 0, 1);
        this.keepName(scope.module, statement.path);
        (this.parts[this.part] as Part).models.push({ path: statement.path, frame: turtle.frame });
        return;
      case "for":
        this.repeat(scope, turtle, statement);
        return;
      case "scatter":
        this.scatter(scope, turtle, statement);
        return;
      case "edges":
        this.followEdges(scope, turtle, statement);
        return;
      case "heights":
        this.add(scope, statement.at, turtle, this.heights(scope, statement));
        return;
    }
  }

  private placed(scope: Scope, frame: Affine, { at, transform, by }: Kind<"place">): Affine {
    const numbers = by.map((expr) => this.ranged(scope, at, expr, "a transform", -MAX_LENGTH, MAX_LENGTH));
    const placed = this.transformed(scope, at, frame, transform, numbers);
    if (isWithin(placed.x) && isWithin(placed.y) && isWithin(placed.z) && isWithin(placed.origin)) return placed;
    const what = "the place to which this leads";
    throw this.error(scope.module, at, `${what} is not a finite number here; keep its operands within range`);
  }

  private transformed(scope: Scope, at: At, frame: Affine, transform: Transform, by: readonly number[]): Affine {
    const [x = 0, y = 0, z = 0] = by;
    switch (transform) {
      case "move":
        return moved(frame, [x, y, z]);
      case "turn":
        return turned(frame, "y", x);
      case "tilt":
        return turned(frame, "x", x);
      case "roll":
        return turned(frame, "z", x);
      case "scale": {
        const factors: Vector = by.length === 1 ? [x, x, x] : [x, y, z];
        if (factors.some((factor) => Math.abs(factor) < MIN_SCALE)) {
          throw this.error(scope.module, at, "a scale must be 0.000001 or more, or as much below 0");
        }
        return scaled(frame, factors);
      }
    }
  }

  /** `for`: over numbers from 0, or over the items of a list. */
  private repeat(scope: Scope, turtle: Turtle, { at, site, slots, over, body }: Kind<"for">): void {
    const path = step(scope.path, site);
    const value = this.value(scope, at, over);
    const isCount = typeof value === "number";
    const count = isCount ? Math.floor(this.within(scope, at, value, "a count", 0, MAX_COUNT)) : value.items.length;
    for (let i = 0; i < count; i += 1) {
      this.assignAll(scope, at, slots, isCount ? i : (value.items[i] as Value));
      this.visit(withPath(scope, step(path, i)), turtle, body);
    }
  }

  /** One name takes a value as it is, several take the items of a list. */
  private assignAll(scope: Scope, at: At, slots: readonly number[], value: Value): void {
    if (slots.length === 1) {
      this.assign(scope, slots[0] as number, value);
      return;
    }
    if (typeof value === "number" || value.items.length !== slots.length) {
      const wanted = "a list of lists with an item for each name";
      throw this.error(scope.module, at, `what \`for\` goes over must be ${wanted}`);
    }
    slots.forEach((slot, i) => {
      this.assign(scope, slot, value.items[i] as Value);
    });
  }

  /** `scatter`: evenly over a rectangle around the origin, beginning anywhere. */
  private scatter(scope: Scope, turtle: Turtle, { at, site, slots, count, over, body }: Kind<"scatter">): void {
    const path = step(scope.path, site);
    const members = Math.floor(this.ranged(scope, at, count, "a count", 0, MAX_COUNT));
    const extents = [
      this.ranged(scope, at, over[0], "a width", 0, MAX_EXTENT),
      this.ranged(scope, at, over[1], "a depth", 0, MAX_EXTENT),
    ];
    const start = [fraction(step(path, 0)), fraction(step(path, 1))];
    for (let i = 0; i < members; i += 1) {
      for (const axis of [0, 1] as const) {
        const along = (start[axis] as number) + i * EVEN_STEPS[axis];
        this.assign(scope, slots[axis], (extents[axis] as number) * (along - Math.floor(along) - 0.5));
      }
      this.visit(withPath(scope, step(path, 2 + i)), turtle, body);
    }
  }

  /** `edges`: along each edge of a polygon, with x along the edge and z outwards. */
  private followEdges(scope: Scope, turtle: Turtle, { at, site, slots, polygon, body }: Kind<"edges">): void {
    const path = step(scope.path, site);
    const corners = outline(this.corners(scope, at, this.value(scope, at, polygon as Expr), 3));
    corners.forEach(([x, z], i) => {
      const [toX, toZ] = corners[(i + 1) % corners.length] as Corner;
      const dx = toX - x;
      const dz = toZ - z;
      const length = Math.sqrt(dx * dx + dz * dz);
      if (length === 0) return;
      const ux = dx / length;
      const uz = dz / length;
      const edge: Affine = { x: [ux, 0, uz], y: [0, 1, 0], z: [-uz, 0, ux], origin: [x, 0, z] };
      [length, i].slice(0, slots.length).forEach((value, k) => {
        this.assign(scope, slots[k] as number, value);
      });
      this.visit(withPath(scope, step(path, i)), { ...turtle, frame: after(turtle.frame, edge) }, body);
    });
  }

  /** Where a node stands in the text, to say that something ended there. */
  private placeOf(scope: Scope, statement: Statement): At {
    switch (statement.kind) {
      case "call":
      case "paint":
        return this.module(scope.module).calls[statement.call]?.at ?? 0;
      case "called":
        return this.placeOf(scope, statement.body);
      case "group":
        return statement.of[0] ? this.placeOf(scope, statement.of[0]) : 0;
      case "viewpoint":
      case "model":
        return 0;
      default:
        return statement.at;
    }
  }
}

/** Whether numbers are still told apart so far out. */
function isWithin([x, y, z]: Vector): boolean {
  return Math.abs(x) <= MAX_LENGTH && Math.abs(y) <= MAX_LENGTH && Math.abs(z) <= MAX_LENGTH;
}
