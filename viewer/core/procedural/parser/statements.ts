/** What is done at a place? Groups, selections, values, transforms, materials, calls, solids and enumerators. */
import {
  argumentTwice,
  ELSE,
  Fault,
  LET_IN_CHOOSE,
  later,
  missingNumber,
  noStatement,
  nothingBehind,
  THEN,
  tooManyArguments,
  unclosed,
  unknownArgument,
  withoutLet,
} from "../error.ts";
import { type Formals, IMPOSTOR, listsOf, SOLIDS, type SolidKind, solidNamed } from "../solid/kinds.ts";
import { type At, isBuiltIn, rowOf, type Statement, TRANSFORMS, type Transform, type Written } from "../syntax.ts";
import { DECLARATIONS, type Given } from "./cursor.ts";
import { ExpressionParser, unnamed } from "./expressions.ts";

const A_STATEMENT = "a statement, such as `box(1, 2, 1)` or a rule with its arguments";
const MATERIAL = "the name of a material, declared as in `material red { colour = #f00 }`";
/** Words with which a statement begins. */
const STATEMENTS =
  "called choose edges else for heights if impostor let model move paint roll scale scatter tilt turn viewpoint".split(
    " ",
  );
/** Words that stand inside of a statement or declaration, with one that has them. */
const LATER = new Map([
  ["as", "scatter 60 as x, z in 180 by 180 box(1, 1, 1)"],
  ["by", "scatter 60 as x, z in 180 by 180 box(1, 1, 1)"],
  ["from", "parameter height = 8 from 3 to 20"],
  ["in", "for i in 10 box(1, 1, 1)"],
  ["levels", "rule branch() levels 4 { … }"],
  ["steps", "heights x, z in 50 by 50 steps 20 by 20 = 0"],
  ["to", "parameter height = 8 from 3 to 20"],
  ["within", "part tree() within [-1, 0, -1] to [1, 3, 1] { … }"],
]);
const VALUE_NAME = "a name for the value";

/** Words that nothing else can be called by, since statements and values begin with them. */
export function isReserved(name: string): boolean {
  return solidNamed(name) !== undefined || isBuiltIn(name) || STATEMENTS.includes(name) || DECLARATIONS.includes(name);
}

export class StatementParser extends ExpressionParser {
  statement(): Statement {
    return this.nested(() => this.anyStatement());
  }

  private anyStatement(): Statement {
    const word = this.next;
    if (this.isSymbol("{")) return this.block();
    const declaration = this.declares();
    if (declaration !== undefined) throw this.misplaced(declaration);
    if (word.kind !== "name") throw this.expected(A_STATEMENT);
    const { at } = word;
    this.skip();
    switch (word.text) {
      case "let": {
        const { name } = this.name(VALUE_NAME);
        this.expect("=");
        const value = rowOf("values", this.written());
        return { kind: "let", at, slot: this.bind(name), value };
      }
      case "if": {
        const condition = rowOf("numbers", this.written());
        const yes = this.inner();
        return { kind: "if", at, condition, yes, no: this.takesWord("else") ? this.inner() : undefined };
      }
      case "choose": {
        const number = rowOf("numbers", this.written());
        const of = this.statements();
        // Only the chosen one is done: what a value of the braces were, would not be computed.
        for (const one of of) if (one.kind === "let") throw new Fault(one.at, LET_IN_CHOOSE);
        return { kind: "choose", at, number, of };
      }
      case "for":
        return this.repetition(at);
      case "scatter":
        return this.scattering(at);
      case "edges":
        return this.edges(at);
      case "heights":
        return this.heights(at);
      case "paint": {
        if (this.next.kind === "name" && isReserved(this.next.text)) throw this.expected(MATERIAL);
        const material = this.name(MATERIAL);
        const call = this.call(material.name, material.at, "material");
        return { kind: "paint", call, body: this.behind("paint", at) };
      }
      case "called": {
        const name = this.text("a name in quotes");
        return { kind: "called", at, name, body: this.behind("called", at) };
      }
      case "viewpoint":
        return { kind: "viewpoint", at, name: this.text("the viewpoint's name in quotes") };
      case "impostor": {
        const numbers = this.givenTo("impostor", IMPOSTOR, at);
        return { kind: "impostor", at, numbers: rowOf("numbers", ...numbers) };
      }
      case "model":
        return { kind: "model", at, path: this.text("a glTF file in quotes") };
    }
    const transform = TRANSFORMS.find((known) => known === word.text);
    if (transform) return this.placed(transform, at);
    const solid = solidNamed(word.text);
    if (solid) return this.solid(solid, at);
    if (this.isSymbol("(") || this.isSymbol(".")) return { kind: "call", call: this.call(word.text, at, "rule") };
    if (word.text === "else") throw new Fault(at, ELSE);
    if (word.text === "then") throw new Fault(at, THEN);
    if (this.isSymbol("=")) throw new Fault(at, withoutLet(word.text));
    const usage = LATER.get(word.text);
    if (usage !== undefined) throw new Fault(at, later(word.text, usage));
    throw new Fault(at, noStatement(word.text, [...STATEMENTS, ...DECLARATIONS]));
  }

  private inner(): Statement {
    return this.enclosed(() => this.statement());
  }

  /** The statement that a word changes. */
  private behind(word: string, at: At): Statement {
    const isNone = this.next.kind === "end" || this.isSymbol("}") || this.declares() !== undefined;
    if (isNone) throw new Fault(at, nothingBehind(word));
    return this.inner();
  }

