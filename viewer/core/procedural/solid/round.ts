/** Which triangles do cones, spheres and turned profiles have? Rings around the y axis, joined by strips. */
import { sinCos } from "../arithmetic.ts";
import type { Corner } from "./polygon.ts";
import type { Writer } from "./writer.ts";

/** A circle of vertices with normals that lean outwards and upwards. */
interface Ring {
  readonly radius: number;
  readonly y: number;
  readonly out: number;
  readonly up: number;
}

type Circle = readonly (readonly [number, number])[];

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
  const slope = { out: height, up: low - high };
  strip(writer, circle, [
    { radius: low, y: 0, ...slope },
    { radius: high, y: height, ...slope },
  ]);
  if (!closed) return;
  disc(writer, circle, low, 0, -1);
  disc(writer, circle, high, height, 1);
}

/** Half as many rows as sides. */
export function writeSphere(writer: Writer, radius: number, sides: number): void {
  const rows = Math.max(Math.ceil(sides / 2), 2);
  const rings = Array.from({ length: rows + 1 }, (_, row): Ring => {
    const [sin, cos] = sinCos((180 * row) / rows);
    return { radius: radius * sin, y: -radius * cos, out: sin, up: -cos };
  });
  strip(writer, circleOf(sides), rings);
}

/** A strip for each part of the profile, or one for all of it when it is smooth. */
export function writeLathe(writer: Writer, profile: readonly Corner[], sides: number, smooth: boolean): void {
  const circle = circleOf(sides);
  const last = profile.length - 1;
  const outward = (i: number): readonly [number, number] => {
    const [r, y] = profile[i] as Corner;
    const [toR, toY] = profile[i + 1] as Corner;
    const dr = toR - r;
    const dy = toY - y;
    const length = Math.sqrt(dr * dr + dy * dy);
    return length > 0 ? [dy / length, -dr / length] : [0, 0];
  };
  const ring = (i: number, [out, up]: readonly [number, number]): Ring => {
    const [radius, y] = profile[i] as Corner;
    return { radius, y, out, up };
  };
  if (smooth) {
    const rings = profile.map((_, i) => {
      const a = outward(Math.max(i - 1, 0));
      const b = outward(Math.min(i, last - 1));
      return ring(i, [a[0] + b[0], a[1] + b[1]]);
    });
    strip(writer, circle, rings);
    return;
  }
  for (let i = 0; i < last; i += 1) {
    const normal = outward(i);
    strip(writer, circle, [ring(i, normal), ring(i + 1, normal)]);
  }
}

const circles = new Map<number, Circle>();

/** Directions x, z of the corners, the first along x, then towards −z: counter-clockwise from above. */
function circleOf(sides: number): Circle {
  let circle = circles.get(sides);
  if (!circle) {
    circle = Array.from({ length: sides }, (_, side) => {
      const [sin, cos] = sinCos((360 * side) / sides);
      return [cos, -sin] as const;
    });
    circles.set(sides, circle);
  }
  return circle;
}

/**
 * Joins each ring to the next; where one has no radius, with triangles. A ring without triangles is not written, so that
 * there are never more than twice as many vertices as triangles.
 */
function strip(writer: Writer, circle: Circle, rings: readonly Ring[]): void {
  const sides = circle.length;
  let under = 0;
  let lower: Ring | undefined;
  for (const [i, ring] of rings.entries()) {
    if (rings.slice(Math.max(i - 1, 0), i + 2).every((near) => near.radius === 0)) {
      lower = undefined;
      continue;
    }
    let first = 0;
    circle.forEach(([x, z], side) => {
      const normal = writer.normal([ring.out * x, ring.up, ring.out * z]);
      const vertex = writer.vertex(ring.radius * x, ring.y, ring.radius * z, normal);
      if (side === 0) first = vertex;
    });
    for (let side = 0; lower && side < sides; side += 1) {
      const next = (side + 1) % sides;
      if (lower.radius > 0) writer.triangle(under + side, under + next, first + next);
      if (ring.radius > 0) writer.triangle(under + side, first + next, first + side);
    }
    under = first;
    lower = ring;
  }
}

/** A flat, regular polygon; nothing without a radius. */
function disc(writer: Writer, circle: Circle, radius: number, y: number, up: 1 | -1): void {
  if (radius === 0) return;
  const normal = writer.normal([0, up, 0]);
  const first = circle.map(([x, z]) => writer.vertex(radius * x, y, radius * z, normal))[0] as number;
  for (let side = 1; side + 1 < circle.length; side += 1) {
    if (up > 0) writer.triangle(first, first + side, first + side + 1);
    else writer.triangle(first, first + side + 1, first + side);
  }
}
