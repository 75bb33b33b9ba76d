/**
 * Where is the turtle? A frame in space: three axes and an origin, as in `crates/scene/src/procedural/affine.rs`.
 */
import { sinCos } from "./arithmetic.ts";

export type Vector = readonly [number, number, number];

export interface Affine {
  readonly x: Vector;
  readonly y: Vector;
  readonly z: Vector;
  readonly origin: Vector;
}

export const IDENTITY: Affine = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1], origin: [0, 0, 0] };

/** Where a direction leads. */
export function direction({ x, y, z }: Affine, [u, v, w]: Vector): Vector {
  return [x[0] * u + y[0] * v + z[0] * w, x[1] * u + y[1] * v + z[1] * w, x[2] * u + y[2] * v + z[2] * w];
}

/** Where a point comes to lie. */
export function point(frame: Affine, p: Vector): Vector {
  const d = direction(frame, p);
  const { origin } = frame;
  return [d[0] + origin[0], d[1] + origin[1], d[2] + origin[2]];
}

/** First `inner`, then `outer`. */
export function after(outer: Affine, inner: Affine): Affine {
  return {
    x: direction(outer, inner.x),
    y: direction(outer, inner.y),
    z: direction(outer, inner.z),
    origin: point(outer, inner.origin),
  };
}

/** Moved along its own axes. */
export function moved(frame: Affine, by: Vector): Affine {
  return { x: frame.x, y: frame.y, z: frame.z, origin: point(frame, by) };
}

function times(v: Vector, factor: number): Vector {
  return [v[0] * factor, v[1] * factor, v[2] * factor];
}

/** Stretched along its own axes. */
export function scaled({ x, y, z, origin }: Affine, by: Vector): Affine {
  return { x: times(x, by[0]), y: times(y, by[1]), z: times(z, by[2]), origin };
}

/** `u` and `v` turned from one to the other. */
function swung(u: Vector, v: Vector, degrees: number): [Vector, Vector] {
  const [sin, cos] = sinCos(degrees);
  return [
    [u[0] * cos + v[0] * sin, u[1] * cos + v[1] * sin, u[2] * cos + v[2] * sin],
    [v[0] * cos - u[0] * sin, v[1] * cos - u[1] * sin, v[2] * cos - u[2] * sin],
  ];
}

/** Turned about its own axis: counter-clockwise for one who looks against it. */
export function turned(frame: Affine, axis: "x" | "y" | "z", degrees: number): Affine {
  if (axis === "x") {
    const [y, z] = swung(frame.y, frame.z, degrees);
    return { ...frame, y, z };
  }
  if (axis === "y") {
    const [z, x] = swung(frame.z, frame.x, degrees);
    return { ...frame, z, x };
  }
  const [x, y] = swung(frame.x, frame.y, degrees);
  return { ...frame, x, y };
}

/** Whether it turns left into right. */
export function mirrors({ x, y, z }: Affine): boolean {
  return dot(x, cross(y, z)) < 0;
}

/** The map of normals, up to their length: outward stays outward. */
export function normalsOf(frame: Affine): Affine {
  const { x, y, z } = frame;
  const sign = mirrors(frame) ? -1 : 1;
  return { x: times(cross(y, z), sign), y: times(cross(z, x), sign), z: times(cross(x, y), sign), origin: [0, 0, 0] };
}

/** Sixteen numbers by columns, as glTF writes matrices. */
export function columns({ x, y, z, origin }: Affine): number[] {
  return [...x, 0, ...y, 0, ...z, 0, ...origin, 1];
}

export function dot(a: Vector, b: Vector): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** Of length one; upright when it has no direction. */
export function unit(v: Vector): Vector {
  const length = Math.sqrt(dot(v, v));
  return length > 0 ? [v[0] / length, v[1] / length, v[2] / length] : [0, 1, 0];
}
