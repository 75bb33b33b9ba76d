/**
 * How do the triangles around a vertex hang together? In fans: rows of triangles that share edges at the vertex
 * (`docs/SLOD.md` §6). Where the surface is manifold there is one, closed inside and open on a border.
 */
import type { Mesh } from "./mesh.ts";
import { FIRST, LENGTH, POINT } from "./stars.ts";

/** No star with more fans is put in order: it would take too long. */
const MOST_FANS = 24;

/** All triangles around one vertex. Its arrays have room for more than there are. */
export class Star {
  /**
   * A spoke is a triangle, where in the mesh's corners its vertex stands, and its two other corners, in its sense of
   * rotation. Fan by fan.
   */
  spokes = 0;
  triangle = new Int32Array(0);
  corner = new Int32Array(0);
  from = new Int32Array(0);
  to = new Int32Array(0);
  /** First spoke of each fan, how many it has, and 1 if its last spoke ends where its first begins. */
  fans = 0;
  fanFirst = new Int32Array(0);
  fanLength = new Int32Array(0);
  fanClosed = new Int32Array(0);
  /** Fans that are not yet in order, and the spokes in their new one. */
  private readonly left = new Int32Array(MOST_FANS);
  private order = new Int32Array(0);
  private spare = new Int32Array(0);

  /** Reads the star of a vertex, joins fans that fit together. */
  read(mesh: Mesh, vertex: number): void {
    const { corners, points } = mesh;
    const { places } = mesh.stars;
    const begin = points[POINT * vertex + FIRST] as number;
    const count = points[POINT * vertex + LENGTH] as number;
    if (count > this.triangle.length) this.widen(2 * count + 16);
    const { triangle, corner, from, to } = this;
    for (let i = 0; i < count; i += 1) {
      const t = places[begin + i] as number;
      const first = 3 * t;
      // Nobody can guess which corner it is, so there is no branch.
      const isSecond = isZero((corners[first + 1] as number) - vertex);
      const isThird = isZero((corners[first + 2] as number) - vertex);
      triangle[i] = t;
      corner[i] = first + isSecond + 2 * isThird;
      from[i] = corners[first + 1 + isSecond - isThird] as number;
      to[i] = corners[first + 2 - 2 * isSecond - isThird] as number;
    }
    this.spokes = count;
    this.findFans();
    if (this.fans > 1 && this.fans <= MOST_FANS) this.join();
  }

  private widen(room: number): void {
    this.triangle = new Int32Array(room);
    this.corner = new Int32Array(room);
    this.from = new Int32Array(room);
    this.to = new Int32Array(room);
    this.fanFirst = new Int32Array(room);
    this.fanLength = new Int32Array(room);
    this.fanClosed = new Int32Array(room);
  }

  private findFans(): void {
    const { spokes, from, to, fanFirst, fanLength, fanClosed } = this;
    let fans = 0;
    for (let first = 0; first < spokes; fans += 1) {
      let end = first + 1;
      let last = to[first] as number;
      while (end < spokes && from[end] === last) {
        last = to[end] as number;
        end += 1;
      }
      fanFirst[fans] = first;
      fanLength[fans] = end - first;
      fanClosed[fans] = end > first + 1 && last === from[first] ? 1 : 0;
      first = end;
    }
    this.fans = fans;
  }

  /** Puts an open fan behind another that ends where it begins, as often as possible. */
  private join(): void {
    const { fanFirst, fanLength, fanClosed, left } = this;
    let count = this.fans;
    for (let i = 0; i < count; i += 1) left[i] = i;
    if (this.spokes > this.order.length) this.order = new Int32Array(this.triangle.length);
    let placed = 0;
    while (count > 0) {
      let fan = left[0] as number;
      count = this.takeOut(0, count);
      // Begin where nothing comes before, if there is such a place on this row of fans.
      for (let steps = count; !fanClosed[fan] && steps > 0; steps -= 1) {
        const before = this.endsAt(this.from[fanFirst[fan] as number] as number, count);
        if (before < 0) break;
        const found = left[before] as number;
        left[before] = fan;
        fan = found;
      }
      for (;;) {
        const first = fanFirst[fan] as number;
        const length = fanLength[fan] as number;
        for (let i = 0; i < length; i += 1) this.order[placed + i] = first + i;
        placed += length;
        const after = fanClosed[fan] ? -1 : this.beginsAt(this.to[first + length - 1] as number, count);
        if (after < 0) break;
        fan = left[after] as number;
        count = this.takeOut(after, count);
      }
    }
    this.triangle = this.reordered(this.triangle);
    this.corner = this.reordered(this.corner);
    this.from = this.reordered(this.from);
    this.to = this.reordered(this.to);
    this.findFans();
  }

  /** Takes out one of the fans that are left; gives how many are left then. */
  private takeOut(at: number, count: number): number {
    const { left } = this;
    for (let i = at + 1; i < count; i += 1) left[i - 1] = left[i] as number;
    return count - 1;
  }

  /** Which of the open fans left ends at a vertex; −1 if none. */
  private endsAt(vertex: number, count: number): number {
    const { left, fanFirst, fanLength, fanClosed, to } = this;
    for (let i = 0; i < count; i += 1) {
      const fan = left[i] as number;
      const last = (fanFirst[fan] as number) + (fanLength[fan] as number) - 1;
      if (to[last] === vertex && !fanClosed[fan]) return i;
    }
    return -1;
  }

  /** Which of the open fans left begins at a vertex; −1 if none. */
  private beginsAt(vertex: number, count: number): number {
    const { left, fanFirst, fanClosed, from } = this;
    for (let i = 0; i < count; i += 1) {
      const fan = left[i] as number;
      if (from[fanFirst[fan] as number] === vertex && !fanClosed[fan]) return i;
    }
    return -1;
  }

  /** The numbers of spokes in their new order; takes the place of `spare`, which takes that of the old ones. */
  private reordered(old: Int32Array<ArrayBuffer>): Int32Array<ArrayBuffer> {
    const { spokes, order } = this;
    const fresh = this.spare.length < old.length ? new Int32Array(old.length) : this.spare;
    for (let i = 0; i < spokes; i += 1) fresh[i] = old[order[i] as number] as number;
    this.spare = old;
    return fresh;
  }
}

/** 1 for 0, and 0 for all other whole numbers of less than 32 bits. */
export function isZero(number: number): number {
  return ((number | (0 - number)) >>> 31) ^ 1;
}
