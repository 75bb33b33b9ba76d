/**
 * In what order is a smooth LOD told? In passes over all vertices known so far (`docs/SLOD.md` §4): each says whether
 * the lattice becomes finer, and then of every vertex whether it is split, and how.
 */
import { Attributes } from "./attributes.ts";
import { Change } from "./change.ts";
import { Star } from "./fan.ts";
import { Placer } from "./geometry.ts";
import { type Header, mostPlaces } from "./header.ts";
import { Mesh, NONE } from "./mesh.ts";
import { damaged, ModelSpace, Reader } from "./rans.ts";
import { Split } from "./split.ts";

/** Where in the stream one is: before a pass, a vertex's lowest bits, its flag, its extra triangles, its place. */
const PASS = 0;
const REFINE = 1;
const VISIT = 2;
const EXTRA = 3;
const PLACE = 4;
const END = 5;

/** The mesh so far, and where in the stream one is. */
export class Replay {
  readonly mesh = new Mesh();
  readonly attributes: Attributes;
  readonly reader: Reader;
  /** Bits that the lattice still lacks. */
  coarseBits: number;

  private phase = PASS;
  /** The vertex that the phase is about. */
  private vertex = 0;
  /** So many more bits come after these in this pass. */
  private moreBits = 0;
  private pass = 0;
  /** Vertices at the beginning of the pass. */
  private known = 0;
  private sizes = 0;
  private meanSize = 0;
  private readonly mostPlaces: number;
  private readonly star = new Star();
  private readonly split: Split;
  private readonly change = new Change();
  private readonly placer: Placer;
  private readonly passModel: number;
  private readonly lowBits: number;
  private readonly flags: number;

  constructor(private readonly header: Header) {
    const models = new ModelSpace();
    this.passModel = models.nibbles(1);
    this.lowBits = models.nibbles(8);
    this.flags = models.bits(9 * 12 * 2);
    this.split = new Split(models);
    this.placer = new Placer(header, models);
    this.attributes = new Attributes(header, models);
    this.reader = new Reader(models);
    this.coarseBits = header.bits;
    this.mostPlaces = mostPlaces(header);
  }

  get isEnd(): boolean {
    return this.phase === END;
  }

  /** While the lattice becomes finer, how many vertices, in order of birth, already are on the finer one. */
  get refined(): number {
    return this.phase === REFINE ? this.vertex : 0;
  }

  /** There is nothing to tell. */
  finish(): void {
    this.phase = END;
  }

  /** Goes on as far as the bytes reach, or to the end when the stream is whole. */
  run(isWhole: boolean): void {
    while (this.phase !== END && (isWhole || this.reader.left >= this.stepBytes())) {
      if (this.phase === VISIT) this.visit();
      else if (this.phase === PLACE) this.place();
      else if (this.phase === REFINE) this.refine();
      else if (this.phase === EXTRA) this.extra();
      else this.begin();
      if (this.reader.starved) damaged("it ends before its mesh does");
    }
  }

  /** Bytes that the next step takes at most. */
  private stepBytes(): number {
    if (this.phase === VISIT) return 16 + 5 * (this.mesh.stars.length[this.vertex] as number);
    if (this.phase === EXTRA) return 16 + 8 * this.split.extras;
    if (this.phase === PLACE) {
      const corners = this.star.spokes + 3 * (2 * this.star.fans + this.split.extraThird.length);
      return 32 + this.attributes.stepBytes(corners);
    }
    return 16;
  }

  private begin(): void {
    const found = this.reader.number(this.passModel);
    if (this.reader.starved) return;
    if (found === 0) {
      this.phase = END;
      return;
    }
    if (found - 1 > this.coarseBits) damaged("its lattice becomes finer than it can");
    this.pass = (this.pass + 1) & 255;
    this.known = this.mesh.vertices;
    this.vertex = 0;
    this.moreBits = found - 2;
    if (found > 1) this.phase = REFINE;
    else this.visitAll();
  }

  private visitAll(): void {
    this.meanSize = Math.floor(this.sizes / this.known);
    this.phase = VISIT;
    this.vertex = 0;
  }

