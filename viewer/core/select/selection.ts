/**
 * How does a cut follow the eye from frame to frame? A round over its clusters, in which each is split once or undone if the
 * view says so; a frame does a part of a round, and the next goes on there (`docs/SLOD.md` §11).
 */
import type { SmoothDecoder } from "../smooth/decoder.ts";
import { NONE } from "../smooth/mesh.ts";
import { type Lattice, latticeOf, type Snapshot, snapshotOfLattice } from "../smooth/snapshot.ts";
import { Front } from "./front.ts";
import type { ClusterTree } from "./tree.ts";
import { isSame, keeps, type View, wants } from "./view.ts";

/** What one call did. */
export interface Progress {
  /** Splits that were made, and undone. */
  readonly splits: number;
  readonly merges: number;
  /** Clusters and corners that were looked at. */
  readonly work: number;
  /** Whether the cut is as the view wants it: further calls with the same view do nothing. */
  readonly isSettled: boolean;
}

/**
 * A cut of a smooth LOD that follows an eye. Always a valid mesh without cracks: corners that the whole mesh shares, it
 * shares.
 */
export class Selection {
  private front: Front;
  /** Splits that are never undone: those before this vertex. */
  private base = 0;
  private view: View | undefined;
  /** Where the round is, and how many clusters were left as they are since the last change. */
  private at = 0;
  private calm = 0;

  /**
   * Starts with the finest beginning of the stream that has no more triangles than this, and never has less: those of
   * a cut for a first picture, or 0 for nothing at all.
   */
  constructor(
    private tree: ClusterTree,
    private readonly leastTriangles: number,
  ) {
    this.front = new Front(tree);
    this.make(() => false);
  }

  /**
   * Goes on with what was decoded since: the tree of a longer beginning of the same stream. The cut stays, and what is
   * new is found by the next {@link update}. The order of triangles changes.
   */
  grow(tree: ClusterTree): void {
    const old = this.front.active;
    const known = this.tree.vertices;
    this.tree = tree;
    this.front = new Front(tree);
    this.make((vertex) => vertex < known && old.has(vertex));
    this.view = undefined;
  }

  /** Makes the base, and these splits. */
  private make(isMade: (vertex: number) => boolean): void {
    const { born, vertices } = this.tree;
    this.base = 0;
    while (this.base < vertices && (born[this.base + 1] as number) <= this.leastTriangles) this.base += 1;
    for (let vertex = 1; vertex < vertices; vertex += 1) {
      if (vertex < this.base || isMade(vertex)) this.front.split(vertex);
    }
  }

  /**
   * Splits and merges towards what a view wants, until that is reached or so much work is done (at most the last step
   * goes beyond it). The parts of the object take turns, so that none waits for ever while the eye moves on.
   */
  update(view: View, mostWork: number): Progress {
    const { front, tree } = this;
    const { active } = front;
    if (!(this.view && isSame(this.view, view))) {
      this.view = view;
      this.calm = 0;
    }
    let [splits, merges, work] = [0, 0, 0];
    while (this.calm < active.length && work < mostWork) {
      if (this.at >= active.length) this.at = 0;
      const vertex = active.numbers[this.at] as number;
      const next = front.next[vertex] as number;
      work += 1;
      this.calm += 1;
      if (next !== NONE && wants(view, tree, next)) {
        work += front.split(next);
        splits += 1;
        this.calm = 0;
      } else if (vertex >= Math.max(this.base, 1) && front.isLast(vertex) && !keeps(view, tree, vertex)) {
        work += front.merge(vertex);
        merges += 1;
        this.calm = 0;
        // The last cluster has its place now.
        continue;
      }
      this.at += 1;
    }
    return { splits, merges, work, isSettled: this.calm >= active.length };
  }

  /** How many clusters there are. */
  get clusters(): number {
    return this.front.active.length;
  }

  /** Numbers of the triangles that are drawn, in no particular order, but the same after the same calls. */
  get drawn(): Int32Array {
    return this.front.drawn.numbers.subarray(0, this.front.drawn.length);
  }

  /** Vertices at the corners of drawn triangles, three from 3 · number on. */
  get corners(): Int32Array {
    return this.front.corners;
  }

  /** Their wedges; empty without attributes. */
  get wedges(): Int32Array {
    return this.front.wedges;
  }

  /** The mesh to draw. The decoder is the one that the tree is of. */
  snapshot(decoder: SmoothDecoder): Snapshot {
    const { drawn } = this;
    const whole = latticeOf(decoder);
    const pick = (rows: Int32Array) => {
      const picked = new Int32Array(rows.length === 0 ? 0 : 3 * drawn.length);
      for (let i = 0; i < picked.length; i += 1) {
        picked[i] = rows[3 * (drawn[Math.floor(i / 3)] as number) + (i % 3)] as number;
      }
      return picked;
    };
    const materials = drawn.map((triangle) => whole.materials[triangle] as number);
    const lattice: Lattice = { ...whole, triangles: pick(this.corners), corners: pick(this.wedges), materials };
    return snapshotOfLattice(decoder.header, lattice);
  }
}
