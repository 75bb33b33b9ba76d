/**
 * Where does a call lead? Rules draw into the part they are called in; parts and files are parts of their own, shared by
 * equal calls. As `crates/scene/src/procedural/evaluator/call.rs` and `material.rs`.
 */
import { IDENTITY } from "../affine.ts";
import { linearLight } from "../arithmetic.ts";
import { around, aroundPositions, type Bounds, EMPTY, exceeds, placedBounds, union } from "../bounds.ts";
import { outOfRange, unknown } from "../error.ts";
import { type Channels, type Part, PLAIN, type Surface } from "../grown.ts";
import { reached } from "../limits.ts";
import { step, stepName } from "../random.ts";
import type { At, Call, Expr, Formal, MaterialRule, Rule, Statement } from "../syntax.ts";
import { keyOf, sizeOf, sizesOf, stepValue, type Value } from "../value.ts";
import { PHASE, type Scope, type Turtle } from "./state.ts";
import { Terminals } from "./terminals.ts";

/** What is known of a part besides its geometry. */
interface Account {
  finished: boolean;
  /** Parts, glTF files and viewpoints placed in it, with all that they contain. */
  placements: number;
}

/** What is called with arguments. */
interface Framed {
  readonly formals: readonly Formal[];
  readonly slots: number;
}

/** A file with values for its parameters, and the path that belongs to them. */
interface Grown {
  readonly instance: number;
  readonly path: number;
}

/** Where something is called. */
interface Caller {
  readonly module: number;
  readonly at: At;
}

/** What tells a material apart besides its arguments: file, rule and instance. */
const KEY_NUMBERS = 3;

export abstract class Calls extends Terminals {
  private readonly accounts: Account[] = [];
  /** Instances and parts by what they were made with. */
  private readonly known = new Map<string, number>();
  private readonly knownMaterials = new Map<string, number>();
  /** Files with their own defaults. */
  private readonly defaultInstances = new Map<number, number>();
  /** How many calls of a rule are open. */
  private openCalls = new Map<Rule, number>();

  protected abstract visit(scope: Scope, turtle: Turtle, statement: Statement): void;

  /** Grows the first file with the parameters from outside. */
  protected growModel(parameters: ReadonlyMap<string, Value>): void {
    const names = this.module(0).parameters.map(({ formal }) => formal.name);
    for (const name of [...parameters.keys()].sort()) {
      if (!names.includes(name)) throw this.error(0, 0, unknown("parameter", name, names));
    }
    const given = names.map((name) => parameters.get(name));
    this.growFile(0, 0, this.instance(0, given), 0);
    this.usage.parts = this.parts.length;
    this.usage.materials = this.materials.length;
    this.usage.placements = this.account(0).placements;
  }

  private account(part: number): Account {
    return this.accounts[part] as Account;
  }

  private called(scope: Scope, index: number): Call {
    return this.module(scope.module).calls[index] as Call;
  }

  /** Visits what a call leads to. */
  protected follow(scope: Scope, turtle: Turtle, index: number): void {
    const call = this.called(scope, index);
    const depth = this.deeper(scope, call.at);
    if (call.index < 0) {
      this.placeFile(scope, turtle, call, depth);
      return;
    }
    const rule = this.module(call.module).rules[call.index] as Rule;
    const inner = this.bound(scope, call, rule, depth, step(scope.path, call.site));
    if (rule.isPart) this.placePart(scope, call, turtle, rule, inner);
    else this.visitRule(turtle, rule, inner);
    this.close(inner.base);
  }

  protected override apply(scope: Scope, index: number): Value {
    const call = this.called(scope, index);
    const depth = this.deeper(scope, call.at);
    const rule = this.module(call.module).functions[call.index];
    if (!rule) throw new Error("a function call leads to a function");
    const inner = this.bound(scope, call, rule, depth, step(scope.path, call.site));
    const value = this.value(inner, rule.at, rule.value);
    this.close(inner.base);
    return value;
  }

