/** Where does a part lie? Boxes around solids and around what is placed, as in Rust. */
import { type Affine, point, type Vector } from "./affine.ts";
import type { Solid } from "./solid/solid.ts";

export interface Bounds {
  readonly min: Vector;
  readonly max: Vector;
}

/** Holds nothing. */
export const EMPTY: Bounds = {
  min: [Infinity, Infinity, Infinity],
  max: [-Infinity, -Infinity, -Infinity],
};

/** By how much geometry may go beyond what a part declares: rounding to single precision, relative and in metres. */
const SLACK = 1e-6;

/** The smallest box around some points. */
export function around(points: Iterable<Vector>): Bounds {
  let bounds = EMPTY;
  for (const p of points) bounds = union(bounds, { min: p, max: p });
  return bounds;
}

/** The smallest box around points, three numbers each. */
export function aroundPositions(positions: Float32Array): Bounds {
  const min: [number, number, number] = [Infinity, Infinity, Infinity];
  const max: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  positions.forEach((v, i) => {
    const axis = (i % 3) as 0 | 1 | 2;
    if (v < min[axis]) min[axis] = v;
    if (v > max[axis]) max[axis] = v;
  });
  return { min, max };
}

/** The smallest box around both. */
export function union(a: Bounds, b: Bounds): Bounds {
  const low = (i: 0 | 1 | 2) => Math.min(a.min[i], b.min[i]);
  const high = (i: 0 | 1 | 2) => Math.max(a.max[i], b.max[i]);
  return { min: [low(0), low(1), low(2)], max: [high(0), high(1), high(2)] };
}

/** A box around a box in a frame. */
export function placedBounds({ min, max }: Bounds, frame: Affine): Bounds {
  if (min[0] > max[0]) return EMPTY;
  const corners: Vector[] = [];
  for (let i = 0; i < 8; i += 1) {
    const corner: Vector = [i & 1 ? max[0] : min[0], i & 2 ? max[1] : min[1], i & 4 ? max[2] : min[2]];
    corners.push(point(frame, corner));
  }
  return around(corners);
}

/** Whether `inner` reaches out of `outer`. */
export function exceeds(inner: Bounds, outer: Bounds): boolean {
  const diagonal = Math.hypot(...outer.max.map((v, i) => v - (outer.min[i] as number)));
  const slack = SLACK * (1 + diagonal);
  return ([0, 1, 2] as const).some((i) => inner.min[i] < outer.min[i] - slack || inner.max[i] > outer.max[i] + slack);
}

/** A box that holds a solid before it is placed. */
export function extentOf(solid: Solid): Bounds {
  const round = (radius: number, low: number, high: number) =>
    around([
      [-radius, low, -radius],
      [radius, high, radius],
    ]);
  switch (solid.kind) {
    case "box": {
      const [w, h, d] = solid.size;
      return around([
        [-w / 2, 0, -d / 2],
        [w / 2, h, d / 2],
      ]);
    }
    case "cone":
      return round(Math.max(solid.low, solid.high), 0, solid.height);
    case "sphere":
      return round(solid.radius, -solid.radius, solid.radius);
    case "lathe":
      return solid.profile.map(([r, y]) => round(r, y, y)).reduce(union, EMPTY);
    case "prism":
      return around(
        solid.footprint.flatMap(([x, z]): Vector[] => [
          [x, 0, z],
          [x, solid.height, z],
        ]),
      );
    case "mesh":
      return around(solid.points);
    case "heights": {
      const [w, d] = solid.over;
      let [low, high] = [Infinity, -Infinity];
      const [columns, rows] = solid.steps;
      // Without the samples around the rectangle.
      for (let j = 1; j <= rows + 1; j += 1) {
        for (let i = 1; i <= columns + 1; i += 1) {
          const y = solid.heights[j * (columns + 3) + i] as number;
          low = Math.min(low, y);
          high = Math.max(high, y);
        }
      }
      return around([
        [-w / 2, low, -d / 2],
        [w / 2, high, d / 2],
      ]);
    }
  }
}
