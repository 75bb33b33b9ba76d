/**
 * How is a polygon filled with triangles? By cutting off its ears (Meisters 1975). Polygons lie in a plane with axes x and
 * z and are seen from above, that is from +y.
 */
import type { Vector } from "../affine.ts";
import { Fault, POLYGON } from "../error.ts";

export type Corner = readonly [x: number, z: number];

/** The corners counter-clockwise, whichever way round they were given. */
export function outline(corners: readonly Corner[]): readonly Corner[] {
  let twiceArea = 0;
  corners.forEach(([x, z], i) => {
    const [toX, toZ] = corners[(i + 1) % corners.length] as Corner;
    twiceArea += z * toX - x * toZ;
  });
  return twiceArea < 0 ? [...corners].reverse() : corners;
}

/** Twice the signed area of a triangle. */
function turn(a: Corner, b: Corner, c: Corner): number {
  return (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]);
}

function same(a: Corner, b: Corner): boolean {
  return a[0] === b[0] && a[1] === b[1];
}

/** Triangles that fill a polygon whose corners are counter-clockwise. Throws when it crosses itself or has no area. */
export function triangulated(corners: readonly Corner[]): [number, number, number][] {
  const left = [...corners.keys()];
  const triangles: [number, number, number][] = [];
  const cornerOf = (index: number) => corners[index] as Corner;
  const around = (i: number): [number, number, number] => {
    const count = left.length;
    return [left[(i + count - 1) % count] as number, left[i] as number, left[(i + 1) % count] as number];
  };
  const isEar = (i: number): boolean => {
    const triple = around(i);
    const [a, b, c] = [cornerOf(triple[0]), cornerOf(triple[1]), cornerOf(triple[2])];
    if (!(turn(a, b, c) > 0)) return false;
    return !left.some((other) => {
      const p = cornerOf(other);
      if (triple.includes(other) || same(p, a) || same(p, b) || same(p, c)) return false;
      return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
    });
  };
  const isStraight = (i: number): boolean => {
    const [a, b, c] = around(i);
    return turn(cornerOf(a), cornerOf(b), cornerOf(c)) === 0;
  };
  while (left.length > 2) {
    const places = [...left.keys()];
    const ear = places.find(isEar);
    if (ear !== undefined) triangles.push(around(ear));
    // What is left may lie in a line; a corner in a line bounds nothing.
    const gone = ear ?? places.find(isStraight);
    if (gone === undefined) throw new Fault(0, POLYGON);
    left.splice(gone, 1);
  }
  if (triangles.length === 0) throw new Fault(0, POLYGON);
  return triangles;
}

/** The normal of a polygon in space, as long as twice its area (Newell). */
export function newell(corners: readonly Vector[]): Vector {
  const sum = (u: 0 | 1 | 2, v: 0 | 1 | 2): number => {
    let total = 0;
    corners.forEach((a, i) => {
      const b = corners[(i + 1) % corners.length] as Vector;
      total += (a[u] - b[u]) * (a[v] + b[v]);
    });
    return total;
  };
  return [sum(1, 2), sum(2, 0), sum(0, 1)];
}
