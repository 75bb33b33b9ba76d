/**
 * What does a split do to the mesh? Laid out first, because the new position is predicted from it, and then done
 * (`docs/SLOD.md` §6, last paragraph).
 */
import type { Star } from "./fan.ts";
import { type Mesh, NONE } from "./mesh.ts";
import { GO, type Split, STAY, TORN } from "./split.ts";
import { AROUND, AT, POINT } from "./stars.ts";

/** Its arrays have room for more than there are. */
export class Change {
  /** Spokes that move. */
  moves = 0;
  moved = new Int32Array(0);
  /** Edges that open: third corner and sense of rotation of the new triangle, and its place in that corner's list. */
  opened = 0;
  third = new Int32Array(0);
  private oldFirst = new Int32Array(0);
  private neighbour = new Int32Array(0);
  private after = new Int32Array(0);

  /** Lays out what a split does. */
  layOut(star: Star, split: Split): void {
    const most = star.spokes + 2 * star.fans;
    if (most > this.moved.length) this.widen(2 * most);
    this.moves = 0;
    this.opened = 0;
    let torn = 0;
    for (let fan = 0; fan < star.fans; fan += 1) {
      const first = star.fanFirst[fan] as number;
      const length = star.fanLength[fan] as number;
      const kind = split.kind[fan] as number;
      if (kind === GO) {
        this.move(first, length);
      } else if (kind === TORN) {
        for (let i = first; i < first + length; i += 1, torn += 1) if (split.torn.at(torn)) this.move(i, 1);
      } else if (kind !== STAY) {
        this.layOutRow(star, split, fan, first, length);
      }
    }
  }

  private widen(room: number): void {
    this.moved = new Int32Array(room);
    this.third = new Int32Array(room);
    this.oldFirst = new Int32Array(room);
    this.neighbour = new Int32Array(room);
    this.after = new Int32Array(room);
  }

  private layOutRow(star: Star, split: Split, fan: number, begin: number, length: number): void {
    const first = split.first[fan] as number;
    const opens = split.opens[fan] as number;
    // A row that goes on at the beginning of the fan has two parts.
    const whole = first + (split.count[fan] as number);
    const end = whole < length ? whole : length;
    const rest = whole - end;
    this.move(begin + first, end - first);
    this.move(begin, rest);
    if (opens & 1) this.open(star, begin, length, first, 0);
    if (opens & 2) this.open(star, begin, length, rest > 0 || (star.fanClosed[fan] && end === length) ? rest : end, 1);
  }

  private move(first: number, count: number): void {
    const { moved, moves } = this;
    for (let i = 0; i < count; i += 1) moved[moves + i] = first + i;
    this.moves = moves + count;
  }

  /** Opens the edge before spoke `at` of a fan. */
  private open(star: Star, begin: number, length: number, at: number, oldFirst: number): void {
    const { opened } = this;
    const after = at < length ? 1 : 0;
    const spoke = begin + (after ? at : length - 1);
    this.third[opened] = (after ? star.from[spoke] : star.to[spoke]) as number;
    this.oldFirst[opened] = oldFirst;
    this.neighbour[opened] = star.triangle[spoke] as number;
    this.after[opened] = after;
    this.opened = opened + 1;
  }

  /** Changes the mesh. `fresh` is the new vertex, without triangles. */
  apply(mesh: Mesh, star: Star, split: Split, old: number, fresh: number): void {
    const { points, stars } = mesh;
    const next = mesh.triangles;
    this.moveTriangles(mesh, star, old, fresh);
    for (let i = 0; i < this.opened; i += 1) {
      const third = this.third[i] as number;
      const triangle = mesh.bear(old, fresh, third, this.oldFirst[i] as number);
      stars.insert(points, third, this.neighbour[i] as number, this.after[i] as number, triangle);
    }
    const extras = split.extraThird.length;
    for (let i = 0; i < extras; i += 1) {
      const third = split.extraThird.at(i);
      const triangle = mesh.bear(old, fresh, third, split.extraOldFirst.at(i));
      stars.insert(points, third, NONE, 1, triangle);
    }
    const born = this.opened + extras;
    const stay = stars.resize(points, old, star.spokes - this.moves + born);
    const go = stars.resize(points, fresh, this.moves + born);
    this.writeLists(star, split, stars.places, next, stay, go);
  }

