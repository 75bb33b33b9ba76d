/**
 * What is the value of an expression, node by node? Asked where it is not computed at one go. As
 * `crates/scene/src/procedural/evaluator/expression.rs`.
 */
import { atan2, cosine, power, sine } from "../arithmetic.ts";
import { DIVISION_BY_ZERO, notComputed, outOfRange, shown } from "../error.ts";
import { MAX_LIST, MAX_LIST_DEPTH, reached } from "../limits.ts";
import { fractal, isWhole, MAX_NOISE, MAX_OCTAVES, MAX_POWER } from "../operation.ts";
import type { Scope } from "../plain/machine.ts";
import { fraction, step } from "../random.ts";
import type { Range } from "../ranges.ts";
import type { At, Expr, Operator, Row, Written } from "../syntax.ts";
import { type List, listedOf, listOf, sizeOf, type Value } from "../value.ts";
import { Plain } from "./plain.ts";

type Kind<K extends Expr["kind"]> = Extract<Expr, { kind: K }>;

export abstract class Expressions extends Plain {
  /** The value of a function of the file. */
  protected abstract apply(scope: Scope, call: number): Value;

  /** The value of a row of one. */
  protected single(scope: Scope, row: Row): Value {
    if (this.computes(scope, row) && this.paid(scope)) return this.taken(0);
    return this.only(scope, row);
  }

  /** The same, node by node. */
  protected only(scope: Scope, { of, places }: Row): Value {
    return this.value(scope, places[0] as At, of[0] as Expr);
  }

  /** Puts the value of a row of one into a place on the stack. */
  protected keepSingle(scope: Scope, row: Row, place: number): void {
    if (this.computes(scope, row) && this.paid(scope)) this.stack.numbers[place] = this.taken(0);
    else this.put(scope.module, row.places[0] as At, place, this.only(scope, row));
  }

  /** Computes a row of one that must be a number, the result; `what` it is for. */
  protected singleNumber(scope: Scope, row: Row, what: string): void {
    if (this.computes(scope, row) && this.paid(scope)) return;
    this.give(this.number(scope, row.places[0] as At, row.of[0] as Expr, what));
  }

  /** Computes a row of numbers, each within a range of its own: the results. */
  protected rangedRow(scope: Scope, row: Row, ranges: readonly Range[]): void {
    if (this.computes(scope, row) && this.areWithin(row.of.length, ranges) && this.paid(scope)) return;
    const numbers = row.of.map((expr, i) => {
      const { what, min, max } = ranges[i] as Range;
      const at = row.places[i] as At;
      return this.within(scope, at, this.number(scope, at, expr, what), what, min, max);
    });
    this.give(...numbers);
  }

  private areWithin(count: number, ranges: readonly Range[]): boolean {
    for (let i = 0; i < count; i += 1) {
      const { min, max } = ranges[i] as Range;
      const number = this.taken(i);
      if (!(min <= number && number <= max)) return false;
    }
    return true;
  }

  protected value(scope: Scope, at: At, expr: Expr): Value {
    if (!this.enters()) throw this.refused(scope, at);
    const value = this.anyValue(scope, at, expr);
    this.ascend();
    return value;
  }

  private anyValue(scope: Scope, at: At, expr: Expr): Value {
    switch (expr.kind) {
      case "local":
        return this.stack.get(scope.base + expr.slot);
      case "global":
        return this.global(scope, expr.use);
      case "colour":
        return listOf(expr.channels);
      case "list":
        return this.madeList(scope, expr);
      case "item":
        return this.item(scope, expr);
      case "if":
        return this.value(scope, at, this.condition(scope, at, expr.condition) ? expr.yes : expr.no);
      case "call":
        return this.apply(scope, expr.call);
      case "builtin":
        return expr.name === "mix" ? this.mix(scope, expr) : this.builtIn(scope, expr);
      default:
        return this.computed(scope, at, expr);
    }
  }

  /** A value that must be a number; `what` it is for. */
  protected number(scope: Scope, at: At, expr: Expr, what: string): number {
    switch (expr.kind) {
      case "number":
        return expr.value;
      case "binary":
      case "minus":
      case "detail":
      case "level": {
        if (!this.enters()) throw this.refused(scope, at);
        const number = this.computed(scope, at, expr);
        this.ascend();
        return number;
      }
    }
    const value = expr.kind === "local" ? this.stack.get(scope.base + expr.slot) : this.value(scope, at, expr);
    if (typeof value !== "number") {
      throw this.unfit(scope.module, at, what, "a number, and this is a list");
    }
    return value;
  }

  private condition(scope: Scope, at: At, expr: Expr): boolean {
    return this.number(scope, at, expr, "a condition") !== 0;
  }

