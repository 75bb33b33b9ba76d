/**
 * What do corners look like? Normals, texture coordinates and colours with seams, and a material for each triangle
 * (`docs/SLOD.md` §8). A *wedge* is one set of attribute values at a vertex, shared by those corners there that have no
 * seam between them.
 */
import { type ChannelKind, type Header, numbersOf } from "./header.ts";
import { bytesOf, IntList } from "./list.ts";
import type { Looks } from "./looks.ts";
import { type Mesh, NONE } from "./mesh.ts";
import { damaged, type ModelSpace, type Reader } from "./rans.ts";
import { FIRST, LENGTH, POINT } from "./stars.ts";
import { CORNER, Expectation, type Wedges } from "./values.ts";

/** More wedges of one vertex cannot be named again. */
const MOST_PRESENT = 15;

/** Why a corner is asked for its wedge. */
const MOVED_SAME = 0;
const MOVED_OTHER = 1;
const BORN_NEW = 2;
const BORN_OLD = 3;
const BORN_THIRD = 4;
/** No corner of the split is: all answer as expected. */
const USUAL = 5;

export class Attributes implements Wedges {
  readonly stride: number;
  readonly values = new IntList();
  /** Wedges of the triangles' corners; none without channels. */
  readonly corners = new IntList();
  /** Of each triangle; none where all have the same. */
  readonly materials = new IntList();

  private readonly kinds: readonly ChannelKind[];
  private readonly materialCount: number;
  private readonly mostWedges: number;
  private readonly sameMaterial: number;
  private readonly material: number;
  private readonly usual: number;
  private readonly ranks: number;
  private readonly copies: number;
  private readonly sizes: number;
  /** The wedge that a vertex got last; by wedge, the one that its vertex got before it. */
  private readonly latest = new IntList();
  private readonly before = new IntList();
  private readonly lastCopy: Int32Array;
  private readonly expectation = new Expectation();
  /** The corners of the new vertex, as they were before the split. */
  private readonly was = new IntList();
  /** Corners that have wedges that are still to be told, each with the place here of the next one that has the same. */
  private readonly asked = new IntList();
  private readonly askedNext = new IntList();
  /** The first and the last place of each of those wedges. */
  private readonly pendingFirst = new IntList();
  private readonly pendingLast = new IntList();
  /** The corners of the one that is being told. */
  private readonly telling = new IntList();
  /** Wedges told before this split. */
  private told = 0;
  private readonly present = new Int32Array(MOST_PRESENT);
  private presentCount = 0;
  /** Where each new triangle stands among those around the new vertex. */
  private readonly placesOfBorn = new IntList();

  constructor(
    header: Header,
    models: ModelSpace,
    private readonly looks: Looks,
  ) {
    this.kinds = header.channels.map(({ kind }) => kind);
    this.stride = header.stride;
    this.materialCount = header.materials;
    this.mostWedges = header.wedges;
    this.sameMaterial = models.nibbles(1);
    this.material = models.nibbles(1);
    this.usual = models.bits(3);
    this.ranks = models.nibbles(5 * 4);
    this.copies = models.nibbles(5 * this.kinds.length);
    this.sizes = models.nibbles(16 * 8 * this.stride);
    this.lastCopy = new Int32Array(this.kinds.length);
  }

  /** Memory of what grows with the mesh. */
  get bytes(): number {
    const lists = [this.values, this.corners, this.materials, this.latest, this.before];
    return bytesOf(...lists.map(({ values }) => values));
  }

  /** Makes room for so many vertices and triangles, and the wedges of so many bytes, each of which takes at least one. */
  reserve(vertices: number, triangles: number, bytes: number): void {
    if (this.materialCount > 1) this.materials.room(triangles);
    if (this.stride === 0) return;
    const wedges = Math.min(this.mostWedges, bytes);
    this.corners.room(3 * triangles);
    this.latest.room(vertices);
    this.before.room(wedges);
    this.values.room(this.stride * wedges);
  }

