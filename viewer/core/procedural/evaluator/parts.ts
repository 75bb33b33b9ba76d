/** What is shared? Parts and files are pieces of their own, made once for equal calls. As `crates/scene/src/procedural/evaluator/part.rs`. */
import { type Affine, after, IDENTITY, type Vector } from "../affine.ts";
import { type Bounds, beyond, Reach } from "../bounds.ts";
import { beyondDeclared, DcgError, givenInstead, unknownArgument } from "../error.ts";
import { Known } from "../known.ts";
import { type Amounts, reached } from "../limits.ts";
import type { Program } from "../link.ts";
import type { Scope } from "../plain/machine.ts";
import { stepName } from "../random.ts";
import type { At, Call, Rule, Statement, Written } from "../syntax.ts";
import { listedOf, sizesOf, stepValue, type Value } from "../value.ts";
import { foreseen } from "./foreseen.ts";
import { Materials } from "./materials.ts";
import type { Given, Instance } from "./modules.ts";
import { type Boxes, PHASE, type Turtle } from "./state.ts";

/** What is known of a part besides its geometry. */
interface Account {
  finished: boolean;
  /** Parts, glTF files and viewpoints placed in it, with all that they contain. */
  placements: number;
  /** Where each of its own glTF files is placed. */
  readonly models: { readonly module: number; readonly at: At }[];
}

type Kind<K extends Statement["kind"]> = Extract<Statement, { kind: K }>;

export abstract class Parts extends Materials {
  private readonly accounts: Account[] = [];
  /** Parts of rules and of files by what they were made with. */
  private readonly knownParts = new Known();
  private readonly knownFiles = new Known();
  /** Boxes around glTF files that were placed. */
  private readonly knownBoxes = new Map<string, Reach>();
  /** Where the rules of each file begin among those of all. */
  private readonly firstRules: readonly number[];
  private readonly rules: number;
  /** How many calls of each rule are open. */
  private openCalls: Int32Array;

  constructor(program: Program, seed: number, detail: number, limits: Readonly<Amounts>, boxes: Boxes) {
    super(program, seed, detail, limits, boxes);
    let rules = 0;
    this.firstRules = program.modules.map((module) => {
      rules += module.rules.length;
      return rules - module.rules.length;
    });
    this.rules = rules;
    this.openCalls = new Int32Array(rules);
  }

  protected abstract visit(scope: Scope, turtle: Turtle, statement: Statement): void;

  /** Grows the first file with the parameters from outside. */
  protected growModel(parameters: ReadonlyMap<string, Value>): void {
    const names = this.module(0).parameters.map(({ formal }) => formal.name);
    const shown = this.module(0).parameters.map((parameter) => parameter.shown);
    for (const name of [...parameters.keys()].sort()) {
      const { file } = this.module(0);
      if (!names.includes(name)) throw DcgError.ofWhole(file, unknownArgument(name, file, names, shown));
    }
    const given = names.map((name) => {
      const value = parameters.get(name);
      return value === undefined ? undefined : { value };
    });
    this.growFile(0, this.instance(0, given), 0, this.turtles.first(0));
    this.usage.parts = this.parts.length;
    this.usage.materials = this.materials.length;
    this.usage.files = this.program.modules.length;
    this.usage.placements = this.account(0).placements;
  }

  private account(part: number): Account {
    return this.accounts[part] as Account;
  }

  /** The body of a rule, or what stands in for it when its levels are used up. */
  protected visitRule(turtle: Turtle, rule: Rule, index: number, scope: Scope): void {
    const { openCalls } = this;
    const place = (this.firstRules[scope.module] as number) + index;
    const level = openCalls[place] as number;
    scope.level = level;
    let { body } = rule;
    if (rule.levels) {
      this.singleNumber(scope, rule.levels, "`levels`");
      if (level >= this.taken(0)) {
        if (!rule.afterwards) return;
        body = rule.afterwards;
      }
    }
    openCalls[place] = level + 1;
    this.visit(scope, turtle, body);
    openCalls[place] = level;
  }

  /** How many calls of a rule are open. */
  protected openCallsOf(module: number, rule: number): number {
    return this.openCalls[(this.firstRules[module] as number) + rule] as number;
  }

