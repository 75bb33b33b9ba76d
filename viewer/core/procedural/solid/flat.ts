/** Which triangles do boxes, prisms, sets of polygons and height fields have? */

import { MAX_CORNERS } from "../limits.ts";
import { num } from "../numbers.ts";
import { axesAcross, Ears, newell, newellOfThree, refuseUneven, turn } from "./polygon.ts";
import type { Writer } from "./writer.ts";

/** Polygons by the numbers of their corners, one after the other. */
export class Faces {
  corners = new Int32Array(16);
  /** Where each ends in `corners`. */
  ends = new Int32Array(8);
  count = 0;
  /** Corners of all of them. */
  length = 0;
  /** The largest number of a corner. */
  last = -1;
  /** Most looks at corners that cutting off ears takes: at each corner from each corner, once for each ear. */
  looks = 0;
  /** Whether each has three corners or more, and not too many. */
  areSound = true;
  /** Whether the points must lie in a plane: there is one face, around all of them. */
  isFlat = false;

  clear(): void {
    this.count = 0;
    this.length = 0;
    this.last = -1;
    this.looks = 0;
    this.areSound = true;
    this.isFlat = false;
  }

  /** Adds a corner to the face that is not ended. */
  add(corner: number): void {
    if (this.length === this.corners.length) this.corners = widened(this.corners);
    this.corners[this.length] = corner;
    this.length += 1;
    if (corner > this.last) this.last = Math.trunc(corner);
  }

  end(): void {
    const corners = this.length - (this.count === 0 ? 0 : (this.ends[this.count - 1] as number));
    if (this.count === this.ends.length) this.ends = widened(this.ends);
    this.ends[this.count] = this.length;
    this.count += 1;
    this.looks += looksAt(corners);
    if (corners < 3 || corners > MAX_CORNERS) this.areSound = false;
  }
}

/** Cutting off ears looks at each corner from each corner, once for each ear. */
export function looksAt(corners: number): number {
  return Math.floor((corners * corners * corners) / 16);
}

function widened(array: Int32Array): Int32Array<ArrayBuffer> {
  const wide = new Int32Array(2 * array.length);
  wide.set(array);
  return wide;
}

/** Of each face its four corners, whose bits say where they lie, and its normal. */
const BOX = Float64Array.from(
  [
    [1, 3, 7, 5, 1, 0, 0],
    [0, 4, 6, 2, -1, 0, 0],
    [2, 6, 7, 3, 0, 1, 0],
    [0, 1, 5, 4, 0, -1, 0],
    [4, 5, 7, 6, 0, 0, 1],
    [0, 2, 3, 1, 0, 0, -1],
  ].flat(),
);

const ears = new Ears();
const facing = new Float64Array(3);

/** Six faces, each with corners of its own. */
export function writeBox(writer: Writer, width: number, height: number, depth: number): void {
  const x = width / 2;
  const z = depth / 2;
  writer.reserve(24, 12);
  for (let i = 0; i < 8; i += 1) writer.place(i, i & 1 ? x : -x, i & 2 ? height : 0, i & 4 ? z : -z);
  for (let face = 0; face < BOX.length; face += 7) {
    writer.normal(num(BOX, face + 4), num(BOX, face + 5), num(BOX, face + 6));
    writer.quad(num(BOX, face), num(BOX, face + 1), num(BOX, face + 2), num(BOX, face + 3));
  }
}

/** A wall for each edge of a footprint of so many corners, counter-clockwise; a lid and a floor. */
export function writePrism(writer: Writer, footprint: Float64Array, count: number, height: number): void {
  for (let i = 0; i < count; i += 1) ears.corner(i, num(footprint, 2 * i), num(footprint, 2 * i + 1));
  ears.cutOff(count);
  writer.reserve(6 * count, 4 * count);
  for (let i = 0; i < count; i += 1) {
    const next = i + 1 === count ? 0 : i + 1;
    const [x, z] = [num(footprint, 2 * i), num(footprint, 2 * i + 1)];
    const [toX, toZ] = [num(footprint, 2 * next), num(footprint, 2 * next + 1)];
    writer.normal(z - toZ, 0, toX - x);
    writer.place(0, x, 0, z);
    writer.place(1, toX, 0, toZ);
    writer.place(2, toX, height, toZ);
    writer.place(3, x, height, z);
    writer.quad(0, 1, 2, 3);
  }
  writeLid(writer, footprint, count, height, 1);
  writeLid(writer, footprint, count, 0, -1);
}

