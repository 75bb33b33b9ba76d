/**
 * Which points and faces do the lists of a solid say? They are put into buffers that all solids share; those that are
 * written out in the text are computed at one go, without making lists of them.
 */
import { noPoint } from "../error.ts";
import { MAX_CORNERS } from "../limits.ts";
import { type Code, isEmpty, RESULTS } from "../plain/code.ts";
import { WIDTH } from "../plain/columns.ts";
import type { Scope } from "../plain/machine.ts";
import type { Plan } from "../plain/plan.ts";
import { MAX_LENGTH } from "../ranges.ts";
import { Faces } from "../solid/flat.ts";
import type { At, Row } from "../syntax.ts";
import { isNumbers, type List, type Value } from "../value.ts";
import { Expressions } from "./expressions.ts";

export abstract class Outlines extends Expressions {
  /** The last points or corners: three or two numbers each. */
  protected points = new Float64Array(3 * MAX_CORNERS);
  private faces = new Faces();

  /** Takes the points of a list; how many there are. */
  protected takePoints(scope: Scope, row: Row): number {
    if (this.computes(scope, row) && row.code?.width === 3 && this.takeRows(row) && this.paid(scope)) {
      return row.code.lengths.length;
    }
    const { items } = this.listed(scope, row);
    this.makeRoom(3 * items.length);
    items.forEach((item, i) => {
      this.points.set(this.point3(scope, row.places[0] as At, "a point", item), 3 * i);
    });
    return items.length;
  }

  /** Takes the corners `[x, z]` of a list that is an outline; how many there are. */
  protected takeCorners(scope: Scope, row: Row, least: number): number {
    return this.takePlainCorners(scope, row, least) ?? this.takeOutline(scope, row, this.listed(scope, row), least);
  }

  /** The same of a polygon, which may be anything. */
  protected takePolygon(scope: Scope, row: Row): number {
    return this.takePlainCorners(scope, row, 3) ?? this.takeOutline(scope, row, this.only(scope, row), 3);
  }

  private takePlainCorners(scope: Scope, row: Row, least: number): number | undefined {
    if (!this.computes(scope, row) || row.code?.width !== 2) return undefined;
    const count = row.code.lengths.length;
    const isOutline = count >= least && count <= MAX_CORNERS;
    return isOutline && this.takeRows(row) && this.paid(scope) ? count : undefined;
  }

  private takeOutline(scope: Scope, { places }: Row, value: Value, least: number): number {
    const items = typeof value === "number" ? [] : value.items;
    const corners = items.map(coordinates);
    const count = corners.length;
    if (count < least || count > MAX_CORNERS || corners.some((corner) => corner.length !== 2)) {
      const wanted = "a list of `[x, z]`, each from -1000000 to 1000000";
      const counts = "two or more in a profile, three or more around a polygon, up to 256";
      const isOutline = typeof value !== "number" && items.every((item) => isNumbers(item, 2));
      const [module, at, told] = [scope.module, places[0] as At, `${wanted}: ${counts}`] as const;
      throw isOutline ? this.amount(module, at, "this outline", told) : this.unfit(module, at, "this outline", told);
    }
    this.points.set(corners.flat());
    return count;
  }

  /** Faces between so many points. */
  protected facesOf(scope: Scope, row: Row, points: number): Faces {
    const code = this.codeFor(scope, row);
    if (code?.faces && code.faces.last < points && this.affords(scope, code) && this.paid(scope)) return code.faces;
    if (code && this.computes(scope, row) && this.takeFaces(code, points) && this.paid(scope)) {
      if (isConstant(code)) {
        code.faces = this.faces;
        this.faces = new Faces();
        return code.faces;
      }
      return this.faces;
    }
    this.faces.clear();
    const at = row.places[0] as At;
    for (const [number, face] of this.listed(scope, row).items.entries()) {
      for (const corner of typeof face === "number" ? [undefined] : face.items) {
        if (typeof corner !== "number") {
          throw this.unfit(scope.module, at, "a face", "a list of numbers of points, counted from 0");
        }
        if (!(corner >= 0 && corner < points)) throw this.error(scope.module, at, noPoint(number, corner, points));
        this.faces.add(corner);
      }
      this.faces.end();
    }
    return this.faces;
  }

  /** Takes the results of rows of numbers of points; whether they are that. */
  private takeFaces({ lengths }: Code, points: number): boolean {
    const { faces } = this;
    faces.clear();
    let i = 0;
    for (const length of lengths) {
      for (const end = i + length; i < end; i += 1) {
        const corner = this.taken(i);
        if (!(corner >= 0 && corner < points)) return false;
        faces.add(corner);
      }
      faces.end();
    }
    return true;
  }

  /** One face that must be flat, around so many points in their order. */
  protected wholeFace(points: number): Faces {
    this.faces.clear();
    this.faces.isFlat = true;
    for (let i = 0; i < points; i += 1) this.faces.add(i);
    this.faces.end();
    return this.faces;
  }

  /** Takes the results of rows of coordinates; whether none is too large. */
  private takeRows({ code }: Row): boolean {
    if (!code) return false;
    const { results: count, registers } = code;
    const { points } = this;
    for (let i = 0; i < count; i += 1) {
      const coordinate = registers[RESULTS + i] as number;
      if (!(Math.abs(coordinate) <= MAX_LENGTH)) return false;
      points[i] = coordinate;
    }
    return true;
  }

  /** Takes coordinates of one turn of a plan. */
  protected takeTurn({ columns }: Plan, registers: Int32Array, turn: number): void {
    const { points } = this;
    for (let i = 0; i < registers.length; i += 1) {
      points[i] = columns[(registers[i] as number) * WIDTH + turn] as number;
    }
  }

  private makeRoom(numbers: number): void {
    if (numbers > this.points.length) this.points = new Float64Array(numbers);
  }

  private listed(scope: Scope, row: Row): List {
    return this.list(scope, row.places[0] as At, row.of[0] as Row["of"][number], "the corners of a solid");
  }

  protected point3(scope: Scope, at: At, what: string, value: Value): readonly number[] {
    const point = coordinates(value);
    if (point.length === 3) return point;
    const wanted = "`[x, y, z]`, each from -1000000 to 1000000";
    const { module } = scope;
    throw isNumbers(value, 3) ? this.amount(module, at, what, wanted) : this.unfit(module, at, what, wanted);
  }
}

/** Whether all that it says is written out. */
export function isConstant({ words, locals, globals }: Code): boolean {
  return isEmpty(words) && locals.length === 0 && globals.length === 0;
}

/** Numbers of a list; none when one is no number or too large. */
function coordinates(value: Value): readonly number[] {
  if (typeof value === "number") return [];
  const { items } = value;
  return items.every((item) => typeof item === "number" && Math.abs(item) <= MAX_LENGTH) ? (items as number[]) : [];
}