  protected placePart(caller: Scope, call: Call, turtle: Turtle, rule: Rule, inner: Scope): void {
    const args = this.stack.slice(inner.base, rule.formals.length);
    this.countLists(caller, call.at, args);
    const material = this.turtles.material(turtle);
    let known = this.knownParts.at(inner.module).at(call.index).at(inner.instance).at(material);
    for (const value of args) known = known.of(value);
    let part = known.index;
    if (part === undefined) {
      const path = args.reduce(stepValue, stepName(this.seed, rule.name));
      part = this.begin(caller, call.at, rule.name, false);
      this.keep(caller.module, call.at, sizesOf(args));
      known.index = part;
      this.notePhase(part, rule.formals);
      const scope = { ...inner, path };
      const declared = this.declaredBounds(scope, rule);
      this.inside(part, turtle, true, (within) => this.visit(scope, within, rule.body));
      const reach = declared && beyond(this.boundsOf(part), declared);
      if (reach) {
        // The model that is to blame, where it is one.
        const found = this.modelBeyond(part, declared) ?? { module: inner.module, at: rule.at, reach };
        const { towards, byM } = found.reach;
        throw this.error(found.module, found.at, beyondDeclared(rule.name, towards, byM));
      }
      this.finish(part);
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

  private declaredBounds(scope: Scope, { within }: Rule): Bounds | undefined {
    if (!within) return undefined;
    const corner = ({ at, of }: Written) =>
      this.point3(scope, at, "a corner of `within`", this.value(scope, at, of)) as Vector;
    const [min, max] = [corner(within[0]), corner(within[1])];
    if (min[0] > max[0] || min[1] > max[1] || min[2] > max[2]) {
      const wanted = "from the corner of the least x, y and z to that of the most";
      throw this.error(scope.module, within[0].at, `\`within\` must be ${wanted}`);
    }
    return { min, max };
  }

  /** A box around what is in a part: tight around its own triangles, not so around what it places. */
  private boundsOf(part: number): Bounds {
    const { meshes, placements, models } = this.growing(part);
    const reach = new Reach();
    for (const { positions } of meshes) reach.positions(positions);
    for (const { part, frame } of placements) reach.placedIn(this.reach(part), frame);
    for (const { path, frame } of models) reach.placedIn(this.boxOf(path), frame);
    return reach.bounds;
  }

  /** The box around a glTF file; empty where it is not known. */
  private boxOf(path: string): Reach {
    let box = this.knownBoxes.get(path);
    if (!box) {
      box = new Reach();
      const bounds = this.boxes(path);
      if (bounds) box.box(...bounds.min, ...bounds.max);
      this.knownBoxes.set(path, box);
    }
    return box;
  }

  /** Places a glTF file. */
  protected addModel(scope: Scope, turtle: Turtle, { at, path }: Kind<"model">): void {
    const frame = this.turtles.frame(turtle);
    this.account(this.part).models.push({ module: scope.module, at });
    this.growing(this.part).models.push({ path, frame });
    this.reach(this.part).placedIn(this.boxOf(path), frame);
  }

  /** Where a glTF file is placed that reaches beyond a box, in a part or in what that places; and how it does. */
  private modelBeyond(whole: number, declared: Bounds) {
    const left = [{ part: whole, frame: IDENTITY }];
    const outside = (reach: Reach, frame: Affine) => {
      const placed = new Reach();
      placed.placedIn(reach, frame);
      return beyond(placed.bounds, declared);
    };
    for (let top = left.pop(); top; top = left.pop()) {
      const { frame } = top;
      const { models, placements } = this.growing(top.part);
      for (const [i, model] of models.entries()) {
        const reach = outside(this.boxOf(model.path), after(frame, model.frame));
        const place = this.account(top.part).models[i];
        if (reach && place) return { ...place, reach };
      }
      for (const child of [...placements].reverse()) {
        const inner = after(frame, child.frame);
        if (outside(this.reach(child.part), inner)) left.push({ part: child.part, frame: inner });
      }
    }
    return undefined;
  }

  protected placeFile(scope: Scope, turtle: Turtle, call: Call, depth: number): void {
    const given: Given[] = [];
    const { module } = scope;
    const { held } = this.stack;
    call.given.forEach(({ at, of }, i) => {
      const value = this.value(scope, at, of);
      this.hold(module, at, listedOf(value));
      given[call.slots[i] as number] = { value, place: { module, at } };
    });
    try {
      const made = this.instance(call.module, given, { module, at: call.at });
      this.stack.held = held;
      const known = this.knownFiles.at(made.instance).at(this.turtles.material(turtle));
      if (known.index === undefined) {
        this.checkParts(scope, call.at);
        known.index = this.traced(module, call.at, () => this.growFile(call.module, made, depth, turtle));
      }
      this.placeKnown(scope, call.at, turtle, known.index);
    } catch (error) {
      // What is given out of a range is named already.
      if (error instanceof DcgError && error.kind === "of value") {
        const odd = this.oddOf(call.module, (slot) => given[slot]?.value);
        if (odd) error.addGiven(givenInstead(odd.name, odd.isList, this.module(call.module).file));
      }
      throw error;
    }
  }

  /** The part that a file is as a whole. */
  private growFile(module: number, { instance, path }: Instance, depth: number, outer: Turtle): number {
    const { file, body, bodySlots, parameters } = this.module(module);
    const name = (file.split("/").at(-1) ?? "").replace(/\.dcg$/i, "");
    const part = this.push(name, false);
    this.notePhase(
      part,
      parameters.map(({ formal }) => formal),
    );
    const base = this.stack.open(bodySlots);
    const scope = { module, instance, base, path, depth, level: 0 };
    this.inside(part, outer, true, (turtle) => {
      for (const statement of body) this.visit(scope, turtle, statement);
    });
    this.stack.close(base);
    this.finish(part);
    return part;
  }

  /** Statements whose geometry is named: a part of its own that is not shared. */
  protected visitCalled(scope: Scope, turtle: Turtle, { at, name, body }: Kind<"called">): void {
    const part = this.begin(scope, at, name, true);
    this.keepName(scope.module, at, name);
    this.inside(part, turtle, false, (within) => this.visit(scope, within, body));
    this.finish(part);
    this.placeKnown(scope, at, turtle, part);
  }

  private checkParts(scope: Scope, at: At): void {
    const limit = this.limits.parts;
    if (this.parts.length >= limit) throw this.error(scope.module, at, reached("parts", limit));
  }

  private begin(scope: Scope, at: At, name: string, isCalled: boolean): number {
    this.checkParts(scope, at);
    return this.push(name, isCalled);
  }

  /** Makes a part. */
  private push(name: string, isCalled: boolean): number {
    const reach = new Reach();
    const { bounds } = reach;
    this.parts.push({ name, isCalled, meshes: [], placements: [], models: [], viewpoints: [], bounds });
    this.reaches.push(reach);
    this.accounts.push({ finished: false, placements: 0, models: [] });
    return this.parts.length - 1;
  }

  private finish(part: number): void {
    this.account(part).finished = true;
    const grown = this.growing(part);
    // Its corners are rounded when they are written.
    this.reach(part).toSingle();
    grown.bounds = this.reach(part).bounds;
    for (const mesh of grown.meshes) mesh.finish();
  }

  private notePhase(part: number, formals: readonly { readonly name: string }[]): void {
    if (formals.some(({ name }) => name === PHASE)) this.phased.add(part);
  }

  /** Visits what is inside of a part, in its own space; a part that is shared does not see which rules are open. */
  private inside(part: number, from: Turtle, isShared: boolean, visit: (turtle: Turtle) => void): void {
    const outer = this.part;
    const { openCalls } = this;
    this.part = part;
    if (isShared) this.openCalls = new Int32Array(this.rules);
    visit(this.turtles.fresh(from, this.turtles.material(from)));
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

  /** Refuses so many turns of a statement that will place too much, where they would come to it. */
  protected foresee(scope: Scope, turns: number, body: Statement): void {
    const limit = this.limits.placements;
    const left = limit - this.account(this.part).placements;
    const at = foreseen(this.program, scope.module, turns, body, left);
    if (at !== undefined) throw this.error(scope.module, at, reached("placements", limit));
  }

  private placeKnown(scope: Scope, at: At, turtle: Turtle, part: number): void {
    this.countPlacements(scope, at, 1 + this.account(part).placements);
    this.growing(this.part).placements.push({ part, frame: this.turtles.frame(turtle) });
    this.reach(this.part).placed(this.reach(part), this.turtles.numbers, turtle);
  }
}