function writeLid(writer: Writer, footprint: Float64Array, count: number, y: number, up: 1 | -1): void {
  writer.normal(0, up, 0);
  const first = writer.next;
  for (let i = 0; i < count; i += 1) writer.vertex(num(footprint, 2 * i), y, num(footprint, 2 * i + 1));
  writeEars(writer, first, up);
}

/** The triangles that were found last, of vertices from `first` on. */
function writeEars(writer: Writer, first: number, up: 1 | -1): void {
  const { triangles, count } = ears;
  for (let at = 0; at < 3 * count; at += 3) {
    const a = first + (triangles[at] as number);
    const b = first + (triangles[at + 1] as number);
    const c = first + (triangles[at + 2] as number);
    if (up > 0) writer.triangle(a, b, c);
    else writer.triangle(a, c, b);
  }
}

/** Polygons between so many points of three numbers each, shaded as if they were flat; every one has corners of its own. */
export function writeMesh(writer: Writer, points: Float64Array, count: number, faces: Faces): void {
  const { corners, ends } = faces;
  if (faces.isFlat && count > 3) refuseUneven(points, corners, count);
  writer.placeAll(points, count);
  writer.reserve(faces.length, faces.length);
  for (let face = 0, begin = 0; face < faces.count; face += 1) {
    const end = ends[face] as number;
    if (end - begin === 3) newellOfThree(points, corners, begin, facing);
    else newell(points, corners, begin, end - begin, facing);
    writeFace(writer, points, corners, begin, end - begin);
    begin = end;
  }
}

/** The polygon of so many corners from `begin` on. */
function writeFace(writer: Writer, points: Float64Array, corners: Int32Array, begin: number, count: number): void {
  const x = num(facing, 0);
  const y = num(facing, 1);
  const z = num(facing, 2);
  // Looked at along the axis on which it has most area, with that side's order kept.
  const across = axesAcross(x, y, z);
  const u = across[0];
  const v = across[1];
  writer.normal(x, y, z);
  if (count === 3) {
    // Cut off from its first corner on, which is where its only ear is.
    const a = corners[begin] as number;
    const b = corners[begin + 1] as number;
    const c = corners[begin + 2] as number;
    if (turn(points, 3 * c, 3 * a, 3 * b, u, v) > 0) {
      writer.placedTriangle(a, b, c);
      return;
    }
  }
  const first = writer.next;
  for (let i = 0; i < count; i += 1) {
    const point = corners[begin + i] as number;
    ears.corner(i, num(points, 3 * point + u), num(points, 3 * point + v));
    writer.corner(point);
  }
  ears.cutOff(count);
  writeEars(writer, first, 1);
}

/**
 * A grid over a rectangle around the origin; normals by the slope between the samples on both sides.
 * @param heights Rows along x, rising z, with one more sample around the rectangle.
 */
export function writeHeights(
  writer: Writer,
  [width, depth]: readonly [number, number],
  [columns, rows]: readonly [number, number],
  heights: Float64Array,
): void {
  const dx = width / columns;
  const dz = depth / rows;
  const row = columns + 3;
  const first = writer.next;
  writer.reserve((columns + 1) * (rows + 1), 2 * columns * rows);
  for (let j = 0; j <= rows; j += 1) {
    const z = depth * (j / rows - 0.5);
    for (let i = 0; i <= columns; i += 1) {
      // Samples begin one step before the rectangle.
      const at = (j + 1) * row + i + 1;
      const slopeX = (num(heights, at + 1) - num(heights, at - 1)) / (2 * dx);
      const slopeZ = (num(heights, at + row) - num(heights, at - row)) / (2 * dz);
      writer.normal(-slopeX, 1, -slopeZ);
      writer.vertex(width * (i / columns - 0.5), num(heights, at), z);
    }
  }
  for (let j = 0; j < rows; j += 1) {
    const near = first + j * (columns + 1);
    const far = near + columns + 1;
    for (let i = 0; i < columns; i += 1) {
      writer.triangle(near + i, far + i, far + i + 1);
      writer.triangle(near + i, far + i + 1, near + i + 1);
    }
  }
}
