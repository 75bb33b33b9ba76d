/** Which solid do these values make? Values are checked here. As `crates/scene/src/procedural/evaluator/terminal.rs`. */
import type { Vector } from "../affine.ts";
import { extentOf, placedBounds, union } from "../bounds.ts";
import { Fault } from "../error.ts";
import type { Part, Wish } from "../grown.ts";
import { MAX_CORNERS, MAX_SIDES, MAX_STEPS, reached } from "../limits.ts";
import { type Formals, formalsOf, IMPOSTOR, SIDES, type SolidKind } from "../solid/kinds.ts";
import type { Corner } from "../solid/polygon.ts";
import { mostTriangles, type Solid, writeSolid } from "../solid/solid.ts";
import { Mesh, Writer } from "../solid/writer.ts";
import type { At, Expr, Statement } from "../syntax.ts";
import type { List, Value } from "../value.ts";
import { Expressions } from "./expressions.ts";
import type { Scope, Turtle } from "./state.ts";

/** Largest length of a solid, metres. */
const MAX_LENGTH = 1e6;

/** Shortest way of a round of steps. */
const LEAST_STRIDE = 1e-3;
/** As `Wish` in Rust. */
const [MOST_FRAMES, MOST_HEIGHT_PX] = [16, 4096];

const NO_PHASE =
  "`frames` needs a parameter `phase` of this part or file, by which it moves; give it one, such as `phase = 0`";

type Given = readonly (Expr | undefined)[];

export abstract class Terminals extends Expressions {
  /** Adds a solid to the part that is being made. */
  protected add(scope: Scope, at: At, { frame, material }: Turtle, solid: Solid): void {
    const part = this.parts[this.part] as Part;
    part.bounds = union(part.bounds, placedBounds(extentOf(solid), frame));
    const most = mostTriangles(solid);
    if (most === 0) return;
    const limit = this.limits.triangles;
    if (this.usage.triangles + most > limit) {
      throw this.error(scope.module, at, reached("triangles", limit));
    }
    const { meshes } = part;
    let mesh = meshes.find((known) => known.material === material);
    if (!mesh) {
      mesh = new Mesh(material);
      meshes.push(mesh);
    }
    const before = mesh.triangles;
    try {
      writeSolid(new Writer(mesh, frame), solid);
    } catch (error) {
      throw error instanceof Fault ? this.error(scope.module, at, error.problem) : error;
    }
    this.usage.triangles += mesh.triangles - before;
  }

  protected solid(scope: Scope, at: At, kind: SolidKind, args: Given): Solid {
    const length = (index: number) => this.argument(scope, at, kind, args, index, MAX_LENGTH);
    const flag = (index: number) => this.argument(scope, at, kind, args, index, 1) !== 0;
    const sides = (index: number) => {
      const given = Math.floor(this.argument(scope, at, kind, args, index, MAX_SIDES));
      return given === 0 ? (SIDES[this.detail] as number) : Math.max(given, 3);
    };
    switch (kind) {
      case "box":
        return { kind, size: [length(0), length(1), length(2)] };
      case "cone":
        return { kind, low: length(0), high: length(2), height: length(1), sides: sides(3), closed: flag(4) };
      case "cylinder": {
        const radius = length(0);
        const [height, count, closed] = [length(1), sides(2), flag(3)];
        return { kind: "cone", low: radius, high: radius, height, sides: count, closed };
      }
      case "sphere":
        return { kind, radius: length(0), sides: sides(1) };
      case "lathe": {
        const profile = this.corners(scope, at, this.listed(scope, at, args[0]), 2);
        if (profile.some(([radius]) => radius < 0)) throw this.shape(scope, at, "a radius of a profile", "0 or more");
        return { kind, profile, sides: sides(1), smooth: flag(2) };
      }
      case "prism": {
        const footprint = this.corners(scope, at, this.listed(scope, at, args[0]), 3);
        this.countEars(scope, at, footprint.length);
        return { kind, footprint, height: length(1) };
      }
      case "polygon": {
        const points = this.points(scope, at, args[0]);
        return this.mesh(scope, at, points, [points.map((_, i) => i)]);
      }
      case "mesh": {
        const points = this.points(scope, at, args[0]);
        return this.mesh(scope, at, points, this.faces(scope, at, args[1], points.length));
      }
    }
  }

  /** What a part asks for. */
  protected impostor(scope: Scope, at: At, args: Given): Wish {
    const number = (index: number, least: number, most: number) =>
      this.formal(scope, at, IMPOSTOR[index], args[index], least, most);
    const views = Math.floor(number(0, 2, 12));
    const size_px = number(1, 0, MAX_LENGTH);
    const below = number(2, 0, 1) !== 0;
    const frames = Math.floor(number(3, 1, MOST_FRAMES));
    const stride = number(4, LEAST_STRIDE, MAX_LENGTH);
    if (![16, 32, 64, 128].includes(size_px)) throw this.shape(scope, at, "size", "16, 32, 64 or 128");
    if (views * size_px * frames > MOST_HEIGHT_PX) {
      throw this.shape(scope, at, "views * size * frames", `at most ${MOST_HEIGHT_PX}`);
    }
    if (frames > 1 && !this.phased.has(this.part)) throw this.error(scope.module, at, NO_PHASE);
    return { views, size_px, below, frames, stride };
  }