  /** A number within a range. */
  protected ranged(scope: Scope, { at, of }: Written, what: string, min: number, max: number): number {
    return this.within(scope, at, this.number(scope, at, of, what), what, min, max);
  }

  protected within(scope: Scope, at: At, value: number, what: string, min: number, max: number): number {
    if (min <= value && value <= max) return value;
    throw this.error(scope.module, at, outOfRange(what, value, min, max));
  }

  protected list(scope: Scope, at: At, expr: Expr, what: string): List {
    const value = this.value(scope, at, expr);
    if (typeof value === "number") {
      throw this.unfit(scope.module, at, what, "a list, and this is a number");
    }
    return value;
  }

  /** A list that is written out. Of one that becomes too long no more is computed. */
  private madeList(scope: Scope, { at, items }: Kind<"list">): List {
    const values: Value[] = [];
    let size = 0;
    for (const item of items) {
      const value = this.value(scope, at, item);
      size += sizeOf(value);
      if (size >= MAX_LIST) throw this.error(scope.module, at, reached("numbers in a list", MAX_LIST));
      this.hold(scope.module, at, sizeOf(value));
      values.push(value);
    }
    this.release(size);
    const list = listOf(values);
    if (list.depth > MAX_LIST_DEPTH) {
      throw this.error(scope.module, at, reached("lists inside each other", MAX_LIST_DEPTH));
    }
    return list;
  }

  private global(scope: Scope, index: number): Value {
    const use = this.module(scope.module).uses[index];
    const value = this.globals(scope).get(use?.slot ?? 0);
    if (value === undefined) {
      throw this.error(
        scope.module,
        use?.at ?? 0,
        notComputed(use?.name ?? "", this.wayToCompute(scope, use?.slot ?? 0)),
      );
    }
    return value;
  }

  /** What would have a value computed before it is asked for. */
  private wayToCompute(scope: Scope, slot: number): string {
    const { length } = this.module(scope.module).parameters;
    if (slot < length) return "move its `parameter` up";
    for (let i = 0; i < length; i += 1) {
      if (this.globals(scope).get(i) === undefined)
        return "defaults of parameters can use parameters above, and no `let`";
    }
    return "move its `let` up";
  }

  private item(scope: Scope, { at, of, index }: Kind<"item">): Value {
    const list = this.list(scope, at, of, "what has items");
    const { items } = list;
    // A named list is counted where it is named; another only while the index is computed.
    const size = isOfName(of) ? 0 : sizeOf(list);
    this.hold(scope.module, at, size);
    const number = this.number(scope, at, index, "the number of an item");
    this.release(size);
    const item = items[Math.floor(number)];
    if (item !== undefined) return item;
    throw this.error(
      scope.module,
      at,
      `there is no item ${shown(number)}: the list has ${items.length}, counted from 0`,
    );
  }

  /** Numbers that are made of numbers. */
  private computed(scope: Scope, at: At, expr: Expr): number {
    switch (expr.kind) {
      case "number":
        return expr.value;
      case "detail":
        return this.detail;
      case "level":
        return scope.level;
      case "minus":
        return -this.number(scope, at, expr.of, "what follows `-`");
      case "not":
        return this.condition(scope, at, expr.of) ? 0 : 1;
      case "and":
        return this.condition(scope, at, expr.left) && this.condition(scope, at, expr.right) ? 1 : 0;
      case "or":
        return this.condition(scope, at, expr.left) || this.condition(scope, at, expr.right) ? 1 : 0;
      case "binary": {
        const left = this.number(scope, expr.at, expr.left, "what is computed with");
        const right = this.number(scope, expr.at, expr.right, "what is computed with");
        return this.binary(scope, expr.at, expr.operator, left, right);
      }
      default:
        throw new Error(`a ${expr.kind} may be a list`);
    }
  }

  private binary(scope: Scope, at: At, operator: Operator, a: number, b: number): number {
    switch (operator) {
      case "+":
        return this.finite(scope, at, a + b);
      case "-":
        return this.finite(scope, at, a - b);
      case "*":
        return this.finite(scope, at, a * b);
      case "/":
        if (b === 0) throw this.error(scope.module, at, DIVISION_BY_ZERO);
        return this.finite(scope, at, a / b);
      case "==":
        return a === b ? 1 : 0;
      case "!=":
        return a === b ? 0 : 1;
      case "<":
        return a < b ? 1 : 0;
      case "<=":
        return a <= b ? 1 : 0;
      case ">":
        return a > b ? 1 : 0;
      case ">=":
        return a >= b ? 1 : 0;
    }
  }