  private deeper(scope: Scope, at: At): number {
    const depth = scope.depth + 1;
    if (depth > this.usage.levels) this.usage.levels = depth;
    if (depth > this.limits.levels) throw this.error(scope.module, at, reached("levels", this.limits.levels));
    return depth;
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

  /** Puts a frame on the stack: arguments as the caller computes them, then defaults. */
  private bound(scope: Scope, call: Call, { formals, slots }: Framed, depth: number, path: number): Scope {
    const instance = this.instanceOf(scope, call);
    const inner = { module: call.module, instance, base: this.open(slots), path, depth, level: 0 };
    call.given.forEach((given, slot) => {
      const argument = call.args[given];
      if (argument) this.assign(inner, slot, this.value(scope, argument.at, argument.value));
    });
    formals.forEach(({ at, initial }, slot) => {
      if (call.given[slot] === -1 && initial) this.assign(inner, slot, this.value(inner, at, initial));
    });
    return inner;
  }

  /** The body of a rule, or what stands in for it when its levels are used up. */
  private visitRule(turtle: Turtle, rule: Rule, frame: Scope): void {
    const level = this.openCalls.get(rule) ?? 0;
    const scope = { ...frame, level };
    const ended = rule.levels && level >= this.number(scope, rule.at, rule.levels, "`levels`");
    const body = ended ? rule.afterwards : rule.body;
    if (!body) return;
    this.openCalls.set(rule, level + 1);
    this.visit(scope, turtle, body);
    this.openCalls.set(rule, level);
  }

  private placePart(caller: Scope, call: Call, turtle: Turtle, rule: Rule, inner: Scope): void {
    const args = this.stack.slice(inner.base, inner.base + rule.formals.length);
    this.countLists(caller, call.at, args);
    const what = [1, inner.module, call.index, inner.instance, turtle.material, ...args.map(keyOf)];
    const key = what.join();
    let part = this.known.get(key);
    if (part === undefined) {
      const path = args.reduce(stepValue, stepName(this.seed, rule.name));
      part = this.begin(caller, call.at, rule.name, false);
      this.keep(caller.module, call.at, sizesOf(args));
      this.known.set(key, part);
      this.notePhase(part, rule.formals);
      const scope = { ...inner, path };
      const declared = rule.within?.map((corner) => this.point3(scope, rule.at, this.value(scope, rule.at, corner)));
      this.inside(part, turtle.material, true, (within) => this.visit(scope, within, rule.body));
      if (declared && exceeds(this.reachOf(part), around(declared))) {
        const problem = `part \`${rule.name}\` reaches beyond what it declares with \`within\`; widen that`;
        throw this.error(inner.module, rule.at, problem);
      }
      this.account(part).finished = true;
    } else if (!this.account(part).finished) {
      const wayOut = "count them down and stop with `if`";
      throw this.error(
        caller.module,
        call.at,
        `part \`${rule.name}\` contains itself with the same parameters; ${wayOut}`,
      );
    }
    this.placeKnown(caller, call.at, turtle, part);
  }

  /** A box around what is in a part: tight around its own triangles, not so around what it places. */
  private reachOf(part: number): Bounds {
    const { meshes, placements } = this.parts[part] as Part;
    let reach = EMPTY;
    for (const { positions } of meshes) reach = union(reach, aroundPositions(positions));
    for (const { part, frame } of placements) {
      reach = union(reach, placedBounds((this.parts[part] as Part).bounds, frame));
    }
    return reach;
  }

  private placeFile(scope: Scope, turtle: Turtle, call: Call, depth: number): void {
    const given = call.given.map((index) => {
      const argument = call.args[index];
      return argument && this.value(scope, argument.at, argument.value);
    });
    const made = this.instance(call.module, given, { module: scope.module, at: call.at });
    const key = [2, made.instance, turtle.material].join();
    let part = this.known.get(key);
    if (part === undefined) {
      this.checkParts(scope, call.at);
      part = this.growFile(turtle.material, call.module, made, depth);
      this.known.set(key, part);
    }
    this.placeKnown(scope, call.at, turtle, part);
  }

  /** The part that a file is as a whole. */
  private growFile(material: number, module: number, { instance, path }: Grown, depth: number): number {
    const { file, body, bodySlots, parameters } = this.module(module);
    const name = (file.split("/").at(-1) ?? "").replace(/\.dcg$/, "");
    const part = this.push(name, false);
    this.notePhase(
      part,
      parameters.map(({ formal }) => formal),
    );
    const base = this.open(bodySlots);
    const scope = { module, instance, base, path, depth, level: 0 };
    this.inside(part, material, true, (turtle) => {
      for (const statement of body) this.visit(scope, turtle, statement);
    });
    this.close(base);
    this.account(part).finished = true;
    return part;
  }

  /** A file with values for its parameters. Equal values, same instance. */
  private instance(module: number, given: readonly (Value | undefined)[], caller?: Caller): Grown {
    const { parameters, globals } = this.module(module);
    const instance = this.instances.length;
    const values: (Value | undefined)[] = [...parameters, ...globals].map(() => undefined);
    this.instances.push(values);
    let scope: Scope = { module, instance, base: this.stack.length, path: this.seed, depth: 0, level: 0 };
    parameters.forEach(({ formal, range }, slot) => {
      const value = given[slot] ?? this.value(scope, formal.at, formal.initial as Expr);
      if (range) {
        const min = this.number(scope, formal.at, range[0], "the least value");
        const max = this.number(scope, formal.at, range[1], "the most value");
        if (min > max) throw this.error(module, formal.at, "this range must be from the least value to the most");
        if (typeof value !== "number") {
          throw this.error(module, formal.at, "a parameter with a range must be a number, and this is a list");
        }
        if (value < min || value > max) {
          // What is given from outside has no place but the parameter's own.
          const own = { module, at: formal.at };
          const where = (given[slot] === undefined ? own : caller) ?? own;
          throw this.error(where.module, where.at, outOfRange(`\`${formal.name}\``, value, min, max));
        }
      }
      scope = { ...scope, path: stepValue(scope.path, value) };
      values[slot] = value;
    });
    const { path } = scope;
    const key = [3, module, ...values.slice(0, parameters.length).map((value) => keyOf(value ?? 0))].join();
    const own = values.slice(0, parameters.length).map((value) => value ?? 0);
    const place = caller ?? { module, at: 0 };
    this.countLists({ ...scope, module: place.module }, place.at, own);
    const known = this.known.get(key);
    if (known !== undefined) {
      this.instances.length = instance;
      return { instance: known, path };
    }
    globals.forEach((global, i) => {
      const value = this.value(scope, global.at, global.value);
      this.keep(module, global.at, sizeOf(value));
      values[parameters.length + i] = value;
    });
    this.keep(place.module, place.at, 2 + sizesOf(own));
    this.known.set(key, instance);
    return { instance, path };
  }

  /** Statements whose geometry is named: a part of its own that is not shared. */
  protected visitCalled(scope: Scope, turtle: Turtle, name: string, body: Statement): void {
    const part = this.begin(scope, 0, name, true);
    this.keepName(scope.module, name);
    this.inside(part, turtle.material, false, (within) => this.visit(scope, within, body));
    this.account(part).finished = true;
    this.placeKnown(scope, 0, turtle, part);
  }

  private checkParts(scope: Scope, at: At): void {
    const limit = this.limits.parts;
    if (this.parts.length >= limit) throw this.error(scope.module, at, reached("parts", limit));
  }

  private begin(scope: Scope, at: At, name: string, isCalled: boolean): number {
    this.checkParts(scope, at);
    return this.push(name, isCalled);
  }

  private push(name: string, isCalled: boolean): number {
    this.parts.push({ name, isCalled, meshes: [], placements: [], models: [], viewpoints: [], bounds: EMPTY });
    this.accounts.push({ finished: false, placements: 0 });
    return this.parts.length - 1;
  }

  private notePhase(part: number, formals: readonly { readonly name: string }[]): void {
    if (formals.some(({ name }) => name === PHASE)) this.phased.add(part);
  }

  /** Visits what is inside of a part, in its own space; a part that is shared does not see which rules are open. */
  private inside(part: number, material: number, isShared: boolean, visit: (turtle: Turtle) => void): void {
    const outer = this.part;
    const { openCalls } = this;
    this.part = part;
    if (isShared) this.openCalls = new Map();
    visit({ frame: IDENTITY, material });
    this.openCalls = openCalls;
    this.part = outer;
  }

  /** Counts what is placed in the part that is being made. */
  protected countPlacements(scope: Scope, at: At, placements: number): void {
    const account = this.account(this.part);
    account.placements += placements;
    const limit = this.limits.placements;
    if (account.placements > limit) throw this.error(scope.module, at, reached("placements", limit));
  }

  private placeKnown(scope: Scope, at: At, turtle: Turtle, part: number): void {
    this.countPlacements(scope, at, 1 + this.account(part).placements);
    const outer = this.parts[this.part] as Part;
    outer.placements.push({ part, frame: turtle.frame });
    outer.bounds = union(outer.bounds, placedBounds((this.parts[part] as Part).bounds, turtle.frame));
  }

  /** The index of the material that a call leads to. */
  protected surface(scope: Scope, index: number): number {
    const call = this.called(scope, index);
    const rule = this.module(call.module).materials[call.index] as MaterialRule;
    const inner = this.bound(scope, call, rule, scope.depth, stepName(this.seed, rule.name));
    const args = this.stack.slice(inner.base);
    this.countLists(scope, call.at, args);
    const key = [call.module, call.index, inner.instance, ...args.map(keyOf)].join();
    let material = this.knownMaterials.get(key);
    if (material === undefined) {
      const limit = this.limits.materials;
      if (this.materials.length >= limit) throw this.error(scope.module, call.at, reached("materials", limit));
      this.keep(scope.module, call.at, KEY_NUMBERS + sizesOf(args));
      material = this.materials.push(this.computedSurface(inner, rule)) - 1;
      this.knownMaterials.set(key, material);
    }
    this.close(inner.base);
    return material;
  }

  private computedSurface(scope: Scope, rule: MaterialRule): Surface {
    const surface = { ...PLAIN, name: rule.name };
    for (const [property, value] of rule.properties) {
      if (property === "colour" || property === "emissive") {
        surface[property] = this.colour(scope, rule.at, value);
        continue;
      }
      const share = this.ranged(scope, rule.at, value, property, 0, 1);
      if (property === "double_sided") surface.doubleSided = share !== 0;
      else if (property === "recolour") surface.recolour = share !== 0;
      else surface[property] = share;
    }
    return surface;
  }

  /** Linear light of a colour. */
  private colour(scope: Scope, at: At, expr: Expr): Channels {
    const value = this.value(scope, at, expr);
    const channels = typeof value === "number" ? [] : value.items;
    const isShare = (channel: Value) => typeof channel === "number" && channel >= 0 && channel <= 1;
    if (channels.length !== 3 || !channels.every(isShare)) {
      throw this.error(scope.module, at, "a colour must be `#rrggbb`, or three numbers from 0 to 1");
    }
    return (channels as number[]).map(linearLight) as unknown as Channels;
  }
}
