/**
 * What becomes of the triangles around a vertex when it is split in two? Each fan by itself: some of its triangles move
 * to the new vertex, and where a moved one meets one that stays, the edge between them opens into a new triangle
 * (Hoppe 1996). What no such rule describes is said outright (`docs/SLOD.md` §6).
 */
import type { Star } from "./fan.ts";
import { IntList } from "./list.ts";
import type { Mesh } from "./mesh.ts";
import type { ModelSpace, Reader } from "./rans.ts";
import { AT, POINT } from "./stars.ts";

export const STAY = 0;
export const GO = 1;
export const TORN = 2;
/** A row at the front of an open fan, of which the end opens. */
const FRONT = 3;
/** A row at the back of an open fan, of which the beginning opens. */
const BACK = 4;
/** Any row, plus 1 if its beginning opens, plus 2 if its end does. */
const ROW = 5;
/** A row of which both edges open, as nearly always where the surface is closed. */
const ROW_BOTH = ROW + 3;
/** There are extra triangles, which is said before what becomes of the first fan. */
const EXTRA = 15;
/** For longer fans no place is likelier than another. */
const MOST_SPOKES = 20;

/** What becomes of all triangles around a vertex. */
export class Split {
  /** Of each fan: {@link STAY}, {@link GO}, {@link TORN}, or else a row of it moves. */
  kind = new Int32Array(0);
  /** The row's first spoke in the fan, how many move, and whether its beginning (1) and its end (2) open. */
  first = new Int32Array(0);
  count = new Int32Array(0);
  opens = new Int32Array(0);
  /** Whether each spoke moves; of torn fans only. */
  readonly torn = new IntList();
  /** New triangles beside those of opened edges: how many, their third corners and whether they are old, new, third. */
  extras = 0;
  readonly extraThird = new IntList();
  readonly extraOldFirst = new IntList();

  private readonly kinds: number;
  private readonly counts: number;
  private readonly firsts: number;
  private readonly otherFirsts: number;
  private readonly tornModels: number;
  private readonly extraModels: number;
  private readonly inRing: number;
  private readonly oldFirst: number;
  private readonly ways = new Float64Array(3 * MOST_SPOKES);
  private readonly reaches = new Float64Array(MOST_SPOKES);

  constructor(models: ModelSpace) {
    this.kinds = models.nibbles(2 * 11);
    this.counts = models.nibbles(12 * 16);
    this.firsts = models.nibbles(16 * 16);
    this.otherFirsts = models.nibbles(2 * 16);
    this.extraModels = models.nibbles(2);
    this.tornModels = models.bits(3);
    this.inRing = models.bits(1);
    this.oldFirst = models.bits(2);
  }

  /** Reads what becomes of the fans of a star, and how many extra triangles there are. */
  readFans(reader: Reader, mesh: Mesh, vertex: number, star: Star): void {
    const { fans } = star;
    if (fans > this.kind.length) this.widen(2 * fans);
    this.torn.clear();
    this.extraThird.clear();
    this.extraOldFirst.clear();
    this.extras = fans === 0 ? reader.number(this.extraModels) : 0;
    let last = ROW_BOTH + (fans === 1 ? 1 : 2);
    for (let fan = 0; fan < fans; fan += 1) {
      const model = this.kinds + 11 * (star.fanClosed[fan] as number) + last;
      let symbol = reader.symbol(model);
      if (fan === 0 && symbol === EXTRA) {
        this.extras = reader.number(this.extraModels + 1) + 1;
        symbol = reader.symbol(model);
      }
      const kind = symbol < ROW_BOTH ? symbol : ROW_BOTH;
      last = kind;
      this.kind[fan] = kind;
      if (kind > TORN) this.readRow(reader, mesh, vertex, star, fan, kind);
      else if (kind === TORN) this.readTorn(reader, star.fanLength[fan] as number);
    }
  }

  private widen(room: number): void {
    this.kind = new Int32Array(room);
    this.first = new Int32Array(room);
    this.count = new Int32Array(room);
    this.opens = new Int32Array(room);
  }

  private readTorn(reader: Reader, length: number): void {
    let before = 2;
    for (let k = 0; k < length; k += 1) {
      before = reader.bit(this.tornModels + before);
      this.torn.push(before);
    }
  }

