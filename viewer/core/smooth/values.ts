/**
 * What values has a new wedge likely? A normal is expected to be that of the triangles around it, with some regard to
 * normals beside it; all else goes on evenly over the triangle that was there before the split (`docs/SLOD.md` §8).
 */
import { addCross, clear, shorten } from "./geometry.ts";
import type { IntList } from "./list.ts";
import type { Mesh } from "./mesh.ts";
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
  private readonly around = new Float64Array(3);
  private readonly part = new Float64Array(3);
  private readonly sum = new Float64Array(4);
  private readonly ways = new Float64Array(9);
  /** Where the new vertex lies on the triangle that was there, in 1/256 of its two edges from the old one. */
  private alongNext = 0;
  private alongBefore = 0;

  /** Of a normal, the first number of which is the wedge's `number`-th. `pending` are the corners of the new wedge. */
  ofNormal(mesh: Mesh, wedges: Wedges, pending: IntList, number: number): void {
    const { face, around, part } = this;
    clear(face);
    clear(around);
    const values = wedges.values.values;
    const corners = pending.values;
    for (let i = 0; i < pending.length; i += CORNER) {
      const triangle = corners[i] as number;
      const side = corners[i + 1] as number;
      this.addFace(mesh, triangle);
      for (let k = 1; k <= 3; k += 1) {
        const at = valuesOf(wedges, k < 3 ? cornerOf(wedges, triangle, side + k) : (corners[i + 2] as number));
        if (at < 0) continue;
        direction(values[at + number] as number, values[at + number + 1] as number, part);
        around[0] = (around[0] as number) + (part[0] as number);
        around[1] = (around[1] as number) + (part[1] as number);
        around[2] = (around[2] as number) + (part[2] as number);
      }
    }
    shorten(face);
    // What the triangles say counts eight times as much as the normals around.
    const counts = 8 * Math.max(reach(around), 127);
    const ofFace = Math.max(reach(face), 1);
    for (let axis = 0; axis < 3; axis += 1) {
      part[axis] = ((around[axis] as number) + Math.trunc(((face[axis] as number) * counts) / ofFace)) | 0;
    }
    nearest(part[0] as number, part[1] as number, part[2] as number, this.numbers);
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
    const values = wedges.values;
    clear(sum);
    sum[3] = 0;
    let told = 0;
    for (let i = 0; i < pending.length; i += CORNER) {
      const triangle = pending.at(i);
      const side = pending.at(i + 1);
      const was = valuesOf(wedges, pending.at(i + 2));
      const next = valuesOf(wedges, cornerOf(wedges, triangle, side + 1));
      const before = valuesOf(wedges, cornerOf(wedges, triangle, side + 2));
      if (was < 0 || next < 0 || before < 0) continue;
      this.findShares(mesh, triangle, side, old, fresh);
      for (let k = number; k < number + count; k += 1) {
        const p = values.at(was + k);
        const along = this.alongNext * (values.at(next + k) - p) + this.alongBefore * (values.at(before + k) - p);
        sum[k - number] = (sum[k - number] as number) + 256 * p + along;
      }
      told += 1;
    }
    if (told === 0) {
      for (let i = 0; i < pending.length; i += CORNER) {
        for (let k = 1; k <= 3; k += 1) {
          const wedge = k < 3 ? cornerOf(wedges, pending.at(i), pending.at(i + 1) + k) : pending.at(i + 2);
          const at = valuesOf(wedges, wedge);
          if (at < 0) continue;
          for (let n = 0; n < count; n += 1) sum[n] = (sum[n] as number) + 256 * values.at(at + number + n);
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
    const { ways } = this;
    const { points } = mesh;
    let longest = 0;
    for (let way = 0; way < 3; way += 1) {
      const vertex = way < 2 ? (mesh.corners[3 * triangle + ((side + 1 + way) % 3)] as number) : fresh;
      const there = POINT * vertex + AT;
      const here = POINT * old + AT;
      for (let axis = 0; axis < 3; axis += 1) {
        const relative = (points[there + axis] as number) - (points[here + axis] as number);
        ways[3 * way + axis] = relative;
        longest |= Math.abs(relative);
      }
    }
    // Ten bits are enough, and keep products small.
    const shift = Math.max(32 - Math.clz32(longest) - 10, 0);
    if (shift > 0) for (let i = 0; i < 9; i += 1) ways[i] = (ways[i] as number) >> shift;
    const nn = dot(ways, 0, 0);
    const nb = dot(ways, 0, 3);
    const bb = dot(ways, 3, 3);
    const nf = dot(ways, 0, 6);
    const bf = dot(ways, 3, 6);
    const area = nn * bb - nb * nb;
    this.alongNext = area === 0 ? 0 : share((bb * nf - nb * bf) * 256, area);
    this.alongBefore = area === 0 ? 0 : share((nn * bf - nb * nf) * 256, area);
  }
}

/** Of two of the ways, by their first numbers. */
function dot(ways: Float64Array, p: number, q: number): number {
  const first = (ways[p] as number) * (ways[q] as number) + (ways[p + 1] as number) * (ways[q + 1] as number);
  return first + (ways[p + 2] as number) * (ways[q + 2] as number);
}

function share(part: number, area: number): number {
  return Math.max(-1024, Math.min(1024, Math.trunc(part / area)));
}

function reach(v: Float64Array): number {
  return Math.abs(v[0] as number) + Math.abs(v[1] as number) + Math.abs(v[2] as number);
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