  /** An argument, or what it is when it is not given. */
  private argument(scope: Scope, at: At, kind: SolidKind, args: Given, index: number, most: number): number {
    return this.formal(scope, at, formalsOf(kind)[index], args[index], 0, most);
  }

  private formal(
    scope: Scope,
    at: At,
    [name, initial]: Formals[number] = ["", 0],
    expr: Expr | undefined,
    least: number,
    most: number,
  ): number {
    return expr ? this.ranged(scope, at, expr, name, least, most) : (initial ?? 0);
  }

  private shape(scope: Scope, at: At, what: string, wanted: string): Error {
    return this.error(scope.module, at, `${what} must be ${wanted}`);
  }

  private mesh(scope: Scope, at: At, points: Vector[], faces: number[][]): Solid {
    for (const face of faces) {
      if (face.length < 3 || face.length > MAX_CORNERS) {
        throw this.shape(scope, at, "a face", "three corners or more, up to 256");
      }
      this.countEars(scope, at, face.length);
    }
    return { kind: "mesh", points, faces };
  }

  /** Cutting off ears looks at each corner from each corner, once for each ear. */
  private countEars(scope: Scope, at: At, corners: number): void {
    this.count(scope, at, Math.floor((corners * corners * corners) / 16));
  }

  /** A sample for each grid point, and one more around them for the slopes at the border. */
  protected heights(scope: Scope, statement: Extract<Statement, { kind: "heights" }>): Solid {
    const { at } = statement;
    const over = [
      this.ranged(scope, at, statement.over[0], "a width", 1e-3, MAX_LENGTH),
      this.ranged(scope, at, statement.over[1], "a depth", 1e-3, MAX_LENGTH),
    ] as const;
    const steps = [
      Math.floor(this.ranged(scope, at, statement.steps[0], "steps", 1, MAX_STEPS)),
      Math.floor(this.ranged(scope, at, statement.steps[1], "steps", 1, MAX_STEPS)),
    ] as const;
    const limit = this.limits.triangles;
    if (this.usage.triangles + 2 * steps[0] * steps[1] > limit) {
      throw this.error(scope.module, at, reached("triangles", limit));
    }
    const row = steps[0] + 3;
    const heights = new Float64Array(row * (steps[1] + 3));
    for (let j = 0; j < steps[1] + 3; j += 1) {
      this.assign(scope, statement.slots[1], over[1] * ((j - 1) / steps[1] - 0.5));
      for (let i = 0; i < row; i += 1) {
        this.assign(scope, statement.slots[0], over[0] * ((i - 1) / steps[0] - 0.5));
        heights[j * row + i] = this.ranged(scope, at, statement.height, "a height", -MAX_LENGTH, MAX_LENGTH);
      }
    }
    return { kind: "heights", over, steps, heights };
  }

  private listed(scope: Scope, at: At, expr: Expr | undefined): List {
    return this.list(scope, at, expr as Expr, "the corners of a solid");
  }

  private points(scope: Scope, at: At, expr: Expr | undefined): Vector[] {
    return this.listed(scope, at, expr).items.map((item) => this.point3(scope, at, item));
  }

  private faces(scope: Scope, at: At, expr: Expr | undefined, points: number): number[][] {
    return this.listed(scope, at, expr).items.map((face) => {
      const corners = typeof face === "number" ? [undefined] : face.items;
      return corners.map((corner) => {
        if (typeof corner === "number" && corner >= 0 && corner < points) return Math.trunc(corner);
        throw this.shape(scope, at, "a face", "a list of numbers of points, counted from 0");
      });
    });
  }

  protected point3(scope: Scope, at: At, value: Value): Vector {
    const [x, y, z, more] = coordinates(value);
    if (x !== undefined && y !== undefined && z !== undefined && more === undefined) return [x, y, z];
    throw this.shape(scope, at, "a point", "`[x, y, z]`");
  }

  /** Corners `[x, z]` of an outline. */
  protected corners(scope: Scope, at: At, value: Value, least: number): Corner[] {
    const items = typeof value === "number" ? [] : value.items;
    const corners = items.map((item): Corner | undefined => {
      const [x, z, more] = coordinates(item);
      return x !== undefined && z !== undefined && more === undefined ? [x, z] : undefined;
    });
    const sound = corners.filter((corner) => corner !== undefined);
    if (sound.length === corners.length && corners.length >= least && corners.length <= MAX_CORNERS) return sound;
    const wanted = "a list of `[x, z]`: two or more in a profile, three or more around a polygon, up to 256";
    throw this.shape(scope, at, "this outline", wanted);
  }
}

/** Numbers of a list; none when one is no number or too large. */
function coordinates(value: Value): readonly number[] {
  if (typeof value === "number") return [];
  const { items } = value;
  return items.every((item) => typeof item === "number" && Math.abs(item) <= MAX_LENGTH) ? (items as number[]) : [];
}
