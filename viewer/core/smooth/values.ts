/**
 * What values has a new wedge likely? A normal is expected to be that of the triangles around it, with some regard to
 * normals beside it; all else goes on evenly over the triangle that was there before the split (`docs/SLOD.md` §8).
 */
import { addCross, clear, shorten } from "./geometry.ts";
import type { IntList } from "./list.ts";
import { type Mesh, NONE } from "./mesh.ts";
import { direction, nearest } from "./octahedron.ts";
import { AT, POINT } from "./stars.ts";

/** Numbers of all wedges that have been told, and the wedges of all triangles' corners. */
export interface Wedges {
  readonly stride: number;
  readonly values: IntList;
  readonly corners: IntList;
}

/** Numbers of a corner in a list of corners: triangle, which of its corners, and the wedge that it had before. */
export const CORNER = 3;

export class Expectation {
  /** What is expected of a channel's numbers. */
  readonly numbers = new Int32Array(4);
  private readonly face = new Float64Array(3);
  private readonly part = new Float64Array(3);
  private readonly sum = new Float64Array(4);
  /** Where the new vertex lies on the triangle that was there, in 1/256 of its two edges from the old one. */
  private alongNext = 0;
  private alongBefore = 0;

  /** Of a normal, the first number of which is the wedge's `number`-th. `pending` are the corners of the new wedge. */
  ofNormal(mesh: Mesh, wedges: Wedges, pending: IntList, number: number): void {
    const { face, part } = this;
    clear(face);
    const values = wedges.values.values;
    const told = wedges.values.length;
    const corners = pending.values;
    let aroundX = 0;
    let aroundY = 0;
    let aroundZ = 0;
    // Triangles beside each other share corners, and moved ones had the same wedge: most need only be looked at once.
    let beside = NONE;
    let besideX = 0;
    let besideY = 0;
    let besideZ = 0;
    let was = NONE;
    let wasX = 0;
    let wasY = 0;
    let wasZ = 0;
    for (let i = 0; i < pending.length; i += CORNER) {
      const triangle = corners[i] as number;
      const side = corners[i + 1] as number;
      this.addFace(mesh, triangle);
      for (let k = 1; k < 3; k += 1) {
        const wedge = cornerOf(wedges, triangle, side + k);
        if (wedge !== beside) {
          beside = wedge;
          directionOf(values, told, wedge * wedges.stride, wedges.stride, number, part);
          besideX = part[0] as number;
          besideY = part[1] as number;
          besideZ = part[2] as number;
        }
        aroundX += besideX;
        aroundY += besideY;
        aroundZ += besideZ;
      }
      if (corners[i + 2] !== was) {
        was = corners[i + 2] as number;
        directionOf(values, told, was * wedges.stride, wedges.stride, number, part);
        wasX = part[0] as number;
        wasY = part[1] as number;
        wasZ = part[2] as number;
      }
      aroundX += wasX;
      aroundY += wasY;
      aroundZ += wasZ;
    }
    shorten(face);
    // What the triangles say counts eight times as much as the normals around.
    const counts = 8 * Math.max(Math.abs(aroundX) + Math.abs(aroundY) + Math.abs(aroundZ), 127);
    const faceX = face[0] as number;
    const faceY = face[1] as number;
    const faceZ = face[2] as number;
    const ofFace = Math.max(Math.abs(faceX) + Math.abs(faceY) + Math.abs(faceZ), 1);
    const x = (aroundX + Math.trunc((faceX * counts) / ofFace)) | 0;
    const y = (aroundY + Math.trunc((faceY * counts) / ofFace)) | 0;
    const z = (aroundZ + Math.trunc((faceZ * counts) / ofFace)) | 0;
    nearest(x, y, z, this.numbers);
  }

  /** Of `count` numbers of anything else. */
  ofOther(
    mesh: Mesh,
    wedges: Wedges,
    pending: IntList,
    number: number,
    count: number,
    old: number,
    fresh: number,
  ): void {
    const { sum, numbers } = this;
    const values = wedges.values.values;
    clear(sum);
    sum[3] = 0;
    let told = 0;
    for (let i = 0; i < pending.length; i += CORNER) {
      const triangle = pending.at(i);
      const side = pending.at(i + 1);
      const was = valuesOf(wedges, pending.at(i + 2));
      if (was < 0) continue;
      const next = valuesOf(wedges, cornerOf(wedges, triangle, side + 1));
      const before = valuesOf(wedges, cornerOf(wedges, triangle, side + 2));
      if (next < 0 || before < 0) continue;
      this.findShares(mesh, triangle, side, old, fresh);
      const { alongNext, alongBefore } = this;
      for (let n = 0; n < count; n += 1) {
        const k = number + n;
        const p = values[was + k] as number;
        const along =
          alongNext * ((values[next + k] as number) - p) + alongBefore * ((values[before + k] as number) - p);
        sum[n] = (sum[n] as number) + 256 * p + along;
      }
      told += 1;
    }
    if (told === 0) {
      for (let i = 0; i < pending.length; i += CORNER) {
        for (let k = 1; k <= 3; k += 1) {
          const wedge = k < 3 ? cornerOf(wedges, pending.at(i), pending.at(i + 1) + k) : pending.at(i + 2);
          const at = valuesOf(wedges, wedge);
          if (at < 0) continue;
          for (let n = 0; n < count; n += 1) sum[n] = (sum[n] as number) + 256 * (values[at + number + n] as number);
          told += 1;
        }
      }
    }
    for (let n = 0; n < count; n += 1) {
      numbers[n] = told === 0 ? 0 : Math.floor((Math.trunc((sum[n] as number) / told) + 128) / 256);
    }
  }