  /** Bytes that {@link dress} takes at most for so many corners. */
  stepBytes(corners: number): number {
    return this.stride === 0 && this.materialCount < 2 ? 0 : corners * (8 + 7 * this.stride);
  }

  /** After a split: what the corners of the new vertex and of new triangles, from `first` on, look like. */
  dress(reader: Reader, mesh: Mesh, old: number, fresh: number, first: number, size: number): void {
    if (this.materialCount > 1) this.readMaterials(reader, mesh, fresh, first);
    if (this.stride === 0) return;
    this.corners.extend(3 * mesh.triangles, NONE);
    this.latest.extend(mesh.vertices, NONE);
    this.asked.clear();
    this.askedNext.clear();
    this.pendingFirst.clear();
    this.pendingLast.clear();
    this.told = this.values.length / this.stride;
    this.readRanks(reader, mesh, old, fresh, first);
    for (let i = 0; i < this.pendingFirst.length; i += 1) {
      const first = this.pendingFirst.at(i);
      // What all corners of the new vertex share was asked of nobody.
      if (first !== NONE) this.gather(first);
      this.readValues(reader, mesh, first === NONE ? this.was : this.telling, old, fresh, size);
    }
    if (this.told + this.pendingFirst.length > this.mostWedges) damaged("it has more wedges than its header says");
  }

  /** Which wedges the corners of the new vertex have, then the others of new triangles. */
  private readRanks(reader: Reader, mesh: Mesh, old: number, fresh: number, first: number): void {
    const { was } = this;
    const seams = this.findMoved(mesh, old, fresh);
    if (was.length === 0 && first === mesh.triangles) return;
    const isUsual = reader.bit(this.usual + seams) === 1;
    if (isUsual && was.length > 0) {
      this.share(fresh);
    } else {
      let beside = NONE;
      for (let i = 0; i < was.length; i += CORNER) {
        const wedge = was.at(i + 2);
        const why = wedge === NONE ? BORN_NEW : wedge === beside ? MOVED_SAME : MOVED_OTHER;
        beside = wedge;
        this.readRank(reader, mesh, fresh, was.at(i), was.at(i + 1), wedge, why, i / CORNER);
      }
    }
    for (let triangle = first; triangle < mesh.triangles; triangle += 1) {
      for (let side = 0; side < 3; side += 1) {
        const vertex = mesh.corners[3 * triangle + side] as number;
        if (vertex === fresh) continue;
        const why = vertex === old ? BORN_OLD : BORN_THIRD;
        this.readRank(reader, mesh, vertex, triangle, side, NONE, isUsual ? USUAL : why, NONE);
      }
    }
  }

  /** Gives all corners of the new vertex one new wedge. */
  private share(fresh: number): void {
    const { was, told } = this;
    const corners = this.corners.values;
    for (let i = 0; i < was.length; i += CORNER) corners[3 * was.at(i) + was.at(i + 1)] = told;
    this.latest.values[fresh] = told;
    this.before.push(NONE);
    this.pendingFirst.push(NONE);
    this.pendingLast.push(NONE);
  }

  /**
   * Finds the corners of the new vertex; those of moved triangles still hold wedges of the old one. Gives 0 if the old
   * vertex has no seam, 1 if none parts the corners that moved, 2 else.
   */
  private findMoved(mesh: Mesh, old: number, fresh: number): number {
    const { was } = this;
    const { places } = mesh.stars;
    const corners = this.corners.values;
    const begin = mesh.points[POINT * fresh + FIRST] as number;
    const length = mesh.points[POINT * fresh + LENGTH] as number;
    const found = was.room(CORNER * length);
    let seams = this.countPresent(old) > 1 ? 1 : 0;
    let beside = NONE;
    for (let i = 0; i < length; i += 1) {
      const triangle = places[begin + i] as number;
      const side = mesh.sideOf(triangle, fresh);
      const wedge = corners[3 * triangle + side] as number;
      found[CORNER * i] = triangle;
      found[CORNER * i + 1] = side;
      found[CORNER * i + 2] = wedge;
      corners[3 * triangle + side] = NONE;
      if (wedge !== NONE && beside !== NONE && wedge !== beside) seams = 2;
      beside = wedge;
    }
    was.length = CORNER * length;
    return seams;
  }

