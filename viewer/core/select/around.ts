/**
 * How far is the surface off without one split? At a few points, the distance between the triangles around the old vertex
 * before it and those around both vertices after it, the larger of both ways: a Hausdorff distance in small.
 *
 * The points are the new vertex; of the triangles around it the middles, and those of the edges that lead to it; and the
 * middles of the same triangles before. Where many triangles meet, not all are looked at, so a split takes a
 * bounded time beside that of looking at each triangle once.
 */
import { IntList } from "../smooth/list.ts";
import { distanceBetween, squareToTriangle } from "./distance.ts";
import type { Front } from "./front.ts";

/** Of so many triangles there are points, and to so many their distance is found. */
const MOST_SHAPES = 16;
const MOST_NEAR = 128;

export class Around {
  private readonly before = new IntList();
  private readonly fresh = new IntList();
  private readonly after = new IntList();
  /** The positions of all vertices, and behind them that of a point. */
  private readonly at: Float64Array;
  private readonly point: number;

  constructor(positions: Float64Array) {
    this.at = new Float64Array(positions.length + 3);
    this.at.set(positions);
    this.point = positions.length;
  }

  /** Before the split: what is around the vertex that will be split. */
  readBefore(front: Front, old: number): void {
    read(this.before, front, old, Number.POSITIVE_INFINITY);
  }

  /** After it: how far apart both shapes are. At most as far as the two vertices. */
  difference(front: Front, old: number, fresh: number): number {
    const { at, point, before, after } = this;
    read(this.fresh, front, fresh, Number.POSITIVE_INFINITY);
    after.clear();
    for (let i = 0; i < Math.min(this.fresh.length, 3 * MOST_NEAR); i += 1) after.push(this.fresh.at(i));
    read(after, front, old, 6 * MOST_NEAR, false);
    const x = (at[3 * fresh] as number) - (at[3 * old] as number);
    const y = (at[3 * fresh + 1] as number) - (at[3 * old + 1] as number);
    const z = (at[3 * fresh + 2] as number) - (at[3 * old + 2] as number);
    // Nothing moves farther than the vertex does.
    const most = x * x + y * y + z * z;
    const near = Math.min(before.length, 3 * MOST_NEAR);
    let worst = this.square(3 * fresh, before, before.length, most);
    for (let i = 0; i < Math.min(this.fresh.length, 3 * MOST_SHAPES); i += 3) {
      const a = this.fresh.at(i);
      const b = this.fresh.at(i + 1);
      const c = this.fresh.at(i + 2);
      this.putMiddle(a, b, c);
      worst = Math.max(worst, this.square(point, before, near, most));
      const next = a === fresh ? b : b === fresh ? c : a;
      for (let axis = 0; axis < 3; axis += 1) {
        at[point + axis] = ((at[3 * fresh + axis] as number) + (at[3 * next + axis] as number)) / 2;
      }
      worst = Math.max(worst, this.square(point, before, near, most));
      if (a !== old && b !== old && c !== old) {
        this.putMiddle(a === fresh ? old : a, b === fresh ? old : b, c === fresh ? old : c);
        worst = Math.max(worst, this.square(point, after, after.length, most));
      }
    }
    return Math.min(Math.sqrt(worst), distanceBetween(at, 3 * fresh, 3 * old));
  }

  private putMiddle(a: number, b: number, c: number): void {
    const { at, point } = this;
    for (let axis = 0; axis < 3; axis += 1) {
      const sum = (at[3 * a + axis] as number) + (at[3 * b + axis] as number) + (at[3 * c + axis] as number);
      at[point + axis] = sum / 3;
    }
  }

  /** The least square of a point's distance from so many corners' triangles, and from nothing. */
  private square(point: number, corners: IntList, length: number, most: number): number {
    let least = most;
    for (let i = 0; i < length; i += 3) {
      const square = squareToTriangle(this.at, point, 3 * corners.at(i), 3 * corners.at(i + 1), 3 * corners.at(i + 2));
      if (square < least) least = square;
    }
    return least;
  }
}

/** Puts the corners of triangles in a cluster into a list, as long as that is shorter. */
function read(list: IntList, front: Front, cluster: number, most: number, anew = true): void {
  if (anew) list.clear();
  front.around(cluster, (a, b, c) => {
    if (list.length >= most) return;
    list.push(a);
    list.push(b);
    list.push(c);
  });
}
