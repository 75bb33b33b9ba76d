/**
 * Where is the turtle? What it is told is handed down and never up: so a turtle is a place on a stack, thirteen numbers
 * behind the one that it comes from. As `crates/scene/src/procedural/affine.rs`, without making anything on the way.
 */

import { type Affine, after, IDENTITY } from "./affine.ts";
import { cosine, sine } from "./arithmetic.ts";
import { num } from "./numbers.ts";
import { WIDTH } from "./plain/columns.ts";
import type { Pose } from "./plain/plan.ts";

/** Three axes, an origin and the material. */
export const FRAME = 12;
/** What a turtle is: its frame and its material. */
export const SIZE = FRAME + 1;
/** Where the axes begin in it. */
const [X, Y, Z, ORIGIN] = [0, 3, 6, 9] as const;

export type Axis = "x" | "y" | "z";

export class Turtles {
  /** Axes x, y and z, origin and material of each. */
  numbers = new Float64Array(64 * SIZE);

  /** One in a space of its own, behind another. */
  fresh(of: number, material: number): number {
    const at = this.room(of);
    this.put(at, IDENTITY);
    this.numbers[at + FRAME] = material;
    return at;
  }

  /** The first of all. */
  first(material: number): number {
    return this.fresh(-SIZE, material);
  }

  painted(of: number, material: number): number {
    const at = this.copied(of);
    this.numbers[at + FRAME] = material;
    return at;
  }

  material(of: number): number {
    return this.numbers[of + FRAME] as number;
  }

  /** Moved along its own axes. */
  moved(of: number, x: number, y: number, z: number): number {
    const at = this.copied(of);
    const { numbers } = this;
    numbers[at + 9] = num(numbers, of) * x + num(numbers, of + 3) * y + num(numbers, of + 6) * z + num(numbers, of + 9);
    numbers[at + 10] =
      num(numbers, of + 1) * x + num(numbers, of + 4) * y + num(numbers, of + 7) * z + num(numbers, of + 10);
    numbers[at + 11] =
      num(numbers, of + 2) * x + num(numbers, of + 5) * y + num(numbers, of + 8) * z + num(numbers, of + 11);
    return at;
  }

  /** Stretched along its own axes. */
  scaled(of: number, x: number, y: number, z: number): number {
    const at = this.copied(of);
    const { numbers } = this;
    for (let i = at; i < at + 3; i += 1) {
      numbers[i] = num(numbers, i) * x;
      numbers[i + Y] = num(numbers, i + Y) * y;
      numbers[i + Z] = num(numbers, i + Z) * z;
    }
    return at;
  }

  /** Turned about its own axis: counter-clockwise for one who looks against it. */
  turned(of: number, axis: Axis, degrees: number): number {
    if (axis === "x") return this.swung(of, Y, Z, degrees);
    if (axis === "y") return this.swung(of, Z, X, degrees);
    return this.swung(of, X, Y, degrees);
  }

  /** `u` and `v` turned from one to the other. */
  private swung(of: number, u: number, v: number, degrees: number): number {
    const sin = sine(degrees);
    const cos = cosine(degrees);
    const at = this.copied(of);
    const { numbers } = this;
    swing(numbers, at + u, at + v, sin, cos);
    swing(numbers, at + u + 1, at + v + 1, sin, cos);
    swing(numbers, at + u + 2, at + v + 2, sin, cos);
    return at;
  }

  /** First `inner`, then the turtle. */
  after(of: number, inner: Affine): number {
    const at = this.copied(of);
    this.put(at, after(this.frame(of), inner));
    return at;
  }

  /** Whether all its numbers are so small. */
  isWithin(at: number, most: number): boolean {
    const { numbers } = this;
    let squares = 0;
    for (let i = at; i < at + FRAME; i += 1) squares += num(numbers, i) * num(numbers, i);
    if (squares < most * most) return true;
    for (let i = at; i < at + FRAME; i += 1) {
      if (!(Math.abs(num(numbers, i)) <= most)) return false;
    }
    return true;
  }

  /** The same of its axes, of which each number is smaller, and its origin. */
  mayTurn(at: number, longest: number, farthest: number): boolean {
    const { numbers } = this;
    for (let i = at; i < at + FRAME; i += 1) {
      if (!(Math.abs(num(numbers, i)) <= (i < at + ORIGIN ? longest : farthest))) return false;
    }
    return true;
  }

  /** One that is somewhere else, by a turn of columns of numbers; with room for as many others between. */
  among(of: number, columns: Float64Array, pose: Pose, turn: number, material: number, between = 0): number {
    const at = this.room(of + between * SIZE);
    const { numbers } = this;
    for (let i = 0; i < 3; i += 1) {
      numbers[at + X + i] = num(columns, (pose.x + i) * WIDTH + turn);
      numbers[at + Y + i] = num(columns, (pose.y + i) * WIDTH + turn);
      numbers[at + Z + i] = num(columns, (pose.z + i) * WIDTH + turn);
      numbers[at + ORIGIN + i] = num(columns, (pose.origin + i) * WIDTH + turn);
    }
    numbers[at + FRAME] = material;
    return at;
  }

  /** Its frame, to be kept. */
  frame(at: number): Affine {
    const vector = (i: number) => [num(this.numbers, i), num(this.numbers, i + 1), num(this.numbers, i + 2)] as const;
    return { x: vector(at + X), y: vector(at + Y), z: vector(at + Z), origin: vector(at + ORIGIN) };
  }

  private put(at: number, { x, y, z, origin }: Affine): void {
    for (let i = 0; i < 3; i += 1) {
      this.numbers[at + X + i] = x[i] as number;
      this.numbers[at + Y + i] = y[i] as number;
      this.numbers[at + Z + i] = z[i] as number;
      this.numbers[at + ORIGIN + i] = origin[i] as number;
    }
  }

  private copied(of: number): number {
    const at = this.room(of);
    const { numbers } = this;
    copy(numbers, of + X, at + X);
    copy(numbers, of + Y, at + Y);
    copy(numbers, of + Z, at + Z);
    copy(numbers, of + ORIGIN, at + ORIGIN);
    numbers[at + FRAME] = num(numbers, of + FRAME);
    return at;
  }

  /** The place behind one. */
  private room(of: number): number {
    const at = of + SIZE;
    if (at + SIZE > this.numbers.length) {
      const wide = new Float64Array(2 * (at + SIZE));
      wide.set(this.numbers);
      this.numbers = wide;
    }
    return at;
  }
}

// Written out, because compilers of browsers make much of loops over so little.

function copy(numbers: Float64Array, of: number, to: number): void {
  numbers[to] = num(numbers, of);
  numbers[to + 1] = num(numbers, of + 1);
  numbers[to + 2] = num(numbers, of + 2);
}

function swing(numbers: Float64Array, u: number, v: number, sin: number, cos: number): void {
  const from = num(numbers, u);
  const to = num(numbers, v);
  numbers[u] = from * cos + to * sin;
  numbers[v] = to * cos - from * sin;
}
