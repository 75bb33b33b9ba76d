/**
 * What does a split do to the mesh? Laid out first, because the new position is predicted from it, and then done
 * (`docs/SLOD.md` §6, last paragraph).
 */
import type { Star } from "./fan.ts";
import { IntList } from "./list.ts";
import { type Mesh, NONE } from "./mesh.ts";
import { GO, type Split, STAY, TORN } from "./split.ts";
import { AROUND, AT, POINT } from "./stars.ts";

export class Change {
  /** Spokes that move. */
  readonly moved = new IntList();
  /** Edges that open: third corner and sense of rotation of the new triangle, and its place in that corner's list. */
  readonly third = new IntList();
  private readonly oldFirst = new IntList();
  private readonly neighbour = new IntList();
  private readonly after = new IntList();
  /** Triangles that will be the old vertex's and the new one's; new ones have their future numbers. */
  private readonly stay = new IntList();
  private readonly go = new IntList();

  /** Lays out what a split does. `next` is the number of the first new triangle. */
  layOut(star: Star, split: Split, next: number): void {
    this.third.clear();
    this.oldFirst.clear();
    this.neighbour.clear();
    this.after.clear();
    this.moved.clear();
    this.stay.clear();
    this.go.clear();
    const most = star.spokes + 2 * star.fans + split.extraThird.length;
    this.moved.room(most);
    this.stay.room(most);
    this.go.room(most);
    let torn = 0;
    for (let fan = 0; fan < star.fans; fan += 1) {
      const first = star.fanFirst.at(fan);
      const end = first + star.fanLength.at(fan);
      const kind = split.kind.at(fan);
      if (kind === STAY) {
        this.letStay(star, first, end);
      } else if (kind === GO) {
        this.letGo(star, first, end);
      } else if (kind === TORN) {
        for (let i = first; i < end; i += 1, torn += 1) {
          if (split.torn.at(torn)) this.letGo(star, i, i + 1);
          else this.letStay(star, i, i + 1);
        }
      } else {
        this.layOutRow(star, split, fan, next);
      }
    }
  }

  private layOutRow(star: Star, split: Split, fan: number, next: number): void {
    const begin = star.fanFirst.at(fan);
    const length = star.fanLength.at(fan);
    const first = split.first.at(fan);
    const opens = split.opens.at(fan);
    // A row that goes on at the beginning of the fan has two parts.
    const whole = first + split.count.at(fan);
    const end = Math.min(whole, length);
    const rest = Math.max(whole - length, 0);
    this.letStay(star, begin + rest, begin + Math.max(first, rest));
    this.letGo(star, begin + first, begin + end);
    this.letGo(star, begin, begin + rest);
    const around = rest > 0 || (star.fanClosed.at(fan) === 1 && end === length) ? rest : end;
    const startBorn = opens & 1 ? this.open(star, begin, length, first, 0, next) : NONE;
    const endBorn = opens & 2 ? this.open(star, begin, length, around, 1, next) : NONE;
    if (endBorn !== NONE) this.go.push(endBorn);
    if (startBorn !== NONE) {
      this.go.push(startBorn);
      this.stay.push(startBorn);
    }
    if (endBorn !== NONE) this.stay.push(endBorn);
    this.letStay(star, begin + Math.max(end, rest), begin + length);
  }

  private letStay(star: Star, first: number, end: number): void {
    const { stay } = this;
    const { values } = stay;
    const triangle = star.triangle.values;
    let { length } = stay;
    for (let i = first; i < end; i += 1, length += 1) values[length] = triangle[i] as number;
    stay.length = length;
  }

  private letGo(star: Star, first: number, end: number): void {
    const { go, moved } = this;
    const { values } = go;
    const spokes = moved.values;
    const triangle = star.triangle.values;
    let { length } = go;
    let count = moved.length;
    for (let i = first; i < end; i += 1, length += 1, count += 1) {
      values[length] = triangle[i] as number;
      spokes[count] = i;
    }
    go.length = length;
    moved.length = count;
  }

  /** Opens the edge before spoke `at` of a fan: gives the number of its new triangle. */
  private open(star: Star, begin: number, length: number, at: number, oldFirst: number, next: number): number {
    const after = at < length;
    const spoke = begin + Math.min(at, length - 1);
    this.third.push(after ? star.from.at(spoke) : star.to.at(spoke));
    this.oldFirst.push(oldFirst);
    this.neighbour.push(star.triangle.at(spoke));
    this.after.push(after ? 1 : 0);
    return next + this.third.length - 1;
  }

  /** Changes the mesh. `fresh` is the new vertex, without triangles. */
  apply(mesh: Mesh, star: Star, split: Split, old: number, fresh: number): void {
    this.moveTriangles(mesh, star, old, fresh);
    const { points, stars } = mesh;
    for (let i = 0; i < this.third.length; i += 1) {
      const third = this.third.at(i);
      const triangle = bear(mesh, old, fresh, third, this.oldFirst.at(i));
      stars.insert(points, third, this.neighbour.at(i), this.after.at(i), triangle);
    }
    for (let i = 0; i < split.extraThird.length; i += 1) {
      const third = split.extraThird.at(i);
      const triangle = bear(mesh, old, fresh, third, split.extraOldFirst.at(i));
      stars.insert(points, third, NONE, 1, triangle);
      this.stay.push(triangle);
      this.go.push(triangle);
    }
    stars.set(points, old, this.stay.values, this.stay.length);
    stars.set(points, fresh, this.go.values, this.go.length);
  }

  private moveTriangles(mesh: Mesh, star: Star, old: number, fresh: number): void {
    const { points, corners } = mesh;
    const triangles = star.triangle.values;
    const from = star.from.values;
    const to = star.to.values;
    const moved = this.moved.values;
    const here = POINT * old;
    const there = POINT * fresh;
    const dx = (points[there + AT] as number) - (points[here + AT] as number);
    const dy = (points[there + AT + 1] as number) - (points[here + AT + 1] as number);
    const dz = (points[there + AT + 2] as number) - (points[here + AT + 2] as number);
    let x = 0;
    let y = 0;
    let z = 0;
    for (let i = 0; i < this.moved.length; i += 1) {
      const spoke = moved[i] as number;
      const triangle = triangles[spoke] as number;
      corners[3 * triangle + mesh.sideOf(triangle, old)] = fresh;
      let other = POINT * (from[spoke] as number);
      for (let side = 0; side < 2; side += 1) {
        x = (x + (points[other + AT] as number)) | 0;
        y = (y + (points[other + AT + 1] as number)) | 0;
        z = (z + (points[other + AT + 2] as number)) | 0;
        points[other + AROUND] = ((points[other + AROUND] as number) + dx) | 0;
        points[other + AROUND + 1] = ((points[other + AROUND + 1] as number) + dy) | 0;
        points[other + AROUND + 2] = ((points[other + AROUND + 2] as number) + dz) | 0;
        other = POINT * (to[spoke] as number);
      }
    }
    points[there + AROUND] = x;
    points[there + AROUND + 1] = y;
    points[there + AROUND + 2] = z;
    points[here + AROUND] = ((points[here + AROUND] as number) - x) | 0;
    points[here + AROUND + 1] = ((points[here + AROUND + 1] as number) - y) | 0;
    points[here + AROUND + 2] = ((points[here + AROUND + 2] as number) - z) | 0;
  }
}

function bear(mesh: Mesh, old: number, fresh: number, third: number, oldFirst: number): number {
  return oldFirst ? mesh.addTriangle(old, fresh, third) : mesh.addTriangle(fresh, old, third);
}
