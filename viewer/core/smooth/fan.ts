/**
 * How do the triangles around a vertex hang together? In fans: rows of triangles that share edges at the vertex
 * (`docs/SLOD.md` §6). Where the surface is manifold there is one, closed inside and open on a border.
 */
import { IntList } from "./list.ts";
import type { Mesh } from "./mesh.ts";
import { FIRST, LENGTH, POINT } from "./stars.ts";

/** No star with more fans is put in order: it would take too long. */
const MOST_FANS = 24;

interface Fan {
  readonly first: number;
  readonly length: number;
  readonly closed: boolean;
}

/** All triangles around one vertex. */
export class Star {
  /** A spoke is a triangle and its two other corners, in its sense of rotation. Fan by fan. */
  readonly triangle = new IntList();
  readonly from = new IntList();
  readonly to = new IntList();
  /** First spoke of each fan, how many it has, and 1 if its last spoke ends where its first begins. */
  readonly fanFirst = new IntList();
  readonly fanLength = new IntList();
  readonly fanClosed = new IntList();

  get spokes(): number {
    return this.triangle.length;
  }

  get fans(): number {
    return this.fanFirst.length;
  }

  /** Reads the star of a vertex, joins fans that fit together. */
  read(mesh: Mesh, vertex: number): void {
    const { corners, points } = mesh;
    const { places } = mesh.stars;
    const first = points[POINT * vertex + FIRST] as number;
    const length = points[POINT * vertex + LENGTH] as number;
    const triangle = this.triangle.room(length);
    const from = this.from.room(length);
    const to = this.to.room(length);
    for (let i = 0; i < length; i += 1) {
      const t = places[first + i] as number;
      const a = corners[3 * t] as number;
      const b = corners[3 * t + 1] as number;
      const c = corners[3 * t + 2] as number;
      triangle[i] = t;
      if (a === vertex) {
        from[i] = b;
        to[i] = c;
      } else if (b === vertex) {
        from[i] = c;
        to[i] = a;
      } else {
        from[i] = a;
        to[i] = b;
      }
    }
    this.triangle.length = length;
    this.findFans();
    if (this.fans > 1 && this.fans <= MOST_FANS) this.join();
  }

  private findFans(): void {
    const count = this.spokes;
    const from = this.from.values;
    const to = this.to.values;
    const fanFirst = this.fanFirst.room(count);
    const fanLength = this.fanLength.room(count);
    const fanClosed = this.fanClosed.room(count);
    let fans = 0;
    for (let first = 0; first < count; fans += 1) {
      let end = first + 1;
      let last = to[first] as number;
      while (end < count && from[end] === last) {
        last = to[end] as number;
        end += 1;
      }
      fanFirst[fans] = first;
      fanLength[fans] = end - first;
      fanClosed[fans] = end > first + 1 && last === from[first] ? 1 : 0;
      first = end;
    }
    this.fanFirst.length = fans;
  }

  /** Puts an open fan behind another that ends where it begins, as often as possible. */
  private join(): void {
    const left: Fan[] = [];
    for (let i = 0; i < this.fans; i += 1) {
      left.push({ first: this.fanFirst.at(i), length: this.fanLength.at(i), closed: this.fanClosed.at(i) === 1 });
    }
    const begin = (fan: Fan) => this.from.at(fan.first);
    const end = (fan: Fan) => this.to.at(fan.first + fan.length - 1);
    const order: number[] = [];
    for (let taken = left.shift(); taken; taken = left.shift()) {
      let fan = taken;
      // Begin where nothing comes before, if there is such a place on this row of fans.
      for (let steps = left.length; !fan.closed && steps > 0; steps -= 1) {
        const wanted = begin(fan);
        const before = left.findIndex((other) => !other.closed && end(other) === wanted);
        if (before < 0) break;
        const found = left[before] as Fan;
        left[before] = fan;
        fan = found;
      }
      for (;;) {
        for (let i = 0; i < fan.length; i += 1) order.push(fan.first + i);
        const wanted = end(fan);
        const after = fan.closed ? -1 : left.findIndex((other) => !other.closed && begin(other) === wanted);
        if (after < 0) break;
        fan = left.splice(after, 1)[0] as Fan;
      }
    }
    for (const list of [this.triangle, this.from, this.to]) list.values.set(order.map((i) => list.at(i)));
    this.findFans();
  }
}
