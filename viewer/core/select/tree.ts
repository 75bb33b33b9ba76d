/**
 * Which vertex was split from which, and what is lost without a split? The cluster tree of a decoded beginning of a smooth
 * LOD, with an error and a ball for each split (`docs/SLOD.md` §11).
 *
 * A split is named by the vertex that it brings. Two splits can only come after it: the first of that vertex, and the
 * next of the vertex that was split. So splits form a binary tree, and the splits that are made always hold its root.
 */
import type { SmoothDecoder } from "../smooth/decoder.ts";
import { NONE } from "../smooth/mesh.ts";
import { latticeOf } from "../smooth/snapshot.ts";
import { Around } from "./around.ts";
import { distanceBetween } from "./distance.ts";
import { Front } from "./front.ts";

/** More wedges of one vertex are not looked at. */
const MOST_WEDGES = 16;
const NO_NUMBERS = new Int32Array(0);

/** The clusters of a smooth LOD, as far as it was decoded when this was made. */
export class ClusterTree {
  readonly vertices: number;
  /** Three numbers for each vertex, in model space. A cluster is drawn where its first vertex is. */
  readonly positions: Float64Array;
  /** The vertex that was split; the first split of a vertex; the next split of the vertex that was split. */
  readonly parent: Int32Array;
  readonly firstChild: Int32Array;
  readonly nextSibling: Int32Array;
  /** Place in the order of the tree, in which a vertex comes right before all that came from it, and how many those are. */
  private readonly order: Int32Array;
  private readonly extent: Int32Array;
  /** The first triangle that came with a vertex; one more at the end. */
  readonly born: Int32Array;
  /** Vertices of the finest triangles, and their wedges if there are attributes. */
  readonly triangles: Int32Array;
  readonly corners: Int32Array;
  /** The vertex of a wedge, and the wedge that stands for it when that vertex is not told from its parent. */
  private readonly owner: Int32Array;
  private readonly above: Int32Array;
  /** By how much, in model-space units, the surface is off where this split and all after it are left out. */
  readonly errors: Float64Array;
  /** All triangles that this split or one after it changes lie so near to the vertex that is split. */
  readonly radii: Float64Array;

  /** The tree of what has been decoded so far. Takes one to two times as long as decoding it did. */
  constructor(decoder: SmoothDecoder) {
    const replay = decoder.decoded?.replay;
    const mesh = replay?.mesh;
    const lattice = latticeOf(decoder);
    const vertices = mesh?.vertices ?? 0;
    this.vertices = vertices;
    this.positions = new Float64Array(3 * vertices);
    this.parent = mesh?.parent.slice(0, vertices) ?? NO_NUMBERS;
    this.firstChild = new Int32Array(vertices).fill(NONE);
    this.nextSibling = new Int32Array(vertices).fill(NONE);
    this.order = new Int32Array(vertices);
    this.extent = new Int32Array(vertices).fill(1);
    this.born = new Int32Array(vertices + 1);
    this.triangles = lattice.triangles;
    this.corners = lattice.corners;
    this.errors = new Float64Array(vertices);
    this.radii = new Float64Array(vertices);
    const { header } = decoder;
    const stride = header?.stride ?? 0;
    const wedges = stride === 0 ? 0 : lattice.values.length / stride;
    this.owner = new Int32Array(wedges).fill(NONE);
    this.above = Int32Array.from({ length: wedges }, (_, wedge) => wedge);
    if (!(replay && mesh && header)) return;
    const halfStep = header.step * 0.5;
    for (let i = 0; i < this.positions.length; i += 1) {
      this.positions[i] = (header.origin[i % 3] as number) + halfStep * (lattice.twicePositions[i] as number);
    }
    this.born.set(mesh.born.subarray(0, vertices));
    this.born[vertices] = mesh.triangles;
    this.arrange(replay.treeOrder());
    this.findWedges(lattice.values, stride);
    this.measure();
  }

