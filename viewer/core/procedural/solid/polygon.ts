/**
 * How is a polygon filled with triangles? By cutting off its ears (Meisters 1975). Polygons lie in a plane with axes x and
 * z and are seen from above, that is from +y. Corners are two numbers each.
 */

import { Fault, notFlat, POLYGON } from "../error.ts";
import { MAX_CORNERS } from "../limits.ts";
import { num } from "../numbers.ts";

/** Puts corners into counter-clockwise order, whichever way round they are. */
export function outline(corners: Float64Array, count: number): void {
  let twiceArea = 0;
  for (let i = 0; i < count; i += 1) {
    const j = i + 1 === count ? 0 : i + 1;
    twiceArea += num(corners, 2 * i + 1) * num(corners, 2 * j) - num(corners, 2 * i) * num(corners, 2 * j + 1);
  }
  if (!(twiceArea < 0)) return;
  for (let [i, j] = [0, count - 1]; i < j; i += 1, j -= 1) {
    for (let axis = 0; axis < 2; axis += 1) {
      const first = num(corners, 2 * i + axis);
      corners[2 * i + axis] = num(corners, 2 * j + axis);
      corners[2 * j + axis] = first;
    }
  }
}

/** Finds triangles that fill polygons, one polygon after the other. */
export class Ears {
  /** Three corners for each triangle that was found. */
  readonly triangles = new Int32Array(3 * MAX_CORNERS);
  count = 0;
  /** Corners that are not cut off. */
  private readonly left = new Int32Array(MAX_CORNERS);
  private readonly x = new Float64Array(MAX_CORNERS);
  private readonly z = new Float64Array(MAX_CORNERS);

  /** Sets a corner of the polygon. */
  corner(i: number, x: number, z: number): void {
    this.left[i] = i;
    this.x[i] = x;
    this.z[i] = z;
  }

  /** Triangles that fill a polygon whose corners are counter-clockwise. Throws when it crosses itself or has no area. */
  cutOff(count: number): void {
    this.count = 0;
    for (let more = count; more > 2; more -= 1) {
      const ear = this.earOf(more);
      if (ear >= 0) this.keep(ear, more);
      // What is left may lie in a line; a corner in a line bounds nothing.
      const gone = ear >= 0 ? ear : this.straightOf(more);
      if (gone < 0) throw new Fault(0, POLYGON);
      const { left } = this;
      for (let i = gone; i + 1 < more; i += 1) left[i] = left[i + 1] as number;
    }
    if (this.count === 0) throw new Fault(0, POLYGON);
  }

  private keep(ear: number, count: number): void {
    const { left, triangles } = this;
    const at = 3 * this.count;
    triangles[at] = left[ear === 0 ? count - 1 : ear - 1] as number;
    triangles[at + 1] = left[ear] as number;
    triangles[at + 2] = left[ear + 1 === count ? 0 : ear + 1] as number;
    this.count += 1;
  }

  /** The first of so many corners that can be cut off; −1 when there is none. */
  private earOf(count: number): number {
    const { left } = this;
    for (let i = 0; i < count; i += 1) {
      const a = left[i === 0 ? count - 1 : i - 1] as number;
      const b = left[i] as number;
      const c = left[i + 1 === count ? 0 : i + 1] as number;
      if (this.turn(a, b, c) > 0 && (count === 3 || this.isEmpty(count, a, b, c))) return i;
    }
    return -1;
  }

  /** Whether no other corner lies in a triangle, its border included, but for those that lie on one of its corners. */
  private isEmpty(count: number, a: number, b: number, c: number): boolean {
    const { left } = this;
    for (let i = 0; i < count; i += 1) {
      const p = left[i] as number;
      if (p === a || p === b || p === c || this.same(p, a) || this.same(p, b) || this.same(p, c)) continue;
      if (this.turn(a, b, p) >= 0 && this.turn(b, c, p) >= 0 && this.turn(c, a, p) >= 0) return false;
    }
    return true;
  }

  /** The first corner that lies in a line with those beside it. */
  private straightOf(count: number): number {
    const { left } = this;
    for (let i = 0; i < count; i += 1) {
      const before = left[i === 0 ? count - 1 : i - 1] as number;
      const behind = left[i + 1 === count ? 0 : i + 1] as number;
      if (this.turn(before, left[i] as number, behind) === 0) return i;
    }
    return -1;
  }

  /** Twice the signed area of a triangle. */
  turn(a: number, b: number, c: number): number {
    const { x, z } = this;
    return (num(z, b) - num(z, a)) * (num(x, c) - num(x, a)) - (num(x, b) - num(x, a)) * (num(z, c) - num(z, a));
  }