  /** Statements in braces; what they bind is out of reach behind them. */
  private statements(): Statement[] {
    const opened = this.next.at;
    this.opens();
    return this.enclosed(() => {
      const of: Statement[] = [];
      while (!this.closes()) {
        if (this.next.kind === "end") throw new Fault(opened, unclosed("{", "}"));
        of.push(this.statement());
      }
      return of;
    });
  }

  block(): Statement {
    return { kind: "group", of: this.statements() };
  }

  private placed(transform: Transform, at: At): Statement {
    const args = this.args();
    const counts = { move: [3], scale: [1, 3], turn: [1], tilt: [1], roll: [1] }[transform];
    const usual = { move: "`move(x, y, z)`", scale: "`scale(factor)` or `scale(x, y, z)`" };
    const usage = transform === "move" || transform === "scale" ? usual[transform] : `\`${transform}(degrees)\``;
    const by = rowOf("numbers", ...unnamed(transform, at, args, counts, usage));
    return { kind: "place", at, transform, by, body: this.behind(transform, at) };
  }

  private solid(solid: SolidKind, at: At): Statement {
    const args = this.givenTo(solid, SOLIDS[solid], at);
    // The top of a cone is computed before its height.
    if (solid === "cone") args.splice(1, 2, ...args.slice(1, 3).reverse());
    const lists = args.slice(0, listsOf(solid)).map((list) => rowOf("rows", list));
    return { kind: "solid", at, solid, lists, numbers: rowOf("numbers", ...args.slice(lists.length)) };
  }

  /** Arguments in brackets, each at the place of its formal; what is not given is what it is then. */
  private givenTo(callee: string, formals: Formals, at: At): Written[] {
    const found: (Written | undefined)[] = formals.map(() => undefined);
    this.args().forEach((argument, place) => {
      const { name } = argument;
      const index = name === undefined ? place : formals.findIndex(([known]) => known === name);
      if (name !== undefined && index < 0) {
        const names = formals.map(([known]) => known);
        throw new Fault(argument.at, unknownArgument(name, callee, names));
      }
      const formal = formals[index];
      if (!formal) throw new Fault(argument.at, tooManyArguments(callee, formals.length));
      if (found[index]) throw new Fault(argument.at, argumentTwice(formal[0]));
      found[index] = argument;
    });
    const missing = formals.find(([, initial], i) => initial === undefined && !found[i]);
    if (missing) {
      const needed = formals.filter(([, initial]) => initial === undefined).map(([name]) => name);
      throw new Fault(at, missingNumber(callee, missing[0], `\`${callee}(${needed.join(", ")})\``));
    }
    return found.map((given, i) => given ?? { at, of: { kind: "number", value: formals[i]?.[1] ?? 0 } });
  }

  /** Names of values, separated by commas, not yet in reach. */
  private names(): string[] {
    const given: Given = new Map();
    do this.give(given, this.name(VALUE_NAME));
    while (this.takes(","));
    return [...given.keys()];
  }

  private twoNames(): [string, string] {
    const given: Given = new Map();
    const first = this.name("a name for x");
    this.give(given, first);
    this.expect(",");
    const second = this.name("a name for z");
    this.give(given, second);
    return [first.name, second.name];
  }

  /** `WIDTH by DEPTH` */
  private extent(): [Written, Written] {
    const width = this.written();
    this.expectWord("by");
    return [width, this.written()];
  }

  private repetition(at: At): Statement {
    const names = this.names();
    this.expectWord("in");
    const site = this.site();
    const over = rowOf("values", this.written());
    return this.enclosed(() => {
      const slots = names.map((name) => this.bind(name));
      return { kind: "for", at, site, slots, over, body: this.statement(), plan: undefined };
    });
  }

  private scattering(at: At): Statement {
    const site = this.site();
    const count = this.written();
    this.expectWord("as");
    const [x, z] = this.twoNames();
    this.expectWord("in");
    const over = rowOf("numbers", count, ...this.extent());
    return this.enclosed(() => {
      const slots: [number, number] = [this.bind(x), this.bind(z)];
      return { kind: "scatter", at, site, slots, over, body: this.statement() };
    });
  }

  private edges(at: At): Statement {
    const names = this.names();
    if (names.length > 2) {
      throw new Fault(at, "edges must be `edges length in …` or `edges length, number in …`");
    }
    this.expectWord("in");
    const site = this.site();
    const polygon = rowOf("rows", this.written());
    return this.enclosed(() => {
      const slots = names.map((name) => this.bind(name));
      return { kind: "edges", at, site, slots, polygon, body: this.statement() };
    });
  }

  private writtenBeforeSign(): Written {
    const { at } = this.next;
    return { at, of: this.valueBeforeSign() };
  }

  private heights(at: At): Statement {
    const [x, z] = this.twoNames();
    this.expectWord("in");
    const extent = this.extent();
    this.expectWord("steps");
    const along = this.writtenBeforeSign();
    this.expectWord("by");
    const over = rowOf("numbers", ...extent, along, this.writtenBeforeSign());
    this.expect("=");
    return this.enclosed(() => {
      const slots: [number, number] = [this.bind(x), this.bind(z)];
      return { kind: "heights", at, slots, over, height: rowOf("numbers", this.written()), plan: undefined };
    });
  }
}
