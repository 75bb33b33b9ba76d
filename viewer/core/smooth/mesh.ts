/**
 * What does a partly decoded smooth LOD hold? Vertices on a lattice, triangles, and which triangles meet where
 * (`docs/SLOD.md` §3). Any triangles at all: no edge or vertex need be manifold.
 */
import { bytesOf, widened } from "./list.ts";
import { Stars } from "./stars.ts";

/** No vertex, no wedge. */
export const NONE = -1;

/** A mesh while it grows. Arrays of a vertex have room for more than `vertices`. */
export class Mesh {
  vertices = 0;
  triangles = 0;
  /** Three coordinates of each vertex on the present lattice. */
  at = new Int32Array(48);
  /** Sum of the other two corners over all its triangles. */
  around = new Int32Array(48);
  /** The vertex that it was split from. */
  parent = new Int32Array(16);
  /** The one after it in the order of the tree. */
  next = new Int32Array(16);
  /** Class of the mean distance to its neighbours when it last took part in a split. */
  size = new Uint8Array(16);
  /** Which of its coordinates were those of vertices nearby: x in bit 0, y, z. */
  shared = new Uint8Array(16);
  /** The pass in which it came or was split last, modulo 256. */
  pass = new Uint8Array(16);
  /** How many triangles there were before it came. */
  born = new Int32Array(16);
  /** Three vertices of each triangle. */
  corners = new Int32Array(48);
  readonly stars = new Stars();

  constructor() {
    this.addVertex();
    this.next[0] = NONE;
  }

  /** Memory that it takes. */
  get bytes(): number {
    const { at, around, parent, next, size, shared, pass, born, corners, stars } = this;
    return bytesOf(at, around, parent, next, size, shared, pass, born, corners) + stars.bytes;
  }

  /** A vertex at the lattice's beginning, without triangles. */
  addVertex(): number {
    const vertex = this.vertices;
    if (vertex === this.parent.length) {
      const room = 2 * vertex;
      this.at = widened(this.at, 3 * room);
      this.around = widened(this.around, 3 * room);
      this.parent = widened(this.parent, room);
      this.next = widened(this.next, room);
      this.size = widened(this.size, room);
      this.shared = widened(this.shared, room);
      this.pass = widened(this.pass, room);
      this.born = widened(this.born, room);
    }
    this.born[vertex] = this.triangles;
    this.stars.add();
    this.vertices += 1;
    return vertex;
  }

  /** Puts a triangle at its end; nobody's list knows of it yet. */
  addTriangle(a: number, b: number, c: number): number {
    const triangle = this.triangles;
    const first = 3 * triangle;
    if (first === this.corners.length) this.corners = widened(this.corners, first + 3);
    this.corners[first] = a;
    this.corners[first + 1] = b;
    this.corners[first + 2] = c;
    this.triangles += 1;
    this.addAround(a, b, c);
    this.addAround(b, a, c);
    this.addAround(c, a, b);
    return triangle;
  }

  private addAround(vertex: number, one: number, other: number): void {
    const { at, around } = this;
    for (let axis = 0; axis < 3; axis += 1) {
      const sum = (at[3 * one + axis] as number) + (at[3 * other + axis] as number);
      around[3 * vertex + axis] = (around[3 * vertex + axis] as number) + sum;
    }
  }

  /** Which corner of a triangle a vertex is; the first if none. */
  sideOf(triangle: number, vertex: number): number {
    const first = 3 * triangle;
    if (this.corners[first + 1] === vertex && this.corners[first] !== vertex) return 1;
    return this.corners[first + 2] === vertex && this.corners[first] !== vertex ? 2 : 0;
  }

  /** Halves the step of the lattice at a vertex. `bits` has its new lowest bits: x in bit 0, y, z. */
  refine(vertex: number, bits: number): void {
    for (let axis = 0; axis < 3; axis += 1) {
      this.at[3 * vertex + axis] = ((this.at[3 * vertex + axis] as number) << 1) | ((bits >> axis) & 1);
    }
  }

  /** Adds up the neighbours of all vertices anew, after the lattice became finer. */
  addUp(): void {
    this.around.fill(0);
    const { corners } = this;
    for (let i = 0; i < 3 * this.triangles; i += 3) {
      const a = corners[i] as number;
      const b = corners[i + 1] as number;
      const c = corners[i + 2] as number;
      this.addAround(a, b, c);
      this.addAround(b, a, c);
      this.addAround(c, a, b);
    }
  }
}