  /** Writes the lists of the old vertex and the new one, from these places on. */
  private writeLists(star: Star, split: Split, places: Int32Array, next: number, stay: number, go: number): void {
    const { triangle } = star;
    let born = next;
    let torn = 0;
    for (let fan = 0; fan < star.fans; fan += 1) {
      const first = star.fanFirst[fan] as number;
      const length = star.fanLength[fan] as number;
      const kind = split.kind[fan] as number;
      if (kind > TORN) {
        const opens = split.opens[fan] as number;
        const begin = split.first[fan] as number;
        const whole = begin + (split.count[fan] as number);
        const end = whole < length ? whole : length;
        const rest = whole - end;
        stay = copied(triangle, first + rest, first + begin, places, stay);
        go = copied(triangle, first + begin, first + end, places, go);
        go = copied(triangle, first, first + rest, places, go);
        // New triangles at the beginning and at the end of the row: both lists have them, the other way round.
        const atBegin = opens & 1;
        const atEnd = opens >> 1;
        if (atEnd) {
          places[go] = born + atBegin;
          places[stay + atBegin] = born + atBegin;
        }
        if (atBegin) {
          places[go + atEnd] = born;
          places[stay] = born;
        }
        go += atBegin + atEnd;
        stay += atBegin + atEnd;
        born += atBegin + atEnd;
        stay = copied(triangle, first + (end > rest ? end : rest), first + length, places, stay);
      } else if (kind === TORN) {
        for (let i = first; i < first + length; i += 1, torn += 1) {
          if (split.torn.at(torn)) go = copied(triangle, i, i + 1, places, go);
          else stay = copied(triangle, i, i + 1, places, stay);
        }
      } else if (kind === GO) {
        go = copied(triangle, first, first + length, places, go);
      } else {
        stay = copied(triangle, first, first + length, places, stay);
      }
    }
    for (let i = 0; i < split.extraThird.length; i += 1) {
      places[stay + i] = born + i;
      places[go + i] = born + i;
    }
  }

  private moveTriangles(mesh: Mesh, star: Star, old: number, fresh: number): void {
    const { points, corners } = mesh;
    const { corner, from, to } = star;
    const { moved, moves } = this;
    const here = POINT * old;
    const there = POINT * fresh;
    const dx = (points[there + AT] as number) - (points[here + AT] as number);
    const dy = (points[there + AT + 1] as number) - (points[here + AT + 1] as number);
    const dz = (points[there + AT + 2] as number) - (points[here + AT + 2] as number);
    let x = 0;
    let y = 0;
    let z = 0;
    for (let i = 0; i < moves; i += 1) {
      const spoke = moved[i] as number;
      corners[corner[spoke] as number] = fresh;
      let other = POINT * (from[spoke] as number);
      for (let side = 0; side < 2; side += 1) {
        x = (x + (points[other + AT] as number)) | 0;
        y = (y + (points[other + AT + 1] as number)) | 0;
        z = (z + (points[other + AT + 2] as number)) | 0;
        points[other + AROUND] = (points[other + AROUND] as number) + dx;
        points[other + AROUND + 1] = (points[other + AROUND + 1] as number) + dy;
        points[other + AROUND + 2] = (points[other + AROUND + 2] as number) + dz;
        other = POINT * (to[spoke] as number);
      }
    }
    points[there + AROUND] = x;
    points[there + AROUND + 1] = y;
    points[there + AROUND + 2] = z;
    points[here + AROUND] = (points[here + AROUND] as number) - x;
    points[here + AROUND + 1] = (points[here + AROUND + 1] as number) - y;
    points[here + AROUND + 2] = (points[here + AROUND + 2] as number) - z;
  }
}

/** Copies numbers from `first` to before `end`; gives the place behind them. */
function copied(from: Int32Array, first: number, end: number, to: Int32Array, place: number): number {
  for (let i = first; i < end; i += 1, place += 1) to[place] = from[i] as number;
  return place;
}