  private refine(): void {
    const { mesh, vertex } = this;
    const parent = mesh.parent[vertex] as number;
    // Where a coordinate equalled that of the vertex it was split from, it likely still does.
    let same = 0;
    let parentsBits = 0;
    if (parent < vertex) {
      for (let axis = 0; axis < 3; axis += 1) {
        const parents = mesh.at[3 * parent + axis] as number;
        if (parents >> 1 === mesh.at[3 * vertex + axis]) same |= 1 << axis;
        parentsBits |= (parents & 1) << axis;
      }
    }
    const bits = this.reader.symbol(this.lowBits + same) ^ (parentsBits & same);
    if (this.reader.starved) return;
    mesh.refine(vertex, bits);
    this.vertex += 1;
    if (this.vertex === this.known) this.endLattice();
  }

  private endLattice(): void {
    const { mesh } = this;
    this.coarseBits -= 1;
    this.sizes = 0;
    for (let vertex = 0; vertex < mesh.vertices; vertex += 1) {
      mesh.size[vertex] = Math.min((mesh.size[vertex] as number) + 2, 31);
      this.sizes += mesh.size[vertex] as number;
    }
    this.vertex = 0;
    this.moreBits -= 1;
    if (this.moreBits >= 0) return;
    mesh.addUp();
    this.visitAll();
  }

  private visit(): void {
    const { mesh, vertex, reader } = this;
    const size = Math.max(-4, Math.min(4, (mesh.size[vertex] as number) - this.meanSize)) + 4;
    const valence = Math.min(mesh.stars.length[vertex] as number, 11);
    const recent = (((mesh.pass[vertex] as number) + 1) & 255) === this.pass ? 1 : 0;
    if (reader.bit(this.flags + 2 * (12 * size + valence) + recent) === 0) {
      if (!reader.starved) this.goOn(mesh.next[vertex] as number);
      return;
    }
    this.star.read(mesh, vertex);
    this.split.readFans(reader, mesh, vertex, this.star);
    this.phase = this.split.extras > 0 ? EXTRA : PLACE;
  }

  private goOn(next: number): void {
    this.phase = next === NONE ? PASS : VISIT;
    this.vertex = next;
  }

  private extra(): void {
    if (this.split.extras > this.header.triangles - this.mesh.triangles) {
      damaged("it has more triangles than its header says");
    }
    this.split.readExtra(this.reader, this.mesh, this.star);
    for (let i = 0; i < this.split.extraThird.length; i += 1) {
      if (this.split.extraThird.at(i) === this.vertex) damaged("a triangle has a corner twice");
    }
    this.phase = PLACE;
  }

  private place(): void {
    const { mesh, star, split, change, placer, reader, vertex, header } = this;
    const first = mesh.triangles;
    change.layOut(star, split, first);
    const born = change.third.length + split.extraThird.length;
    if (mesh.vertices >= header.vertices || first + born > header.triangles) {
      damaged("it has more vertices or triangles than its header says");
    }
    placer.look(mesh, star, split, change, vertex);
    placer.read(reader, mesh.shared[vertex] as number);
    if (reader.starved) return;
    const end = 1 << (header.bits - this.coarseBits);
    for (let axis = 0; axis < 3; axis += 1) {
      const at = (mesh.at[3 * vertex + axis] as number) + (placer.step[axis] as number);
      if (at < 0 || at >= end) damaged("a vertex lies outside of the box");
    }
    this.sizes += 2 * placer.size - (mesh.size[vertex] as number);
    const fresh = mesh.addVertex();
    for (let axis = 0; axis < 3; axis += 1) {
      mesh.at[3 * fresh + axis] = (mesh.at[3 * vertex + axis] as number) + (placer.step[axis] as number);
    }
    mesh.parent[fresh] = vertex;
    const next = mesh.next[vertex] as number;
    mesh.next[fresh] = next;
    mesh.next[vertex] = fresh;
    mesh.size[vertex] = placer.size;
    mesh.size[fresh] = placer.size;
    mesh.pass[vertex] = this.pass;
    mesh.pass[fresh] = this.pass;
    mesh.shared[fresh] = placer.shared;
    change.apply(mesh, star, split, vertex, fresh);
    this.attributes.dress(reader, mesh, vertex, fresh, first, placer.size);
    if (mesh.stars.placeCount > this.mostPlaces) damaged("its vertices have more triangles than they can");
    this.goOn(next);
  }
}
