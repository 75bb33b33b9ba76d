/**
 * In what order is a smooth LOD told? In passes over all vertices known so far (`docs/SLOD.md` §4): each says whether
 * the lattice becomes finer, and then of every vertex whether it is split, and how.
 */
import { Attributes } from "./attributes.ts";
import { Change } from "./change.ts";
import { Star } from "./fan.ts";
import { Placer } from "./geometry.ts";
import { type Header, mostPlaces } from "./header.ts";
import { bytesOf, IntList } from "./list.ts";
import { Looks, TOO_MANY_LOOKS } from "./looks.ts";
import { Mesh } from "./mesh.ts";
import { damaged, ModelSpace, Reader } from "./rans.ts";
import { Split } from "./split.ts";
import { AT, LENGTH, POINT } from "./stars.ts";

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
  /**
   * Vertices at the beginning of the pass in the order of the tree, in which parents come right before their children,
   * latest first; and those whose turn it was, with what came of them.
   */
  private order = new IntList();
  private visited = new IntList();
  /** The place in `order` of the one whose turn it is. */
  private turn = 0;
  /** So many more bits come after these in this pass. */
  private moreBits = 0;
  private pass = 0;
  private sizes = 0;
  private meanSize = 0;
  private readonly mostPlaces: number;
  private readonly looks: Looks;
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
    this.looks = new Looks(header);
    this.attributes = new Attributes(header, models, this.looks);
    this.reader = new Reader(models);
    this.coarseBits = header.bits;
    this.mostPlaces = mostPlaces(header);
    this.visited.push(0);
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

  /** Memory that it takes. */
  get bytes(): number {
    const { mesh, attributes, reader, order, visited } = this;
    return mesh.bytes + attributes.bytes + reader.modelBytes + bytesOf(order.values, visited.values);
  }

  /** All vertices in the order of the tree. */
  treeOrder(): Int32Array {
    const { order, visited, turn } = this;
    const all = new Int32Array(visited.length + order.length - turn);
    all.set(visited.values.subarray(0, visited.length));
    all.set(order.values.subarray(turn, order.length), visited.length);
    return all;
  }

  /** Goes on as far as `bytes` reach, or to the end when the stream is whole. */
  run(bytes: number, isWhole: boolean): void {
    this.reserve(bytes);
    while (this.phase !== END && (isWhole || this.reader.left >= this.stepBytes())) {
      if (this.phase === VISIT) this.visit(isWhole);
      else if (this.phase === PLACE) this.place();
      else if (this.phase === REFINE) this.refine();
      else if (this.phase === EXTRA) this.extra();
      else this.begin();
      if (this.reader.starved) damaged("it ends before its mesh does");
    }
  }

  /** Makes room for what may come out of so many bytes, so that arrays need not be copied as they grow. */
  private reserve(bytes: number): void {
    const vertices = Math.min(this.header.vertices, bytes);
    const triangles = Math.min(this.header.triangles, 2 * bytes);
    this.mesh.reserve(vertices, triangles);
    this.attributes.reserve(vertices, triangles, bytes);
    this.order.room(vertices);
    this.visited.room(vertices);
  }

  /** Bytes that the next step takes at most. */
  private stepBytes(): number {
    if (this.phase === VISIT) return visitBytes(this.mesh.points[POINT * this.vertex + LENGTH] as number);
    if (this.phase === EXTRA) return 16 + 8 * this.split.extras;
    if (this.phase === PLACE) {
      return this.placeBytes();
    }
    return 16;
  }

  /** Six residuals and which coordinates are shared; then corners: of moved triangles, and of those that are new. */
  private placeBytes(): number {
    const corners = this.star.spokes + 3 * (2 * this.star.fans + this.split.extraThird.length);
    return 32 + this.attributes.stepBytes(corners);
  }

  private begin(): void {
    const found = this.reader.number(this.passModel);
    if (this.reader.starved) return;
    if (found === 0) {
      this.phase = END;
      return;
    }
    if (found - 1 > this.coarseBits) damaged("its lattice becomes finer than it can");
    this.looks.take(this.mesh.vertices);
    if (this.looks.areUsedUp) damaged(TOO_MANY_LOOKS);
    this.pass = (this.pass + 1) & 255;
    const { order } = this;
    this.order = this.visited;
    this.visited = order;
    order.clear();
    this.turn = 0;
    this.vertex = 0;
    this.moreBits = found - 2;
    if (found > 1) this.phase = REFINE;
    else this.visitAll();
  }

  private visitAll(): void {
    this.meanSize = Math.floor(this.sizes / this.mesh.vertices);
    this.phase = VISIT;
    this.vertex = this.order.at(0);
  }

  private refine(): void {
    const { mesh, vertex } = this;
    const parent = mesh.parent[vertex] as number;
    // Where a coordinate equalled that of the vertex it was split from, it likely still does.
    let same = 0;
    let parentsBits = 0;
    if (parent < vertex) {
      const { points } = mesh;
      for (let axis = 0; axis < 3; axis += 1) {
        const parents = points[POINT * parent + AT + axis] as number;
        if (parents >> 1 === points[POINT * vertex + AT + axis]) same |= 1 << axis;
        parentsBits |= (parents & 1) << axis;
      }
    }
    const bits = this.reader.symbol(this.lowBits + same) ^ (parentsBits & same);
    if (this.reader.starved) return;
    mesh.refine(vertex, bits);
    this.vertex += 1;
    if (this.vertex === mesh.vertices) this.endLattice();
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

  /** Visits vertices as long as all goes its usual way and bytes have come. */
  private visit(isWhole: boolean): void {
    const { mesh, reader, visited, star, split, pass, meanSize } = this;
    while (this.phase === VISIT) {
      const { vertex } = this;
      const valence = mesh.points[POINT * vertex + LENGTH] as number;
      if (!isWhole && reader.left < visitBytes(valence)) return;
      const size = Math.max(-4, Math.min(4, (mesh.size[vertex] as number) - meanSize)) + 4;
      const recent = (((mesh.pass[vertex] as number) + 1) & 255) === pass ? 1 : 0;
      if (reader.bit(this.flags + 2 * (12 * size + Math.min(valence, 11)) + recent) === 0) {
        if (reader.starved) return;
        visited.push(vertex);
        this.goOn();
        continue;
      }
      star.read(mesh, vertex);
      split.readFans(reader, mesh, vertex, star);
      this.phase = split.extras > 0 ? EXTRA : PLACE;
      if (reader.starved || split.extras > 0 || (!isWhole && reader.left < this.placeBytes())) return;
      this.place();
      if (reader.starved) return;
    }
  }

  /** To the next vertex of the pass. */
  private goOn(): void {
    this.turn += 1;
    this.phase = this.turn === this.order.length ? PASS : VISIT;
    if (this.phase === VISIT) this.vertex = this.order.at(this.turn);
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
    change.layOut(star, split);
    const born = change.opened + split.extraThird.length;
    if (mesh.vertices >= header.vertices || first + born > header.triangles) {
      damaged("it has more vertices or triangles than its header says");
    }
    this.takeLooks();
    placer.look(mesh, star, split, change, vertex);
    placer.read(reader, mesh.shared[vertex] as number);
    if (reader.starved) return;
    const end = 1 << (header.bits - this.coarseBits);
    const x = (mesh.points[POINT * vertex + AT] as number) + (placer.step[0] as number);
    const y = (mesh.points[POINT * vertex + AT + 1] as number) + (placer.step[1] as number);
    const z = (mesh.points[POINT * vertex + AT + 2] as number) + (placer.step[2] as number);
    if (Math.min(x, y, z) < 0 || Math.max(x, y, z) >= end) damaged("a vertex lies outside of the box");
    this.sizes += 2 * placer.size - (mesh.size[vertex] as number);
    const fresh = mesh.addVertex();
    this.visited.push(vertex);
    this.visited.push(fresh);
    this.goOn();
    mesh.points[POINT * fresh + AT] = x;
    mesh.points[POINT * fresh + AT + 1] = y;
    mesh.points[POINT * fresh + AT + 2] = z;
    mesh.parent[fresh] = vertex;
    mesh.size[vertex] = placer.size;
    mesh.size[fresh] = placer.size;
    mesh.pass[vertex] = this.pass;
    mesh.pass[fresh] = this.pass;
    mesh.shared[fresh] = placer.shared;
    change.apply(mesh, star, split, vertex, fresh);
    this.attributes.dress(reader, mesh, vertex, fresh, first, placer.size);
    if (mesh.stars.placeCount > this.mostPlaces) damaged("its vertices have more triangles than they can");
    if (this.looks.areUsedUp) damaged(TOO_MANY_LOOKS);
  }

  /** For the star of the vertex that is split, and for the lists into which triangles of opened edges are put. */
  private takeLooks(): void {
    const { mesh, star, change, looks } = this;
    looks.take(star.spokes);
    for (let i = 0; i < change.opened; i += 1) {
      looks.takeForSearch(mesh.points[POINT * (change.third[i] as number) + LENGTH] as number);
    }
  }
}

/** Bytes that a visit takes at most. The worst are fans of one triangle: what becomes of it, how many, the first. */
function visitBytes(valence: number): number {
  return 16 + 5 * valence;
}
