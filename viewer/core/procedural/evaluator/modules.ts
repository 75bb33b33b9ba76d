/** Which values does a file have? Parameters, given or its own, and globals. As `crates/scene/src/procedural/evaluator/module.rs`. */
import { DcgError, type Kind, listInRange, outOfRange } from "../error.ts";
import { Known } from "../known.ts";
import { reached } from "../limits.ts";
import { errorAt } from "../link.ts";
import type { Scope } from "../plain/machine.ts";
import { step } from "../random.ts";
import { Globals } from "../stack.ts";
import {
  type Argument,
  type At,
  type Call,
  type Expr,
  type Formal,
  notGiven,
  type Parameter,
  type Row,
} from "../syntax.ts";
import { listedOf, sizeOf, sizesOf, stepValue, type Value } from "../value.ts";
import { Terminals } from "./terminals.ts";

/** A file with values for its parameters, and the path that belongs to them. */
export interface Instance {
  readonly instance: number;
  readonly path: number;
}

/** A place in one of the files. */
interface Place {
  readonly module: number;
  readonly at: At;
}

/** A value, and the place that says it; what is given from outside has none. */
export interface Given {
  readonly value: Value;
  readonly place?: Place;
}

/** A parameter that was given a number in place of a list, or a list in place of a number. */
export interface Odd {
  readonly name: string;
  /** Whether its default is a list. */
  readonly isList: boolean;
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
  protected deeper(scope: Scope, at: At, what = "levels"): number {
    const depth = scope.depth + 1;
    if (depth > this.usage.levels) this.usage.levels = depth;
    if (depth > this.limits.levels) throw this.error(scope.module, at, reached(what, this.limits.levels));
    return depth;
  }

  protected override apply(scope: Scope, index: number): Value {
    const call = this.called(scope, index);
    const depth = this.deeper(scope, call.at, "levels of calls, those of functions too");
    const rule = this.module(call.module).functions[call.index];
    if (!rule) throw new Error("a function call leads to a function");
    const inner = this.bound(scope, call, rule, depth, step(scope.path, call.site));
    try {
      return this.value(inner, rule.value.at, rule.value.of);
    } catch (error) {
      throw this.addCaller(scope.module, call.at, error);
    } finally {
      this.stack.close(inner.base);
    }
  }

  /** Puts a frame on the stack: arguments as the caller computes them, then defaults. */
  protected bound(scope: Scope, call: Call, { formals, slots }: Framed, depth: number, path: number): Scope {
    const instance = this.instanceOf(scope, call);
    const { stack } = this;
    const base = stack.open(slots);
    const inner: Scope = { module: call.module, instance, base, path, depth, level: 0 };
    this.bindArguments(scope, call, base);
    this.bindDefaults(scope, inner, call, formals);
    return inner;
  }

  private bindDefaults(scope: Scope, inner: Scope, call: Call, formals: readonly Formal[]): void {
    try {
      for (const slot of notGiven(call, formals)) {
        this.keepSingle(inner, formals[slot]?.initial as Row, inner.base + slot);
      }
    } catch (error) {
      throw this.addCaller(scope.module, call.at, error);
    }
  }

  /** The same for a call of the same file, whose arguments are computed and lie one behind the other at a place of the stack. */
  protected boundTo(scope: Scope, call: Call, { formals, slots }: Framed, depth: number, first: number): Scope {
    const { stack } = this;
    const base = stack.open(slots);
    const { module, instance } = scope;
    const inner: Scope = { module, instance, base, path: step(scope.path, call.site), depth, level: 0 };
    for (let i = 0; i < call.slots.length; i += 1) {
      stack.numbers[base + (call.slots[i] as number)] = stack.numbers[first + i] as number;
    }
    this.bindDefaults(scope, inner, call, formals);
    return inner;
  }

  private bindArguments(scope: Scope, call: Call, base: number): void {
    const { slots, given, row } = call;
    if (slots.length > 0 && this.computes(scope, row) && this.paid(scope)) {
      const { numbers } = this.stack;
      for (let i = 0; i < slots.length; i += 1) numbers[base + (slots[i] as number)] = this.taken(i);
      return;
    }
    for (let i = 0; i < given.length; i += 1) {
      const { at, of } = given[i] as Argument;
      this.put(scope.module, at, base + (slots[i] as number), this.value(scope, at, of));
    }
  }