  private arrange(treeOrder: Int32Array): void {
    const { parent, firstChild, nextSibling, order, extent } = this;
    for (let vertex = this.vertices - 1; vertex > 0; vertex -= 1) {
      const above = parent[vertex] as number;
      nextSibling[vertex] = firstChild[above] as number;
      firstChild[above] = vertex;
      extent[above] = (extent[above] as number) + (extent[vertex] as number);
    }
    for (let place = 0; place < this.vertices; place += 1) order[treeOrder[place] as number] = place;
  }

  /** Whether a vertex is another, or came from it. */
  holds(cluster: number, vertex: number): boolean {
    const place = (this.order[vertex] as number) - (this.order[cluster] as number);
    return place >= 0 && place < (this.extent[cluster] as number);
  }

  /** The wedge that stands for another in a cluster that holds its vertex. */
  wedgeIn(cluster: number, wedge: number): number {
    let found = wedge;
    while (this.owner[found] !== cluster) {
      const above = this.above[found] as number;
      if (above === found || !this.holds(cluster, this.owner[above] as number)) break;
      found = above;
    }
    return found;
  }

  /** What stands for each wedge: of those that the nearest vertex above has, the one whose numbers are nearest. */
  private findWedges(values: Int32Array, stride: number): void {
    const { owner, above, corners, triangles, parent } = this;
    const wedges = owner.length;
    if (wedges === 0) return;
    for (let i = 0; i < corners.length; i += 1) owner[corners[i] as number] = triangles[i] as number;
    // Wedges of each vertex, lowest first.
    const latest = new Int32Array(this.vertices).fill(NONE);
    const later = new Int32Array(wedges).fill(NONE);
    for (let wedge = wedges - 1; wedge >= 0; wedge -= 1) {
      const vertex = owner[wedge] as number;
      if (vertex === NONE) continue;
      later[wedge] = latest[vertex] as number;
      latest[vertex] = wedge;
    }
    for (let wedge = 0; wedge < wedges; wedge += 1) {
      let vertex = owner[wedge] as number;
      if (vertex === NONE) continue;
      let other = NONE;
      while (other === NONE && vertex > 0) {
        vertex = parent[vertex] as number;
        other = latest[vertex] as number;
      }
      let nearest = Number.POSITIVE_INFINITY;
      for (let i = 0; i < MOST_WEDGES && other !== NONE; i += 1) {
        let distance = 0;
        for (let k = 0; k < stride; k += 1) {
          distance += Math.abs((values[wedge * stride + k] as number) - (values[other * stride + k] as number));
        }
        if (distance < nearest) {
          nearest = distance;
          above[wedge] = other;
        }
        other = later[other] as number;
      }
    }
  }

  /** Makes all splits in their order, and sees how far the surface is off without each. */
  private measure(): void {
    const { positions, parent, firstChild, nextSibling, triangles, errors, radii, vertices } = this;
    const front = new Front(this);
    const around = new Around(positions);
    const steps = new Float64Array(vertices);
    for (let vertex = 1; vertex < vertices; vertex += 1) {
      const old = parent[vertex] as number;
      around.readBefore(front, old);
      front.split(vertex);
      steps[vertex] = around.difference(front, old, vertex);
    }
    const rings = new Float64Array(vertices);
    for (let i = 0; i < triangles.length; i += 1) {
      const one = triangles[i] as number;
      const other = triangles[i % 3 === 2 ? i - 2 : i + 1] as number;
      const far = distanceBetween(positions, 3 * one, 3 * other);
      rings[one] = Math.max(rings[one] as number, far);
      rings[other] = Math.max(rings[other] as number, far);
    }
    for (let vertex = vertices - 1; vertex > 0; vertex -= 1) {
      const old = parent[vertex] as number;
      const sibling = nextSibling[vertex] as number;
      const child = firstChild[vertex] as number;
      const oldError = sibling === NONE ? 0 : (errors[sibling] as number);
      const oldRadius = sibling === NONE ? (rings[old] as number) : (radii[sibling] as number);
      const newError = child === NONE ? 0 : (errors[child] as number);
      const newRadius = child === NONE ? (rings[vertex] as number) : (radii[child] as number);
      errors[vertex] = (steps[vertex] as number) + Math.max(oldError, newError);
      radii[vertex] = Math.max(oldRadius, distanceBetween(positions, 3 * vertex, 3 * old) + newRadius);
    }
  }
}