  private finite(scope: Scope, at: At, number: number): number {
    if (Number.isFinite(number)) return number;
    const wayOut = "keep its operands within range";
    throw this.error(scope.module, at, `this result is not a finite number here; ${wayOut}`);
  }

  private builtIn(scope: Scope, expr: Kind<"builtin">): number {
    const { at, name, site, args } = expr;
    if (name === "count") {
      const { at, of } = args[0] as Written;
      return this.list(scope, at, of, "what is counted").items.length;
    }
    const a = this.operand(scope, args[0]);
    const b = this.operand(scope, args[1]);
    const c = this.operand(scope, args[2]);
    if (name !== "random") return this.finite(scope, at, this.applied(scope, expr, a, b, c));
    const part = fraction(step(scope.path, site));
    return args.length === 0 ? part : this.finite(scope, at, a + (b - a) * part);
  }

  private operand(scope: Scope, written: Written | undefined): number {
    return written ? this.number(scope, written.at, written.of, "an argument of this function") : 0;
  }

  private applied(scope: Scope, expr: Kind<"builtin">, a: number, b: number, c: number): number {
    const { name } = expr;
    const place = (argument: number) => expr.args[argument]?.at ?? expr.at;
    switch (name) {
      case "abs":
        return Math.abs(a);
      case "atan2":
        return atan2(a, b);
      case "ceil":
        return -Math.floor(-a);
      case "clamp":
        return a < b ? b : a > c ? c : a;
      case "cos":
        return cosine(a);
      case "floor":
        return Math.floor(a);
      case "max":
        return a > b ? a : b;
      case "min":
        return a < b ? a : b;
      case "mod":
        if (b === 0) throw this.error(scope.module, place(1), DIVISION_BY_ZERO);
        return a - b * Math.floor(a / b);
      case "noise":
        return this.fractal(scope, expr, a, b, 1);
      case "fractal":
        return this.fractal(scope, expr, a, b, c);
      case "power":
        this.within(scope, place(1), b, "a power", -MAX_POWER, MAX_POWER);
        if (isWhole(b)) return power(a, b);
        throw this.error(scope.module, place(1), "a power must be a whole number; roots are taken by `sqrt`");
      case "round":
        return Math.floor(a + 0.5);
      case "sin":
        return sine(a);
      case "sqrt":
        if (a < 0) throw this.error(scope.module, place(0), "what a root is taken of must be 0 or more");
        return Math.sqrt(a);
      case "count":
      case "mix":
      case "random":
        throw new Error(`${name} is not made of its arguments alone`);
    }
  }

  private fractal(scope: Scope, { at, args }: Kind<"builtin">, x: number, z: number, octaves: number): number {
    const count = Math.floor(this.within(scope, args[2]?.at ?? at, octaves, "octaves", 1, MAX_OCTAVES));
    this.count(scope, at, count);
    const what = count === 1 ? "a coordinate of noise" : "a coordinate of noise with so many octaves";
    // Coordinates of the last octave are twice as large for each before it.
    const most = MAX_NOISE / 2 ** (count - 1);
    this.within(scope, (args[0] as Written).at, x, what, -most, most);
    this.within(scope, (args[1] as Written).at, z, what, -most, most);
    return fractal(this.seed, x, z, count);
  }

  /** Between two numbers, or item by item between two lists. */
  private mix(scope: Scope, { at, args }: Kind<"builtin">): Value {
    const [first, second, third] = args as readonly [Written, Written, Written];
    const from = this.value(scope, first.at, first.of);
    this.hold(scope.module, first.at, listedOf(from));
    const to = this.value(scope, second.at, second.of);
    this.hold(scope.module, second.at, listedOf(to));
    const part = this.number(scope, third.at, third.of, "the third argument of `mix`");
    this.release(listedOf(from) + listedOf(to));
    this.count(scope, at, sizeOf(from));
    return this.mixed(scope, at, from, to, part);
  }

  private mixed(scope: Scope, at: At, from: Value, to: Value, part: number): Value {
    if (typeof from === "number" && typeof to === "number") return this.finite(scope, at, from + (to - from) * part);
    if (typeof from !== "number" && typeof to !== "number" && from.items.length === to.items.length) {
      return listOf(from.items.map((item, i) => this.mixed(scope, at, item, to.items[i] as Value, part)));
    }
    throw this.unfit(scope.module, at, "what is mixed", "two numbers, or two lists of the same shape");
  }
}

/** Whether it is a value that has a name, or an item of one. */
function isOfName(expr: Expr): boolean {
  let of = expr;
  while (of.kind === "item") of = of.of;
  return of.kind === "local" || of.kind === "global";
}
