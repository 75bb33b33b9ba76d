/** Which solid do these values make? Values are checked here. As `crates/scene/src/procedural/evaluator/terminal.rs`. */
import { Reach } from "../bounds.ts";
import { Fault } from "../error.ts";
import type { Wish } from "../grown.ts";
import { MAX_CORNERS, MAX_STEPS, reached } from "../limits.ts";
import { copy, WIDTH } from "../plain/columns.ts";
import type { Scope } from "../plain/machine.ts";
import type { Plan, Planned } from "../plain/plan.ts";
import { fieldOf } from "../plain/planner.ts";
import { HEIGHT, MAX_LENGTH, RANGES, type Range, type Simple } from "../ranges.ts";
import { type Faces, looksAt, writeBox, writeHeights, writeMesh, writePrism } from "../solid/flat.ts";
import { SIDES } from "../solid/kinds.ts";
import { Mesh } from "../solid/mesh.ts";
import { outline } from "../solid/polygon.ts";
import { writeCone, writeLathe, writeSphere } from "../solid/round.ts";
import { areTriangles, writeSheaf } from "../solid/sheaf.ts";
import { Writer } from "../solid/writer.ts";
import type { At, Row, Statement } from "../syntax.ts";
import { Outlines } from "./outlines.ts";
import type { Turtle } from "./state.ts";

/** Shortest way of a round of steps. */
const LEAST_STRIDE = 1e-3;
/** As `Wish` in Rust. */
const [MOST_FRAMES, MOST_HEIGHT_PX] = [16, 4096];

const NO_PHASE =
  "`frames` needs a parameter `phase` of this part or file, by which it moves; give it one, such as `phase = 0`";

const WISH: readonly Range[] = [
  { what: "views", min: 2, max: 12 },
  { what: "size", min: -Infinity, max: Infinity },
  { what: "below", min: 0, max: 1 },
  { what: "frames", min: 1, max: MOST_FRAMES },
  { what: "stride", min: LEAST_STRIDE, max: MAX_LENGTH },
];

const FIELD: readonly Range[] = [
  { what: "a width", min: 1e-3, max: MAX_LENGTH },
  { what: "a depth", min: 1e-3, max: MAX_LENGTH },
  { what: "steps", min: 1, max: MAX_STEPS },
  { what: "steps", min: 1, max: MAX_STEPS },
];

type Kind<K extends Statement["kind"]> = Extract<Statement, { kind: K }>;

export abstract class Terminals extends Outlines {
  private readonly writer = new Writer();
  /** What the solid that is being made lies in, before it is placed. */
  private readonly extent = new Reach();

  /** Adds a solid to the part that is being made. */
  protected draw(scope: Scope, turtle: Turtle, { at, solid, lists, numbers }: Kind<"solid">): void {
    switch (solid) {
      case "box":
      case "cone":
      case "cylinder":
      case "sphere":
        this.rangedRow(scope, numbers, RANGES[solid]);
        this.add(scope, at, turtle, solid);
        return;
      case "lathe":
        this.addLathe(scope, at, turtle, lists[0] as Row, numbers);
        return;
      case "prism":
        this.addPrism(scope, at, turtle, lists[0] as Row, numbers);
        return;
      case "polygon": {
        const points = this.takePoints(scope, lists[0] as Row);
        this.drawMesh(scope, at, turtle, lists[0] as Row, points, this.wholeFace(points));
        return;
      }
      case "mesh": {
        const points = this.takePoints(scope, lists[0] as Row);
        this.drawMesh(scope, at, turtle, lists[1] as Row, points, this.facesOf(scope, lists[1] as Row, points));
        return;
      }
    }
  }

  /** Adds a solid that is nothing but numbers, which were computed last. */
  protected add(scope: Scope, at: At, turtle: Turtle, solid: Simple): void {
    switch (solid) {
      case "box":
        this.addBox(scope, at, turtle, this.taken(0), this.taken(1), this.taken(2));
        return;
      case "cone":
        this.addCone(scope, at, turtle, this.taken(1), 2);
        return;
      case "cylinder":
        this.addCone(scope, at, turtle, this.taken(0), 1);
        return;
      case "sphere":
        this.addSphere(scope, at, turtle, this.taken(0), this.sides(1));
        return;
    }
  }

  /** Sides of a round solid; by the level of detail when nobody says how many. */
  private sides(index: number): number {
    const given = Math.floor(this.taken(index));
    return given === 0 ? (SIDES[this.detail] as number) : Math.max(given, 3);
  }

  /** Whether there is anything to write of a solid of so many triangles at most; then the writer knows where to. */
  private begins(scope: Scope, at: At, turtle: Turtle, most: number): boolean {
    const { extent, limits, turtles, usage } = this;
    this.reach(this.part).placed(extent, turtles.numbers, turtle);
    if (most === 0) return false;
    if (usage.triangles + most > limits.triangles) {
      throw this.error(scope.module, at, reached("triangles", limits.triangles));
    }
    const material = turtles.material(turtle);
    this.writer.aim(meshOf(this.growing(this.part).meshes, material), turtles.numbers, turtle);
    return true;
  }