  private readRow(reader: Reader, mesh: Mesh, vertex: number, star: Star, fan: number, kind: number): void {
    const length = star.fanLength[fan] as number;
    const closed = star.fanClosed[fan] as number;
    const sizeClass = length < 15 ? length : 15;
    const told = reader.number(this.counts + ((kind - FRONT) * 2 + closed) * 16 + sizeClass);
    const count = told < length ? told : length;
    let first = 0;
    let opens = kind - ROW;
    if (kind === ROW_BOTH && closed) {
      const folded = Math.min(reader.number(this.firsts + 16 * sizeClass + (count < 15 ? count : 15)), length - 1);
      const ahead = (folded & 1) === 0 ? folded >> 1 : length - ((folded + 1) >> 1);
      first = this.widest(mesh, vertex, star, star.fanFirst[fan] as number, length, count) + ahead;
      if (first >= length) first -= length;
    } else if (kind === FRONT) {
      opens = 2;
    } else if (kind === BACK) {
      first = length - count;
      opens = 1;
    } else {
      const most = closed ? length - 1 : length - count;
      first = Math.min(reader.number(this.otherFirsts + 16 * closed + sizeClass), most);
    }
    this.first[fan] = first;
    this.count[fan] = count;
    this.opens[fan] = opens;
  }

  /**
   * Where `count` triangles of a closed fan reach farthest to the side to which its vertex sees most: there likely was
   * another vertex. Gives the first of them.
   */
  private widest(mesh: Mesh, vertex: number, star: Star, begin: number, length: number, count: number): number {
    if (length > MOST_SPOKES) return 0;
    const { reaches, ways } = this;
    const { points } = mesh;
    const { from } = star;
    const x = points[POINT * vertex + AT] as number;
    const y = points[POINT * vertex + AT + 1] as number;
    const z = points[POINT * vertex + AT + 2] as number;
    let sx = 0;
    let sy = 0;
    let sz = 0;
    for (let i = 0; i < length; i += 1) {
      const other = POINT * (from[begin + i] as number);
      const wx = (points[other + AT] as number) - x;
      const wy = (points[other + AT + 1] as number) - y;
      const wz = (points[other + AT + 2] as number) - z;
      ways[3 * i] = wx;
      ways[3 * i + 1] = wy;
      ways[3 * i + 2] = wz;
      sx += wx;
      sy += wy;
      sz += wz;
    }
    for (let i = 0; i < length; i += 1) {
      const along = (ways[3 * i] as number) * sx + (ways[3 * i + 1] as number) * sy;
      reaches[i] = along + (ways[3 * i + 2] as number) * sz;
    }
    // Only vertices between two of the triangles are new to it; if there are none, those at the ends.
    let leave = count > 1 ? 1 : 0;
    let enter = count > 1 ? count : count + 1;
    let reach = 0;
    for (let i = leave; i < enter; i += 1) reach += reaches[i] as number;
    let best = reach;
    let widest = 0;
    for (let first = 1; first < length; first += 1) {
      if (enter === length) enter = 0;
      if (leave === length) leave = 0;
      reach += (reaches[enter] as number) - (reaches[leave] as number);
      enter += 1;
      leave += 1;
      if (reach > best) {
        best = reach;
        widest = first;
      }
    }
    return widest;
  }

  /** Reads the extra triangles. */
  readExtra(reader: Reader, mesh: Mesh, star: Star): void {
    const corners = 2 * star.spokes;
    for (let i = 0; i < this.extras; i += 1) {
      const inRing = corners > 0 ? reader.bit(this.inRing) : 0;
      const index = uniform(reader, inRing ? corners : mesh.vertices);
      const side = index % 2 === 0 ? star.from : star.to;
      this.extraThird.push(inRing ? (side[index >> 1] as number) : index);
      this.extraOldFirst.push(reader.bit(this.oldFirst + inRing));
    }
  }
}

/** One of `count` numbers that are equally likely. */
function uniform(reader: Reader, count: number): number {
  return Math.min(reader.wide(32 - Math.clz32(count - 1)), count - 1);
}