  /** Adds a triangle's normal, as long as twice its area. */
  private addFace(mesh: Mesh, triangle: number): void {
    const { face } = this;
    const { points, corners } = mesh;
    const a = POINT * (corners[3 * triangle] as number) + AT;
    const b = POINT * (corners[3 * triangle + 1] as number) + AT;
    const c = POINT * (corners[3 * triangle + 2] as number) + AT;
    const x = points[a] as number;
    const y = points[a + 1] as number;
    const z = points[a + 2] as number;
    const bx = (points[b] as number) - x;
    const by = (points[b + 1] as number) - y;
    const bz = (points[b + 2] as number) - z;
    const cx = (points[c] as number) - x;
    const cy = (points[c + 1] as number) - y;
    const cz = (points[c + 2] as number) - z;
    addCross(face, bx, by, bz, cx, cy, cz);
  }

  private findShares(mesh: Mesh, triangle: number, side: number, old: number, fresh: number): void {
    const { points, corners } = mesh;
    const first = 3 * triangle;
    const here = POINT * old + AT;
    const next = POINT * (corners[first + (side < 2 ? side + 1 : 0)] as number) + AT;
    const before = POINT * (corners[first + (side > 0 ? side - 1 : 2)] as number) + AT;
    const there = POINT * fresh + AT;
    const x = points[here] as number;
    const y = points[here + 1] as number;
    const z = points[here + 2] as number;
    let nx = (points[next] as number) - x;
    let ny = (points[next + 1] as number) - y;
    let nz = (points[next + 2] as number) - z;
    let bx = (points[before] as number) - x;
    let by = (points[before + 1] as number) - y;
    let bz = (points[before + 2] as number) - z;
    let fx = (points[there] as number) - x;
    let fy = (points[there + 1] as number) - y;
    let fz = (points[there + 2] as number) - z;
    const longest =
      Math.abs(nx) | Math.abs(ny) | Math.abs(nz) | Math.abs(bx) | Math.abs(by) | Math.abs(bz) | Math.abs(fx);
    // Ten bits are enough, and keep products small.
    const shift = Math.max(22 - Math.clz32(longest | Math.abs(fy) | Math.abs(fz)), 0);
    nx >>= shift;
    ny >>= shift;
    nz >>= shift;
    bx >>= shift;
    by >>= shift;
    bz >>= shift;
    fx >>= shift;
    fy >>= shift;
    fz >>= shift;
    const nn = nx * nx + ny * ny + nz * nz;
    const nb = nx * bx + ny * by + nz * bz;
    const bb = bx * bx + by * by + bz * bz;
    const nf = nx * fx + ny * fy + nz * fz;
    const bf = bx * fx + by * fy + bz * fz;
    const area = nn * bb - nb * nb;
    this.alongNext = area === 0 ? 0 : share((bb * nf - nb * bf) * 256, area);
    this.alongBefore = area === 0 ? 0 : share((nn * bf - nb * nf) * 256, area);
  }
}

function share(part: number, area: number): number {
  return Math.max(-1024, Math.min(1024, Math.trunc(part / area)));
}

/** The direction of a normal whose wedge begins at `first`; none if that has not been told. Written to `to`. */
function directionOf(
  values: Int32Array,
  told: number,
  first: number,
  stride: number,
  number: number,
  to: Float64Array,
): void {
  if (first >= 0 && first + stride <= told) {
    direction(values[first + number] as number, values[first + number + 1] as number, to);
  } else {
    clear(to);
  }
}

/** The wedge of a corner; sides count on from 3 to 0. */
function cornerOf(wedges: Wedges, triangle: number, side: number): number {
  return wedges.corners.at(3 * triangle + (side < 3 ? side : side - 3));
}

/** Where the numbers of a wedge begin; −1 if they have not been told. */
function valuesOf(wedges: Wedges, wedge: number): number {
  const first = wedge * wedges.stride;
  return wedge >= 0 && first + wedges.stride <= wedges.values.length ? first : -1;
}
