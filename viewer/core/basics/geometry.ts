/**
 * Where does something stand? Points, boxes and convex hulls in world space, metres.
 */
export type Vec3 = readonly [number, number, number];

/** An axis-aligned box, as the published documents write it. */
export interface Bounds {
  readonly min: Vec3;
  readonly max: Vec3;
}

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, factor: number): Vec3 => [a[0] * factor, a[1] * factor, a[2] * factor];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

/** Where an eye looks that is turned and raised so far, of length one. Angles are zero along −Z, and rise to the left and upwards. */
export const direction = (yaw: number, pitch = 0): Vec3 => [
  -Math.sin(yaw) * Math.cos(pitch),
  Math.sin(pitch),
  -Math.cos(yaw) * Math.cos(pitch),
];

/** The box around points, of which there is at least one. */
export function boundsOf(points: readonly Vec3[]): Bounds {
  const reach = (most: (...values: number[]) => number): Vec3 => [
    most(...points.map(([x]) => x)),
    most(...points.map(([, y]) => y)),
    most(...points.map(([, , z]) => z)),
  ];
  return { min: reach(Math.min), max: reach(Math.max) };
}

/** The middle of a box. */
export const middle = ({ min, max }: Bounds): Vec3 => scale(add(min, max), 0.5);

/** From corner to corner of a box. */
export const diagonal_m = ({ min, max }: Bounds): number => length(subtract(max, min));

/** Distance from a point to the box in metres, zero inside. */
export function distanceToBounds({ min, max }: Bounds, point: Vec3): number {
  // Axis by axis and without a loop: this is asked for thousands of boxes while one plans.
  const x = Math.max(min[0] - point[0], point[0] - max[0], 0);
  const y = Math.max(min[1] - point[1], point[1] - max[1], 0);
  const z = Math.max(min[2] - point[2], point[2] - max[2], 0);
  return Math.sqrt(x * x + y * y + z * z);
}

/** The point of a box that is nearest to another; that itself when it is inside. */
export function nearestInBounds({ min, max }: Bounds, point: Vec3): Vec3 {
  const clamp = (axis: 0 | 1 | 2) => Math.min(max[axis], Math.max(min[axis], point[axis]));
  return [clamp(0), clamp(1), clamp(2)];
}

/** How far a ray goes until it meets a box, in lengths of its direction; zero from inside, infinite when it never does. */
export function rayToBounds({ min, max }: Bounds, origin: Vec3, direction: Vec3): number {
  let [enters, leaves] = [0, Number.POSITIVE_INFINITY];
  for (const axis of [0, 1, 2] as const) {
    const rate = direction[axis];
    if (Math.abs(rate) < 1e-12) {
      if (origin[axis] < min[axis] || origin[axis] > max[axis]) return Number.POSITIVE_INFINITY;
      continue;
    }
    const [a, b] = [(min[axis] - origin[axis]) / rate, (max[axis] - origin[axis]) / rate];
    enters = Math.max(enters, Math.min(a, b));
    leaves = Math.min(leaves, Math.max(a, b));
  }
  return enters <= leaves ? enters : Number.POSITIVE_INFINITY;
}

/** A half-space: points with `dot(normal, p) <= offset` are inside. The normal has length 1. */
export interface Plane {
  readonly normal: Vec3;
  readonly offset: number;
}

/** The planes of a box. */
export function planesOfBounds(bounds: Bounds): Plane[] {
  const axes: Vec3[] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  return axes.flatMap((axis) => [
    { normal: axis, offset: dot(axis, bounds.max) },
    { normal: scale(axis, -1), offset: -dot(axis, bounds.min) },
  ]);
}

/** The planes of a convex hull whose faces run counter-clockwise seen from outside; faces without area are left out. */
export function planesOfHull(points: readonly Vec3[], faces: readonly (readonly number[])[]): Plane[] {
  const planes: Plane[] = [];
  for (const face of faces) {
    const corners = face.map((index) => points[index]).filter((corner) => corner !== undefined);
    const normal = polygonNormal(corners);
    const first = corners[0];
    if (normal && first) planes.push({ normal, offset: dot(normal, first) });
  }
  return planes;
}

/** Unit normal of a convex polygon, or `undefined` when it has no area. */
export function polygonNormal(corners: readonly Vec3[]): Vec3 | undefined {
  const first = corners[0];
  if (!first) return undefined;
  let doubleArea: Vec3 = [0, 0, 0];
  for (let i = 1; i + 1 < corners.length; i += 1) {
    const [b, c] = [corners[i], corners[i + 1]];
    if (b && c) doubleArea = add(doubleArea, cross(subtract(b, first), subtract(c, first)));
  }
  const size = length(doubleArea);
  return size > 1e-12 ? scale(doubleArea, 1 / size) : undefined;
}

/** Whether a point lies in all half-spaces, give or take `slack` metres. */
export function insidePlanes(planes: readonly Plane[], point: Vec3, slack = 0): boolean {
  return planes.every((plane) => dot(plane.normal, point) <= plane.offset + slack);
}

/** Distance in metres from a point to a convex polygon, zero on it. */
export function distanceToPolygon(corners: readonly Vec3[], point: Vec3): number {
  const normal = polygonNormal(corners);
  const first = corners[0];
  if (!normal || !first) return Number.POSITIVE_INFINITY;
  let inside = true;
  let nearest = Number.POSITIVE_INFINITY;
  corners.forEach((corner, i) => {
    const next = corners[(i + 1) % corners.length] ?? corner;
    const edge = subtract(next, corner);
    if (dot(cross(edge, subtract(point, corner)), normal) < 0) inside = false;
    const along = Math.min(1, Math.max(0, dot(subtract(point, corner), edge) / Math.max(dot(edge, edge), 1e-12)));
    nearest = Math.min(nearest, length(subtract(point, add(corner, scale(edge, along)))));
  });
  return inside ? Math.abs(dot(normal, subtract(point, first))) : nearest;
}