  /** Counts what was written. */
  private ends(): void {
    this.usage.triangles += this.writer.added;
  }

  private addBox(scope: Scope, at: At, turtle: Turtle, width: number, height: number, depth: number): void {
    this.extent.upright(width / 2, 0, height, depth / 2);
    if (!this.begins(scope, at, turtle, 12)) return;
    writeBox(this.writer, width, height, depth);
    this.ends();
  }

  /** Its height and what follows are the numbers from `rest` on. */
  private addCone(scope: Scope, at: At, turtle: Turtle, high: number, rest: number): void {
    const low = this.taken(0);
    const height = this.taken(rest);
    const sides = this.sides(rest + 1);
    const widest = Math.max(low, high);
    this.extent.upright(widest, 0, height, widest);
    if (!this.begins(scope, at, turtle, widest === 0 ? 0 : 4 * sides)) return;
    writeCone(this.writer, low, high, height, sides, this.taken(rest + 2) !== 0);
    this.ends();
  }

  private addSphere(scope: Scope, at: At, turtle: Turtle, radius: number, sides: number): void {
    this.extent.upright(radius, -radius, radius, radius);
    if (!this.begins(scope, at, turtle, radius === 0 ? 0 : sides * sides)) return;
    writeSphere(this.writer, radius, sides);
    this.ends();
  }

  private addLathe(scope: Scope, at: At, turtle: Turtle, list: Row, numbers: Row): void {
    const count = this.takeCorners(scope, list, 2);
    let [widest, low, high] = [0, Infinity, -Infinity];
    for (let i = 0; i < 2 * count; i += 2) {
      const [radius, y] = [this.points[i] as number, this.points[i + 1] as number];
      if (radius < 0) throw this.amount(scope.module, list.places[0] as At, "a radius of a profile", "0 or more");
      [widest, low, high] = [Math.max(widest, radius), Math.min(low, y), Math.max(high, y)];
    }
    // The other numbers may call functions, but those draw nothing: the points stay.
    this.rangedRow(scope, numbers, RANGES.lathe);
    const sides = this.sides(0);
    this.extent.upright(widest, low, high, widest);
    if (!this.begins(scope, at, turtle, widest === 0 ? 0 : 2 * count * sides)) return;
    writeLathe(this.writer, this.points, count, sides, this.taken(1) !== 0);
    this.ends();
  }

  private addPrism(scope: Scope, at: At, turtle: Turtle, list: Row, numbers: Row): void {
    const count = this.takeCorners(scope, list, 3);
    this.count(scope, at, looksAt(count));
    this.rangedRow(scope, numbers, RANGES.prism);
    const height = this.taken(0);
    this.extent.points(this.points, count, 2);
    this.extent.span(1, 0, height);
    if (!this.begins(scope, at, turtle, 4 * count)) return;
    outline(this.points, count);
    try {
      writePrism(this.writer, this.points, count, height);
    } catch (error) {
      throw this.located(scope, list, error);
    }
    this.ends();
  }

  /** Its polygons are said by `list`. */
  private drawMesh(scope: Scope, at: At, turtle: Turtle, list: Row, points: number, faces: Faces): void {
    if (!faces.areSound) this.refuseFaces(scope, at, list, faces);
    this.count(scope, at, faces.looks);
    this.addMesh(scope, at, turtle, list, points, faces);
  }

  /** Adds a mesh between so many points whose faces are sound and counted. */
  protected addMesh(scope: Scope, at: At, turtle: Turtle, list: Row, points: number, faces: Faces): void {
    this.extent.points(this.points, points, 3);
    if (!this.begins(scope, at, turtle, faces.length)) return;
    try {
      writeMesh(this.writer, this.points, points, faces);
    } catch (error) {
      throw this.located(scope, list, error);
    }
    this.ends();
  }

  /** Adds meshes that are sound in turns from one on, if there is room for all of them; before which one that ended. */
  protected addSheaf(plan: Plan, planned: Planned, material: number, turn: number, end: number): number {
    const { extent, limits, usage } = this;
    const { faces } = planned;
    if (!faces || !areTriangles(faces)) return turn;
    if (usage.triangles + (end - turn - 1) * faces.count + faces.length > limits.triangles) return turn;
    const mesh = meshOf(this.growing(this.part).meshes, material);
    const done = writeSheaf(mesh, this.reach(this.part), extent, plan.columns, planned, faces, turn, end);
    usage.triangles += (done - turn) * faces.count;
    return done;
  }

