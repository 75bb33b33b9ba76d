/** Which values does a file have? Parameters, given or its own, and globals. As `crates/scene/src/procedural/evaluator/module.rs`. */
import { outOfRange } from "../error.ts";
import { Known } from "../known.ts";
import { reached } from "../limits.ts";
import type { Scope } from "../plain/machine.ts";
import { step } from "../random.ts";
import { Globals } from "../stack.ts";
import type { At, Call, Expr, Formal, Parameter, Row } from "../syntax.ts";
import { sizeOf, sizesOf, stepValue, type Value } from "../value.ts";
import { Terminals } from "./terminals.ts";

/** A file with values for its parameters, and the path that belongs to them. */
export interface Instance {
  readonly instance: number;
  readonly path: number;
}

/** Where something is called. */
interface Caller {
  readonly module: number;
  readonly at: At;
}

/** What is called with arguments. */
interface Framed {
  readonly formals: readonly Formal[];
  readonly slots: number;
}

export abstract class Modules extends Terminals {
  /** Files by the values of their parameters. */
  private readonly knownInstances = new Known();
  /** Files with their own defaults. */
  private readonly defaultInstances = new Map<number, number>();

  protected called(scope: Scope, index: number): Call {
    return this.module(scope.module).calls[index] as Call;
  }

  /** One level deeper. */
  protected deeper(scope: Scope, at: At): number {
    const depth = scope.depth + 1;
    if (depth > this.usage.levels) this.usage.levels = depth;
    if (depth > this.limits.levels) throw this.error(scope.module, at, reached("levels", this.limits.levels));
    return depth;
  }

  protected override apply(scope: Scope, index: number): Value {
    const call = this.called(scope, index);
    const depth = this.deeper(scope, call.at);
    const rule = this.module(call.module).functions[call.index];
    if (!rule) throw new Error("a function call leads to a function");
    const inner = this.bound(scope, call, rule, depth, step(scope.path, call.site));
    const value = this.value(inner, rule.at, rule.value);
    this.stack.close(inner.base);
    return value;
  }

  /** Puts a frame on the stack: arguments as the caller computes them, then defaults. */
  protected bound(scope: Scope, call: Call, { formals, slots }: Framed, depth: number, path: number): Scope {
    const instance = this.instanceOf(scope, call);
    const { stack } = this;
    const base = stack.open(slots);
    const inner: Scope = { module: call.module, instance, base, path, depth, level: 0 };
    this.bindArguments(scope, call, base);
    for (const slot of call.missing) {
      const { at, initial } = formals[slot] as Formal;
      this.keepSingle(inner, at, initial as Row, base + slot);
    }
    return inner;
  }

  private bindArguments(scope: Scope, call: Call, base: number): void {
    const { slots, given, row } = call;
    if (slots.length > 0 && this.computes(scope, row) && this.paid(scope)) {
      const { numbers } = this.stack;
      for (let i = 0; i < slots.length; i += 1) numbers[base + (slots[i] as number)] = this.taken(i);
      return;
    }
    given.forEach(({ at, value }, i) => {
      this.stack.set(base + (slots[i] as number), this.value(scope, at, value));
    });
  }

  /** Whose globals the callee sees: those of the caller, or an imported file's with its defaults. */
  private instanceOf(scope: Scope, call: Call): number {
    if (call.alias === undefined) return scope.instance;
    const known = this.defaultInstances.get(call.module);
    if (known !== undefined) return known;
    const given = this.module(call.module).parameters.map(() => undefined);
    const { instance } = this.instance(call.module, given, { module: scope.module, at: call.at });
    this.defaultInstances.set(call.module, instance);
    return instance;
  }

  /** A file with values for its parameters. Equal values, same instance. */
  protected instance(module: number, given: readonly (Value | undefined)[], caller?: Caller): Instance {
    const { parameters, globals } = this.module(module);
    const instance = this.instances.length;
    const values = new Globals(parameters.length + globals.length);
    this.instances.push(values);
    const scope: Scope = { module, instance, base: this.stack.top, path: this.seed, depth: 0, level: 0 };
    const own: Value[] = [];
    let known = this.knownInstances.at(module);
    parameters.forEach((parameter, slot) => {
      const { at, initial } = parameter.formal;
      const value = given[slot] ?? this.single(scope, at, initial as Row);
      this.checkRange(scope, parameter, value, (given[slot] === undefined ? undefined : caller) ?? { module, at });
      scope.path = stepValue(scope.path, value);
      known = known.of(value);
      own.push(value);
      values.set(slot, value);
    });
    const place = caller ?? { module, at: 0 };
    this.countLists({ ...scope, module: place.module }, place.at, own);
    if (known.index !== undefined) {
      this.instances.length = instance;
      return { instance: known.index, path: scope.path };
    }
    globals.forEach((global, i) => {
      const value = this.single(scope, global.at, global.value);
      this.keep(module, global.at, sizeOf(value));
      values.set(parameters.length + i, value);
    });
    this.keep(place.module, place.at, 2 + sizesOf(own));
    known.index = instance;
    return { instance, path: scope.path };
  }

  /** What is given from outside has no place but the parameter's own. */
  private checkRange(scope: Scope, { formal, range }: Parameter, value: Value, where: Caller): void {
    if (!range) return;
    const { module } = scope;
    const ends = range as readonly [Expr, Expr];
    const min = this.number(scope, formal.at, ends[0], "the least value");
    const max = this.number(scope, formal.at, ends[1], "the most value");
    if (min > max) throw this.error(module, formal.at, "this range must be from the least value to the most");
    if (typeof value !== "number") {
      throw this.error(module, formal.at, "a parameter with a range must be a number, and this is a list");
    }
    if (value < min || value > max) {
      throw this.error(where.module, where.at, outOfRange(`\`${formal.name}\``, value, min, max));
    }
  }
}
