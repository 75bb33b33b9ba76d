/**
 * Where is the turtle? A frame in space: three axes and an origin, as in `crates/scene/src/procedural/affine.rs`.
 */

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

/** Sixteen numbers by columns, as glTF writes matrices. */
export function columns({ x, y, z, origin }: Affine): number[] {
  return [...x, 0, ...y, 0, ...z, 0, ...origin, 1];
}