  /** Says what is wrong with the first face that is not sound, if counting those before comes so far. */
  private refuseFaces(scope: Scope, at: At, { places }: Row, { ends, count }: Faces): void {
    for (let face = 0; face < count; face += 1) {
      const corners = (ends[face] as number) - (face === 0 ? 0 : (ends[face - 1] as number));
      if (corners < 3 || corners > MAX_CORNERS) {
        throw this.amount(scope.module, places[0] as At, "a face", "three corners or more, up to 256");
      }
      this.count(scope, at, looksAt(corners));
    }
  }

  /** Where it is that a polygon cannot be filled. */
  private located(scope: Scope, { places }: Row, error: unknown): unknown {
    return error instanceof Fault ? this.error(scope.module, places[0] as At, error.problem) : error;
  }

  /** A sample for each grid point, and one more around them for the slopes at the border. */
  protected drawHeights(scope: Scope, turtle: Turtle, statement: Kind<"heights">): void {
    const { at, over } = statement;
    this.rangedRow(scope, over, FIELD);
    const size = [this.taken(0), this.taken(1)] as const;
    const steps = [Math.floor(this.taken(2)), Math.floor(this.taken(3))] as const;
    const limit = this.limits.triangles;
    if (this.usage.triangles + 2 * steps[0] * steps[1] > limit) {
      throw this.error(scope.module, at, reached("triangles", limit));
    }
    const row = steps[0] + 3;
    const heights = new Float64Array(row * (steps[1] + 3));
    const xs = Float64Array.from({ length: row }, (_, i) => size[0] * ((i - 1) / steps[0] - 0.5));
    for (let j = 0; j < steps[1] + 3; j += 1) {
      const z = size[1] * ((j - 1) / steps[1] - 0.5);
      const done = this.heightsAtOnce(scope, statement, xs, z, heights, j * row);
      for (let i = done; i < row; i += 1) {
        heights[j * row + i] = this.heightAt(scope, statement, xs[i] as number, z);
      }
    }
    let [low, high] = [Infinity, -Infinity];
    // Without the samples around the rectangle.
    for (let j = 1; j < steps[1] + 2; j += 1) {
      for (let i = j * row + 1; i < (j + 1) * row - 1; i += 1) {
        const y = heights[i] as number;
        if (y < low) low = y;
        if (y > high) high = y;
      }
    }
    this.extent.upright(size[0] / 2, low, high, size[1] / 2);
    if (!this.begins(scope, at, turtle, 2 * steps[0] * steps[1])) return;
    writeHeights(this.writer, size, steps, heights);
    this.ends();
  }

  private heightAt(scope: Scope, { slots, height }: Kind<"heights">, x: number, z: number): number {
    this.assign(scope, slots[0], x);
    this.assign(scope, slots[1], z);
    this.rangedRow(scope, height, HEIGHT);
    return this.taken(0);
  }

  /** Computes heights of a row side by side; before which one that ended. */
  private heightsAtOnce(
    scope: Scope,
    statement: Kind<"heights">,
    xs: Float64Array,
    z: number,
    heights: Float64Array,
    row: number,
  ): number {
    if (statement.plan === undefined) {
      statement.plan = fieldOf(this.module(scope.module), statement.slots, statement.height);
    }
    const { plan } = statement;
    if (!plan) return 0;
    const { columns, turn, all, result } = plan;
    columns[all * WIDTH] = z;
    if (!this.prepared(plan, scope, xs.length)) return 0;
    this.paths.fill(scope.path);
    for (let first = 0; first < xs.length; first += WIDTH) {
      const count = Math.min(WIDTH, xs.length - first);
      copy(xs, first, columns, turn * WIDTH, count);
      if (!this.computedTurns(plan, scope, count)) return first;
      copy(columns, result * WIDTH, heights, row + first, count);
    }
    return xs.length;
  }

  /** What a part asks for. */
  protected wish(scope: Scope, { at, numbers }: Kind<"impostor">): Wish {
    this.rangedRow(scope, numbers, WISH);
    const place = (argument: number) => numbers.places[argument] as At;
    const views = Math.floor(this.taken(0));
    const size_px = this.taken(1);
    const frames = Math.floor(this.taken(3));
    if (![16, 32, 64, 128].includes(size_px)) throw this.amount(scope.module, place(1), "size", "16, 32, 64 or 128");
    if (views * size_px * frames > MOST_HEIGHT_PX) {
      throw this.amount(scope.module, at, "views * size * frames", `at most ${MOST_HEIGHT_PX}`);
    }
    if (frames > 1 && !this.phased.has(this.part)) throw this.error(scope.module, place(3), NO_PHASE);
    return { views, size_px, below: this.taken(2) !== 0, frames, stride: this.taken(4) };
  }
}

function meshOf(meshes: Mesh[], material: number): Mesh {
  for (let i = 0; i < meshes.length; i += 1) {
    const mesh = meshes[i] as Mesh;
    if (mesh.material === material) return mesh;
  }
  const mesh = new Mesh(material);
  meshes.push(mesh);
  return mesh;
}