  /** Whose globals the callee sees: those of the caller, or an imported file's with its defaults. */
  private instanceOf(scope: Scope, call: Call): number {
    if (call.alias === undefined) return scope.instance;
    const known = this.defaultInstances.get(call.module);
    if (known !== undefined) return known;
    const { instance } = this.instance(call.module, [], { module: scope.module, at: call.at });
    this.defaultInstances.set(call.module, instance);
    return instance;
  }

  /** The first parameter of a file whose default is a list where it is given a number, or the other way round. */
  protected oddOf(module: number, given: (slot: number, name: string) => Value | undefined): Odd | undefined {
    const { parameters } = this.module(module);
    for (let slot = 0; slot < parameters.length; slot += 1) {
      const { name, initial } = (parameters[slot] as Parameter).formal;
      const value = given(slot, name);
      const isList = initial && isListed(initial.of[0] as Expr);
      if (value !== undefined && isList !== undefined && isList === (typeof value === "number"))
        return { name, isList };
    }
    return undefined;
  }

  /** A file with values for its parameters. Equal values, same instance. */
  protected instance(module: number, given: readonly (Given | undefined)[], caller?: Place): Instance {
    const { parameters, globals } = this.module(module);
    const instance = this.instances.length;
    const values = new Globals(parameters.length + globals.length);
    this.instances.push(values);
    const scope: Scope = { module, instance, base: this.stack.top, path: this.seed, depth: 0, level: 0 };
    const { held } = this.stack;
    const own: Value[] = [];
    let known = this.knownInstances.at(module);
    parameters.forEach((parameter, slot) => {
      const { value, place } = given[slot] ?? this.tracedTo(caller, () => this.ownValue(scope, parameter));
      this.hold(place?.module ?? module, place?.at ?? parameter.formal.at, listedOf(value));
      this.checkRange(scope, parameter, value, place);
      scope.path = stepValue(scope.path, value);
      known = known.of(value);
      own.push(value);
      values.set(slot, value);
    });
    this.stack.held = held;
    const place = caller ?? { module, at: 0 };
    this.countLists({ ...scope, module: place.module }, place.at, own);
    if (known.index !== undefined) {
      this.instances.length = instance;
      return { instance: known.index, path: scope.path };
    }
    globals.forEach((global, i) => {
      const value = this.tracedTo(caller, () => this.single(scope, global.value));
      this.keep(module, global.at, sizeOf(value));
      values.set(parameters.length + i, value);
    });
    this.keep(place.module, place.at, 2 + sizesOf(own));
    known.index = instance;
    return { instance, path: scope.path };
  }

  /** Runs what a call leads to, if it is one. */
  private tracedTo<T>(caller: Place | undefined, run: () => T): T {
    return caller ? this.traced(caller.module, caller.at, run) : run();
  }

  private ownValue(scope: Scope, { formal: { at, initial } }: Parameter): Given {
    const value = this.single(scope, initial as Row);
    return { value, place: { module: scope.module, at: initial?.places[0] ?? at } };
  }

  private checkRange(scope: Scope, { formal, range }: Parameter, value: Value, place: Place | undefined): void {
    if (!range) return;
    const refused = (problem: string, kind?: Kind) =>
      place
        ? errorAt(this.module(place.module), place.at, problem, kind)
        : DcgError.ofWhole(this.module(scope.module).file, problem);
    const [least, most] = range;
    const min = this.number(scope, least.at, least.of, "the least value");
    const max = this.number(scope, most.at, most.of, "the most value");
    if (min > max) {
      throw this.error(scope.module, least.at, "this range must be from the least value to the most");
    }
    if (typeof value !== "number") throw refused(listInRange(formal.name), "list in range");
    if (value < min || value > max) throw refused(outOfRange(`\`${formal.name}\``, value, min, max));
  }
}

/** Whether it is a list, where one can see that. */
function isListed(expr: Expr): boolean | undefined {
  switch (expr.kind) {
    case "list":
    case "colour":
      return true;
    case "local":
    case "global":
    case "if":
    case "item":
    case "call":
      return undefined;
    case "builtin":
      return expr.name === "mix" ? undefined : false;
    default:
      return false;
  }
}
