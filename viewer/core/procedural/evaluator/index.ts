/**
 * What grows out of the rules? A traversal of the graph, depth first and from left to right (Schmalstieg 1997, §8.3), as
 * `crates/scene/src/procedural/evaluator` does it: the same steps, the same counts, the same bits. Each file adds what it
 * knows to the one before: `state`, `plain`, `expressions`, `outlines`, `terminals`, `modules`, `materials`, `parts`, `calls`, `sidebyside`,
 * `enumerators`, `places`, and here what each node does.
 */

import { withinStack } from "../depth.ts";
import { DcgError, givenInstead } from "../error.ts";
import type { Grown } from "../grown.ts";
import { type Amounts, FINEST, LIMITS } from "../limits.ts";
import type { Program } from "../link.ts";
import type { Scope } from "../plain/machine.ts";
import type { At, Statement } from "../syntax.ts";
import type { Value } from "../value.ts";
import { Places } from "./places.ts";
import type { Boxes, Turtle } from "./state.ts";

/** What can be chosen besides the text. */
export interface Settings {
  /** Where random numbers come from: 32 bits. */
  readonly seed?: number;
  /** Level of detail, from 0 (coarsest) to {@link FINEST}. */
  readonly detail?: number;
  /** Values for parameters of the first file. */
  readonly parameters?: ReadonlyMap<string, Value>;
  /**
   * The box around each glTF file that the rules place, by the path that they give. Those whose box is given are in the bounds
   * of what places them, and must lie in what a part declares.
   */
  readonly models?: Boxes;
  /** What may be taken; what is not said is as by default. */
  readonly limits?: Readonly<Partial<Amounts>>;
}

/** Grows a model: all its triangles. Throws a `DcgError`. */
export function grow(program: Program, settings: Settings = {}): Grown {
  const limits = { ...LIMITS, ...settings.limits };
  const detail = Math.min(settings.detail ?? FINEST, FINEST);
  const boxes = settings.models ?? (() => undefined);
  const evaluator = new Evaluator(program, (settings.seed ?? 0) | 0, detail, limits, boxes);
  const file = program.modules[0]?.file ?? "";
  return withinStack(file, () => evaluator.grow(settings.parameters ?? new Map()));
}

class Evaluator extends Places {
  grow(parameters: ReadonlyMap<string, Value>): Grown {
    try {
      this.growModel(parameters);
    } catch (error) {
      if (error instanceof DcgError) this.noteGiven(error, parameters);
      throw error;
    }
    return { parts: this.parts, materials: this.materials, usage: this.usage };
  }

  /**
   * Names the parameter that was given a number in place of a list, or a list in place of a number, with a mistake of the text
   * about what a value must be.
   */
  private noteGiven(error: DcgError, parameters: ReadonlyMap<string, Value>): void {
    const isOfValue = error.kind === "of value" || error.kind === "list in range";
    if (error.line === 0 || !isOfValue) return;
    const odd = this.oddOf(0, (_, name) => parameters.get(name));
    if (odd) error.addGiven(givenInstead(odd.name, odd.isList));
  }

  protected override visit(scope: Scope, turtle: Turtle, statement: Statement): void {
    if (!this.enters()) throw this.refused(scope, this.placeOf(scope, statement));
    this.act(scope, turtle, statement);
    this.ascend();
  }

  private act(scope: Scope, turtle: Turtle, statement: Statement): void {
    switch (statement.kind) {
      case "group":
        for (const inner of statement.of) this.visit(scope, turtle, inner);
        return;
      case "let":
        this.keepSingle(scope, statement.value, scope.base + statement.slot);
        return;
      case "if": {
        this.singleNumber(scope, statement.condition, "a condition");
        const chosen = this.taken(0) === 0 ? statement.no : statement.yes;
        if (chosen) this.visit(scope, turtle, chosen);
        return;
      }
      case "choose": {
        this.singleNumber(scope, statement.number, "what is chosen by");
        const number = Math.floor(this.taken(0));
        const chosen = statement.of[Math.max(0, Math.min(number, statement.of.length - 1))];
        if (chosen) this.visit(scope, turtle, chosen);
        return;
      }
      case "place":
        this.visit(scope, this.placed(scope, turtle, statement), statement.body);
        return;
      case "paint":
        this.visit(scope, this.turtles.painted(turtle, this.surface(scope, statement.call)), statement.body);
        return;
      case "called":
        this.visitCalled(scope, turtle, statement);
        return;
      case "call":
        this.follow(scope, turtle, statement.call);
        return;
      case "solid":
        this.draw(scope, turtle, statement);
        return;
      case "viewpoint":
        this.countPlacements(scope, statement.at, 1);
        this.keepName(scope.module, statement.at, statement.name);
        this.growing(this.part).viewpoints.push({ name: statement.name, frame: this.turtles.frame(turtle) });
        return;
      case "impostor":
        this.growing(this.part).impostor = this.wish(scope, statement);
        return;
      case "model":
        this.countPlacements(scope, statement.at, 1);
        this.keepName(scope.module, statement.at, statement.path);
        this.addModel(scope, turtle, statement);
        return;
      case "for":
        this.repeat(scope, turtle, statement);
        return;
      case "scatter":
        this.scatter(scope, turtle, statement);
        return;
      case "edges":
        this.followEdges(scope, turtle, statement);
        return;
      case "heights":
        this.drawHeights(scope, turtle, statement);
        return;
    }
  }

  /** Where a node stands in the text, to say that something ended there. */
  private placeOf(scope: Scope, statement: Statement): At {
    switch (statement.kind) {
      case "call":
      case "paint":
        return this.module(scope.module).calls[statement.call]?.at ?? 0;
      case "group":
        return statement.of[0] ? this.placeOf(scope, statement.of[0]) : 0;
      default:
        return statement.at;
    }
  }
}