  private readMaterials(reader: Reader, mesh: Mesh, fresh: number, first: number): void {
    const { places } = mesh.stars;
    const begin = mesh.points[POINT * fresh + FIRST] as number;
    const end = begin + (mesh.points[POINT * fresh + LENGTH] as number);
    const { placesOfBorn } = this;
    placesOfBorn.length = mesh.triangles - first;
    const found = placesOfBorn.room(placesOfBorn.length);
    for (let place = begin; place < end; place += 1) {
      const triangle = places[place] as number;
      if (triangle >= first) found[triangle - first] = place;
    }
    for (let triangle = first; triangle < mesh.triangles; triangle += 1) {
      // As the triangle before it around the new vertex, or else the next one that is known.
      const at = found[triangle - first] as number;
      let near = at - 1;
      while (near >= begin && (places[near] as number) >= triangle) near -= 1;
      if (near < begin) {
        near = at;
        while (near < end && (places[near] as number) >= triangle) near += 1;
      }
      let material = near < end ? this.materials.at(places[near] as number) : 0;
      if (reader.symbol(this.sameMaterial) > 0) {
        material = Math.min(reader.number(this.material), this.materialCount - 1);
      }
      this.materials.push(material);
    }
  }

  /**
   * Which wedge a corner has: those of the corners nearest in its vertex's star come first, in which its triangle stands
   * at `place` if that is known.
   */
  private readRank(
    reader: Reader,
    mesh: Mesh,
    vertex: number,
    triangle: number,
    side: number,
    was: number,
    why: number,
    place: number,
  ): void {
    const count = this.countPresent(vertex);
    let rank = 0;
    if (why !== USUAL && count > 0) {
      rank = Math.min(reader.symbol(this.ranks + 4 * why + Math.min(count, 3)), count);
    }
    let wedge = this.latest.at(vertex);
    if (rank < count) {
      if (count > 1 && !this.looks.areUsedUp) wedge = this.findPresent(mesh, vertex, triangle, rank, place);
    } else {
      this.before.push(wedge);
      wedge = this.told + this.pendingFirst.length;
      this.pendingFirst.push(NONE);
      this.pendingLast.push(NONE);
      this.latest.values[vertex] = wedge;
    }
    this.corners.values[3 * triangle + side] = wedge;
    if (wedge >= this.told) this.ask(wedge - this.told, triangle, side, was);
  }

  /** Notes a corner that has a wedge which is still to be told. */
  private ask(pending: number, triangle: number, side: number, was: number): void {
    const place = this.askedNext.length;
    this.asked.push(triangle);
    this.asked.push(side);
    this.asked.push(was);
    this.askedNext.push(NONE);
    const last = this.pendingLast.at(pending);
    if (last === NONE) this.pendingFirst.values[pending] = place;
    else this.askedNext.values[last] = place;
    this.pendingLast.values[pending] = place;
  }

  /** Puts the corners together that have the same wedge, from the first on. */
  private gather(first: number): void {
    this.telling.clear();
    for (let place = first; place !== NONE; place = this.askedNext.at(place)) {
      for (let i = 0; i < CORNER; i += 1) this.telling.push(this.asked.at(CORNER * place + i));
    }
  }

  /** How many wedges a vertex got. Its corners have no others, so this tells their number before any is looked at. */
  private countPresent(vertex: number): number {
    let count = 0;
    for (let wedge = this.latest.at(vertex); wedge !== NONE && count < MOST_PRESENT; wedge = this.before.at(wedge)) {
      count += 1;
    }
    return count;
  }

