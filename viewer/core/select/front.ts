/**
 * What triangles does a cut of the cluster tree give? Those that came with the splits that are made, each corner in the
 * cluster that holds it.
 *
 * A split can be made when the one before it in the tree is, and undone when none after it is. What it does is found from
 * the finest triangles alone, whatever else is made: a corner moves to the new vertex if the vertex that it has in
 * the end came from that; and a triangle that came with the split has two corners at its two vertices, and the third in a
 * cluster that was told apart from them before, so no triangle ever has a corner twice.
 */
import { NONE } from "../smooth/mesh.ts";
import type { ClusterTree } from "./tree.ts";

/** Numbers in an order that only what was done to them tells. */
class Bag {
  readonly numbers: Int32Array;
  length = 0;
  private readonly places: Int32Array;

  constructor(room: number) {
    this.numbers = new Int32Array(room);
    this.places = new Int32Array(room).fill(NONE);
  }

  has(number: number): boolean {
    return this.places[number] !== NONE;
  }

  put(number: number): void {
    this.places[number] = this.length;
    this.numbers[this.length] = number;
    this.length += 1;
  }

  /** Takes a number out; the last one gets its place. */
  take(number: number): void {
    const place = this.places[number] as number;
    this.length -= 1;
    const moved = this.numbers[this.length] as number;
    this.numbers[place] = moved;
    this.places[moved] = place;
    this.places[number] = NONE;
  }
}

/** One cut. */
export class Front {
  /** The clusters, by vertex, and the triangles that are drawn, by number. */
  readonly active: Bag;
  readonly drawn: Bag;
  /** Of each cluster: the split that comes next. */
  readonly next: Int32Array;
  /** Where the corners of drawn triangles are, and their wedges: three each. */
  readonly corners: Int32Array;
  readonly wedges: Int32Array;
  /** The corners in each cluster, 3 · triangle + side, as lists with links both ways. */
  private readonly heads: Int32Array;
  private readonly after: Int32Array;
  private readonly before: Int32Array;

  /** Nothing but the root. */
  constructor(private readonly tree: ClusterTree) {
    const corners = tree.triangles.length;
    this.active = new Bag(tree.vertices);
    this.drawn = new Bag(corners / 3);
    this.next = tree.firstChild.slice();
    this.corners = new Int32Array(corners).fill(NONE);
    this.wedges = new Int32Array(tree.corners.length).fill(NONE);
    this.heads = new Int32Array(tree.vertices).fill(NONE);
    this.after = new Int32Array(corners).fill(NONE);
    this.before = new Int32Array(corners).fill(NONE);
    if (tree.vertices > 0) this.active.put(0);
  }

  /** Whether a made split is the last of its row on both sides, so that it can be undone. */
  isLast(vertex: number): boolean {
    const sibling = this.tree.nextSibling[vertex] as number;
    const child = this.tree.firstChild[vertex] as number;
    return (sibling === NONE || !this.active.has(sibling)) && (child === NONE || !this.active.has(child));
  }

  /** Shows the triangles in a cluster. */
  around(cluster: number, show: (a: number, b: number, c: number) => void): void {
    for (let corner = this.heads[cluster] as number; corner !== NONE; corner = this.after[corner] as number) {
      const first = corner - (corner % 3);
      show(this.corners[first] as number, this.corners[first + 1] as number, this.corners[first + 2] as number);
    }
  }

  /** Makes the next split of a cluster. Gives how many corners it looked at. */
  split(fresh: number): number {
    const { tree } = this;
    const old = tree.parent[fresh] as number;
    let work = 0;
    let corner = this.heads[old] as number;
    while (corner !== NONE) {
      const next = this.after[corner] as number;
      if (tree.holds(fresh, tree.triangles[corner] as number)) {
        this.takeOut(old, corner);
        this.putIn(fresh, corner);
      }
      corner = next;
      work += 1;
    }
    this.active.put(fresh);
    this.next[old] = tree.nextSibling[fresh] as number;
    const end = tree.born[fresh + 1] as number;
    for (let triangle = tree.born[fresh] as number; triangle < end; triangle += 1) {
      this.drawn.put(triangle);
      for (corner = 3 * triangle; corner < 3 * triangle + 3; corner += 1) {
        let cluster = tree.triangles[corner] as number;
        while (!this.active.has(cluster)) cluster = tree.parent[cluster] as number;
        this.putIn(cluster, corner);
      }
      work += 3;
    }
    return work;
  }

  /** Undoes a split after which none is made. Gives how many corners it looked at. */
  merge(fresh: number): number {
    const { tree } = this;
    const old = tree.parent[fresh] as number;
    let work = 0;
    const first = tree.born[fresh] as number;
    for (let triangle = (tree.born[fresh + 1] as number) - 1; triangle >= first; triangle -= 1) {
      for (let corner = 3 * triangle; corner < 3 * triangle + 3; corner += 1) {
        this.takeOut(this.corners[corner] as number, corner);
      }
      this.drawn.take(triangle);
      work += 3;
    }
    let corner = this.heads[fresh] as number;
    while (corner !== NONE) {
      const next = this.after[corner] as number;
      this.takeOut(fresh, corner);
      this.putIn(old, corner);
      corner = next;
      work += 1;
    }
    this.active.take(fresh);
    this.next[old] = fresh;
    return work;
  }

  private putIn(cluster: number, corner: number): void {
    const head = this.heads[cluster] as number;
    this.heads[cluster] = corner;
    this.after[corner] = head;
    this.before[corner] = NONE;
    if (head !== NONE) this.before[head] = corner;
    this.corners[corner] = cluster;
    if (corner < this.wedges.length) {
      this.wedges[corner] = this.tree.wedgeIn(cluster, this.tree.corners[corner] as number);
    }
  }

  private takeOut(cluster: number, corner: number): void {
    const before = this.before[corner] as number;
    const after = this.after[corner] as number;
    if (before === NONE) this.heads[cluster] = after;
    else this.after[before] = after;
    if (after !== NONE) this.before[after] = before;
  }
}
