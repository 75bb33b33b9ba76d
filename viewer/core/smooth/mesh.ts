/**
 * What does a partly decoded smooth LOD hold? Vertices on a lattice, triangles, and which triangles meet where
 * (`docs/SLOD.md` §3). Any triangles at all: no edge or vertex need be manifold.
 */
import { bytesOf, widened } from "./list.ts";
import { AROUND, AT, POINT, Stars } from "./stars.ts";

/** No vertex, no wedge. */
export const NONE = -1;

/** A mesh while it grows. Arrays of a vertex have room for more than `vertices`. */
export class Mesh {
  vertices = 0;
  triangles = 0;
  /**
   * Of each vertex {@link POINT} numbers, side by side since every split looks at a dozen vertices: the sum of the other
   * two corners over all its triangles, its coordinates on the present lattice, and the place of its list in `stars`.
   */
  points = new Int32Array(POINT * 16);
  /** The vertex that it was split from. */
  parent = new Int32Array(16);
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
  }

  /** Memory that it takes. */
  get bytes(): number {
    const { points, parent, size, shared, pass, born, corners, stars } = this;
    return bytesOf(points, parent, size, shared, pass, born, corners) + stars.bytes;
  }

  /** Makes room for so many vertices and triangles. */
  reserve(vertices: number, triangles: number): void {
    this.points = widened(this.points, POINT * vertices);
    this.parent = widened(this.parent, vertices);
    this.size = widened(this.size, vertices);
    this.shared = widened(this.shared, vertices);
    this.pass = widened(this.pass, vertices);
    this.born = widened(this.born, vertices);
    this.corners = widened(this.corners, 3 * triangles);
    this.stars.reserve(vertices);
  }

  /** A vertex at the lattice's beginning, without triangles. */
  addVertex(): number {
    const vertex = this.vertices;
    if (vertex === this.parent.length) this.reserve(2 * vertex, 0);
    this.born[vertex] = this.triangles;
    this.stars.add(this.points, vertex);
    this.vertices += 1;
    return vertex;
  }

  /** The triangle that comes where an edge opens; nobody's list knows of it yet. */
  bear(old: number, fresh: number, third: number, oldFirst: number): number {
    const triangle = this.triangles;
    const first = 3 * triangle;
    if (first === this.corners.length) this.corners = widened(this.corners, first + 3);
    const { corners } = this;
    corners[first] = oldFirst ? old : fresh;
    corners[first + 1] = oldFirst ? fresh : old;
    corners[first + 2] = third;
    this.triangles = triangle + 1;
    this.addAround(old, fresh, third);
    return triangle;
  }

  /** To the sum of each corner of a triangle, its two others. */
  private addAround(a: number, b: number, c: number): void {
    const { points } = this;
    for (let axis = 0; axis < 3; axis += 1) {
      const p = points[POINT * a + AT + axis] as number;
      const q = points[POINT * b + AT + axis] as number;
      const r = points[POINT * c + AT + axis] as number;
      points[POINT * a + AROUND + axis] = ((points[POINT * a + AROUND + axis] as number) + q + r) | 0;
      points[POINT * b + AROUND + axis] = ((points[POINT * b + AROUND + axis] as number) + p + r) | 0;
      points[POINT * c + AROUND + axis] = ((points[POINT * c + AROUND + axis] as number) + p + q) | 0;
    }
  }

  /** Which corner of a triangle a vertex is; the first if none. */
  sideOf(triangle: number, vertex: number): number {
    const { corners } = this;
    const first = 3 * triangle;
    if (corners[first] === vertex) return 0;
    return corners[first + 1] === vertex ? 1 : corners[first + 2] === vertex ? 2 : 0;
  }

  /** Halves the step of the lattice at a vertex. `bits` has its new lowest bits: x in bit 0, y, z. */
  refine(vertex: number, bits: number): void {
    const { points } = this;
    const at = POINT * vertex + AT;
    points[at] = ((points[at] as number) << 1) | (bits & 1);
    points[at + 1] = ((points[at + 1] as number) << 1) | ((bits >> 1) & 1);
    points[at + 2] = ((points[at + 2] as number) << 1) | ((bits >> 2) & 1);
  }

  /** Adds up the neighbours of all vertices anew, after the lattice became finer. */
  addUp(): void {
    const { corners, points } = this;
    for (let i = 0; i < POINT * this.vertices; i += POINT) {
      points[i + AROUND] = 0;
      points[i + AROUND + 1] = 0;
      points[i + AROUND + 2] = 0;
    }
    for (let i = 0; i < 3 * this.triangles; i += 3) {
      this.addAround(corners[i] as number, corners[i + 1] as number, corners[i + 2] as number);
    }
  }
}
