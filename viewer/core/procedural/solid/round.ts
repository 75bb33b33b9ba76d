/** Which triangles do cones, spheres and turned profiles have? Rings around the y axis, joined by strips. */

import { cosine, sine } from "../arithmetic.ts";
import { MAX_CORNERS } from "../limits.ts";
import { num } from "../numbers.ts";
import type { Writer } from "./writer.ts";

/** A ring is four numbers: radius, y, and how far its normals lean outwards and upwards. */
const RING = 4;
const rings = new Float64Array(RING * (MAX_CORNERS + 1));

function setRing(ring: number, radius: number, y: number, out: number, up: number): void {
  rings[RING * ring] = radius;
  rings[RING * ring + 1] = y;
  rings[RING * ring + 2] = out;
  rings[RING * ring + 3] = up;
}

/** A mantle, and a disc at each end that has a radius when it is closed. */
export function writeCone(
  writer: Writer,
  low: number,
  high: number,
  height: number,
  sides: number,
  closed: boolean,
): void {
  const circle = circleOf(sides);
  setRing(0, low, 0, height, low - high);
  setRing(1, high, height, height, low - high);
  writeStrip(writer, circle, 2);
  if (!closed) return;
  writeDisc(writer, circle, low, 0, -1);
  writeDisc(writer, circle, high, height, 1);
}

/** Half as many rows as sides. */
export function writeSphere(writer: Writer, radius: number, sides: number): void {
  const rows = Math.max(Math.ceil(sides / 2), 2);
  for (let row = 0; row <= rows; row += 1) {
    const angle = (180 * row) / rows;
    const sin = sine(angle);
    const cos = cosine(angle);
    setRing(row, radius * sin, -radius * cos, sin, -cos);
  }
  writeStrip(writer, circleOf(sides), rows + 1);
}

/** A strip for each part of a profile of so many corners, or one for all of it when it is smooth. */
export function writeLathe(writer: Writer, profile: Float64Array, count: number, sides: number, smooth: boolean): void {
  const circle = circleOf(sides);
  const last = count - 1;
  for (let i = 0; i <= (smooth ? last : last - 1); i += 1) {
    const [out, up] = outward(profile, smooth ? Math.max(i - 1, 0) : i);
    const ring = (to: number, corner: number, out: number, up: number) =>
      setRing(to, num(profile, 2 * corner), num(profile, 2 * corner + 1), out, up);
    if (smooth) {
      const [nextOut, nextUp] = outward(profile, Math.min(i, last - 1));
      ring(i, i, out + nextOut, up + nextUp);
    } else {
      ring(0, i, out, up);
      ring(1, i + 1, out, up);
      writeStrip(writer, circle, 2);
    }
  }
  if (smooth) writeStrip(writer, circle, count);
}

/** Which way the part of a profile behind a corner looks: outwards and upwards. */
function outward(profile: Float64Array, i: number): readonly [number, number] {
  const dr = num(profile, 2 * i + 2) - num(profile, 2 * i);
  const dy = num(profile, 2 * i + 3) - num(profile, 2 * i + 1);
  const length = Math.sqrt(dr * dr + dy * dy);
  return length > 0 ? [dy / length, -dr / length] : [0, 0];
}

const circles: Float64Array[] = [];

/** Directions x, z of the corners, the first along x, then towards −z: counter-clockwise from above. */
function circleOf(sides: number): Float64Array {
  while (circles.length <= sides) {
    const circle = new Float64Array(2 * circles.length);
    for (let side = 0; side < circles.length; side += 1) {
      const angle = (360 * side) / circles.length;
      circle[2 * side] = cosine(angle);
      circle[2 * side + 1] = -sine(angle);
    }
    circles.push(circle);
  }
  return circles[sides] as Float64Array;
}

/**
 * Joins each of so many rings to the next; where one has no radius, with triangles. A ring without triangles is not
 * written, so that there are never more than twice as many vertices as triangles.
 */
function writeStrip(writer: Writer, circle: Float64Array, count: number): void {
  const sides = circle.length / 2;
  writer.reserve(count * sides, 2 * (count - 1) * sides);
  /** Where the ring below begins; −1 when it was not written. Then its radius, and how its normals lean. */
  let under = -1;
  let lower = 0;
  let lowerOut = 0;
  let lowerUp = 0;
  for (let ring = 0; ring < count; ring += 1) {
    const radius = num(rings, RING * ring);
    const hasBelow = ring > 0 && num(rings, RING * (ring - 1)) !== 0;
    const hasAbove = ring + 1 < count && num(rings, RING * (ring + 1)) !== 0;
    if (radius === 0 && !hasBelow && !hasAbove) {
      under = -1;
      continue;
    }
    const first = writer.next;
    const out = num(rings, RING * ring + 2);
    const up = num(rings, RING * ring + 3);
    writer.ring(circle, radius, num(rings, RING * ring + 1));
    if (under >= 0 && Object.is(out, lowerOut) && Object.is(up, lowerUp)) writer.sameNormals(under, sides);
    else writer.ringNormals(circle, out, up);
    if (under >= 0) {
      for (let side = 0; side < sides; side += 1) {
        const next = side + 1 === sides ? 0 : side + 1;
        if (lower > 0) writer.triangle(under + side, under + next, first + next);
        if (radius > 0) writer.triangle(under + side, first + next, first + side);
      }
    }
    under = first;
    lower = radius;
    lowerOut = out;
    lowerUp = up;
  }
}

/** A flat, regular polygon; nothing without a radius. */
function writeDisc(writer: Writer, circle: Float64Array, radius: number, y: number, up: 1 | -1): void {
  if (radius === 0) return;
  const sides = circle.length / 2;
  writer.reserve(sides, sides);
  writer.normal(0, up, 0);
  const first = writer.next;
  for (let i = 0; i < circle.length; i += 2) writer.vertex(radius * num(circle, i), y, radius * num(circle, i + 1));
  for (let next = first + 2; next < first + sides; next += 1) {
    if (up > 0) writer.triangle(first, next - 1, next);
    else writer.triangle(first, next, next - 1);
  }
}