  private same(a: number, b: number): boolean {
    return num(this.x, a) === num(this.x, b) && num(this.z, a) === num(this.z, b);
  }
}

/** Twice the signed area of a triangle between points that begin at these places, seen in the plane of two of their axes. */
export function turn(points: Float64Array, a: number, b: number, c: number, u: number, v: number): number {
  const x = num(points, a + u);
  const z = num(points, a + v);
  return (num(points, b + v) - z) * (num(points, c + u) - x) - (num(points, b + u) - x) * (num(points, c + v) - z);
}

/** Axes of planes, by what is normal to them and which side is seen. */
const ACROSS = [
  [2, 1],
  [0, 2],
  [1, 0],
  [1, 2],
  [2, 0],
  [0, 1],
] as const;

/** The axes of the plane in which a polygon with this normal has most area, with the order of that side kept. */
export function axesAcross(x: number, y: number, z: number): readonly [u: number, v: number] {
  let steep = 0;
  if (Math.abs(y) > Math.abs(x)) steep = 1;
  if (Math.abs(z) > Math.abs(steep === 0 ? x : y)) steep = 2;
  const flipped = (steep === 0 ? x : steep === 1 ? y : z) < 0;
  return ACROSS[flipped ? steep + 3 : steep] as readonly [number, number];
}

/**
 * The normal of a polygon in space, as long as twice its area (Newell).
 * @param points Three numbers each.
 * @param corners Numbers of points; those of the polygon are `count` from `begin` on.
 */
export function newell(
  points: Float64Array,
  corners: Int32Array,
  begin: number,
  count: number,
  normal: Float64Array,
): void {
  let x = 0;
  let y = 0;
  let z = 0;
  for (let i = 0; i < count; i += 1) {
    const a = 3 * (corners[begin + i] as number);
    const b = 3 * (corners[i + 1 === count ? begin : begin + i + 1] as number);
    x += (num(points, a + 1) - num(points, b + 1)) * (num(points, a + 2) + num(points, b + 2));
    y += (num(points, a + 2) - num(points, b + 2)) * (num(points, a) + num(points, b));
    z += (num(points, a) - num(points, b)) * (num(points, a + 1) + num(points, b + 1));
  }
  normal[0] = x;
  normal[1] = y;
  normal[2] = z;
}

/** The same of a triangle, which most polygons are. */
export function newellOfThree(points: Float64Array, corners: Int32Array, begin: number, normal: Float64Array): void {
  const a = 3 * (corners[begin] as number);
  const b = 3 * (corners[begin + 1] as number);
  const c = 3 * (corners[begin + 2] as number);
  const ax = num(points, a);
  const ay = num(points, a + 1);
  const az = num(points, a + 2);
  const bx = num(points, b);
  const by = num(points, b + 1);
  const bz = num(points, b + 2);
  const cx = num(points, c);
  const cy = num(points, c + 1);
  const cz = num(points, c + 2);
  normal[0] = 0 + (ay - by) * (az + bz) + (by - cy) * (bz + cz) + (cy - ay) * (cz + az);
  normal[1] = 0 + (az - bz) * (ax + bx) + (bz - cz) * (bx + cx) + (cz - az) * (cx + ax);
  normal[2] = 0 + (ax - bx) * (ay + by) + (bx - cx) * (by + cy) + (cx - ax) * (cy + ay);
}

/** How far the corners of a polygon may lie off its plane, as a part of the longest side of a box around it. */
const MOST_UNEVEN = 0.01;
const plane = new Float64Array(3);
const middle = new Float64Array(3);

/** Throws when not all of so many corners lie in a plane, but for a little. */
export function refuseUneven(points: Float64Array, corners: Int32Array, count: number): void {
  newell(points, corners, 0, count, plane);
  let size = 0;
  for (let axis = 0; axis < 3; axis += 1) {
    let [low, high, sum] = [Infinity, -Infinity, 0];
    for (let at = axis; at < 3 * count; at += 3) {
      const along = num(points, at);
      low = Math.min(low, along);
      high = Math.max(high, along);
      sum += along;
    }
    size = Math.max(size, high - low);
    middle[axis] = sum / count;
  }
  let off = 0;
  for (let at = 0; at < 3 * count; at += 3) {
    const along = (axis: number) => num(plane, axis) * (num(points, at + axis) - num(middle, axis));
    off = Math.max(off, Math.abs(along(0) + along(1) + along(2)));
  }
  const [x, y, z] = [num(plane, 0), num(plane, 1), num(plane, 2)];
  const whole = size * Math.sqrt(x * x + y * y + z * z);
  // What has no area is refused for that.
  if (off <= MOST_UNEVEN * whole || whole === 0) return;
  throw new Fault(0, notFlat(off / whole));
}