  /**
   * The wedge of a vertex that has this rank: from a triangle's place in its star to both sides in turn, then any
   * others, latest first.
   */
  private findPresent(mesh: Mesh, vertex: number, triangle: number, rank: number, place: number): number {
    const { places } = mesh.stars;
    const begin = mesh.points[POINT * vertex + FIRST] as number;
    const end = begin + (mesh.points[POINT * vertex + LENGTH] as number);
    let at = begin + place;
    if (place === NONE) {
      this.looks.takeForSearch(end - begin);
      at = begin;
      while (at < end && places[at] !== triangle) at += 1;
      if (at === end) at = begin;
    }
    this.presentCount = 0;
    let behind = at - 1;
    let ahead = at + 1;
    while (this.presentCount <= rank && (behind >= begin || ahead < end)) {
      if (behind >= begin) this.addWedgeOf(mesh, places[behind] as number, vertex);
      if (ahead < end) this.addWedgeOf(mesh, places[ahead] as number, vertex);
      behind -= 1;
      ahead += 1;
    }
    this.looks.take(Math.min(ahead, end) - Math.max(behind + 1, begin));
    // A wedge that no corner has at the moment may come back.
    let wedge = this.latest.at(vertex);
    while (wedge !== NONE && this.presentCount <= rank) {
      this.addPresent(wedge);
      wedge = this.before.at(wedge);
    }
    return this.present[rank] as number;
  }

  private addWedgeOf(mesh: Mesh, triangle: number, vertex: number): void {
    const first = 3 * triangle;
    const side = mesh.corners[first] === vertex ? 0 : mesh.corners[first + 1] === vertex ? 1 : 2;
    const wedge = this.corners.values[first + side] as number;
    if (wedge !== NONE && this.presentCount < MOST_PRESENT) this.addPresent(wedge);
  }

  private addPresent(wedge: number): void {
    const { present } = this;
    for (let i = 0; i < this.presentCount; i += 1) if (present[i] === wedge) return;
    present[this.presentCount] = wedge;
    this.presentCount += 1;
  }

  /** The values of a new wedge: copied from a corner beside the first that has it, or residuals. */
  private readValues(reader: Reader, mesh: Mesh, pending: IntList, old: number, fresh: number, size: number): void {
    const { values, corners, stride } = this;
    const triangle = 3 * pending.at(0);
    const side = pending.at(1);
    let number = 0;
    for (let channel = 0; channel < this.kinds.length; channel += 1) {
      const kind = this.kinds[channel] as ChannelKind;
      const count = numbersOf(kind);
      const model = this.copies + 5 * channel + (this.lastCopy[channel] as number);
      const copy = Math.min(reader.symbol(model), 3);
      this.lastCopy[channel] = copy;
      let source = NONE;
      if (copy === 1) source = corners.at(triangle + ((side + 1) % 3));
      else if (copy === 2) source = corners.at(triangle + ((side + 2) % 3));
      else if (copy === 3) source = pending.at(2);
      if (source !== NONE && (source + 1) * stride <= values.length) {
        for (let k = number; k < number + count; k += 1) values.push(values.at(source * stride + k));
      } else {
        this.readNumbers(reader, mesh, pending, kind, number, old, fresh, size);
      }
      number += count;
    }
  }

  private readNumbers(
    reader: Reader,
    mesh: Mesh,
    pending: IntList,
    kind: ChannelKind,
    number: number,
    old: number,
    fresh: number,
    size: number,
  ): void {
    const { expectation, values } = this;
    const count = numbersOf(kind);
    if (kind === "normal") expectation.ofNormal(mesh, this, pending, number);
    else expectation.ofOther(mesh, this, pending, number, count, old, fresh);
    const like = kind === "normal" ? Math.min(pending.length / CORNER, 15) : size >> 1;
    let context = 0;
    for (let k = 0; k < count; k += 1) {
      const model = this.sizes + 8 * (16 * (number + k) + like) + context;
      values.push((reader.residual(model) + (expectation.numbers[k] as number)) | 0);
      context = reader.sizeClass >> 1;
    }
  }
}
