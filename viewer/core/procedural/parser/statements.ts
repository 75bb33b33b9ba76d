/** What is done at a place? Groups, selections, values, transforms, materials, calls, solids and enumerators. */
import {
  argumentTwice,
  ELSE,
  Fault,
  LET_IN_CHOOSE,
  LEVELS_OF_PART,
  later,
  missingNumber,
  noStatement,
  nothingBehind,
  RANGE_OF_LOOP,
  THEN,
  tooManyArguments,
  unclosed,
  unknownArgument,
  withoutLet,
} from "../error.ts";
import { type Formals, IMPOSTOR, listsOf, SOLIDS, type SolidKind, solidNamed } from "../solid/kinds.ts";
import {
  type At,
  isBuiltIn,
  type Row,
  rowOf,
  type Statement,
  TRANSFORMS,
  type Transform,
  type Written,
} from "../syntax.ts";
import { DECLARATIONS, type Given } from "./cursor.ts";
import { ExpressionParser, unnamed } from "./expressions.ts";
import {
  ASKS_FOR_PICTURES,
  BODY,
  CHOICES,
  EDGES,
  FOR,
  HEIGHTS,
  LATER,
  MATERIAL,
  SCATTER,
  SECOND_NAME,
  STATEMENT,
} from "./usage.ts";

/** Words with which a statement begins. */
export const STATEMENTS =
  "called choose edges else for heights if impostor let model move paint roll scale scatter tilt turn viewpoint".split(
    " ",
  );
/** Those that are for the statement behind them, besides transforms. */
const BEFORE = ["if", "for", "scatter", "edges", "paint", "called"];
const VALUE_NAME = "a name for the value";

/** Words that nothing else can be called by, since statements and values begin with them. */
export function isReserved(name: string): boolean {
  return solidNamed(name) !== undefined || isBuiltIn(name) || STATEMENTS.includes(name) || DECLARATIONS.includes(name);
}

/** What stands before a statement and is for it. */
interface Around {
  /** How many values are in reach without what it binds. */
  readonly reach: number;
  /** The whole, with that statement. */
  readonly joined: (inner: Statement) => Statement;
  /** The same for an `if` that has an `else` behind that statement. */
  readonly otherwise?: (yes: Statement) => (no: Statement) => Statement;
}

type Joined = Around["joined"];

export class StatementParser extends ExpressionParser {
  /**
   * A statement, with all that stands before it. In a loop: rows of transforms and chains of `else if` are as long as they may
   * be without a stack that is as deep.
   */
  statement(): Statement {
    const around: Around[] = [];
    for (;;) {
      const before = this.before();
      if (before) {
        this.surrounds();
        around.push(before);
        continue;
      }
      let statement = this.whole();
      if (statement.kind === "let" && around.length > 0) this.standsAlone(statement.at);
      let outer = around.pop();
      for (; outer; outer = around.pop()) {
        const { reach, joined, otherwise } = outer;
        this.truncate(reach);
        if (otherwise && this.takesWord("else")) {
          around.push({ reach, joined: otherwise(statement) });
          break;
        }
        statement = joined(statement);
        this.leaves(1);
      }
      if (!outer) return statement;
    }
  }

  /** What begins here and is for the statement behind it. */
  private before(): Around | undefined {
    const { next, reach } = this;
    if (next.kind !== "name" || this.declares() !== undefined) return undefined;
    const { at, text: word } = next;
    const transform = TRANSFORMS.find((known) => known === word);
    if (!transform && !BEFORE.includes(word)) return undefined;
    this.skip();
    if (transform) {
      const by = this.numbersOf(transform, at);
      this.behind(word, at);
      return { reach, joined: (body) => ({ kind: "place", at, transform, by, body }) };
    }
    switch (word) {
      case "if": {
        const condition = rowOf("numbers", [this.written()]);
        return {
          reach,
          joined: (yes) => ({ kind: "if", at, condition, yes, no: undefined }),
          otherwise: (yes) => (no) => ({ kind: "if", at, condition, yes, no }),
        };
      }
      case "paint": {
        if (this.next.kind === "name" && isReserved(this.next.text)) throw this.expected(MATERIAL);
        const material = this.name(MATERIAL);
        const call = this.call(material.name, material.at, "material");
        this.behind(word, at);
        return { reach, joined: (body) => ({ kind: "paint", call, body }) };
      }
      case "called": {
        const name = this.named("called", "a name in quotes");
        this.behind(word, at);
        return { reach, joined: (body) => ({ kind: "called", at, name, body }) };
      }
      case "for":
        return { reach, joined: this.repetition(at) };
      case "scatter":
        return { reach, joined: this.scattering(at) };
      default:
        return { reach, joined: this.edges(at) };
    }
  }

  /** A statement that is for no other. */
  private whole(): Statement {
    const word = this.next;
    if (this.isSymbol("{")) return this.block();
    const declaration = this.declares();
    if (declaration !== undefined) throw this.misplaced(declaration);
    if (word.kind !== "name") throw this.expected(STATEMENT);
    const { at } = word;
    this.skip();
    switch (word.text) {
      case "let": {
        const { name } = this.name(VALUE_NAME);
        this.expect("=");
        const { value: written, own } = this.namedValue(name);
        for (const at of own) this.own.add(at);
        const value = rowOf("values", [written]);
        return { kind: "let", at, slot: this.bind(name), value };
      }
      case "choose": {
        const number = rowOf("numbers", [this.written()]);
        const of = this.statements();
        // Only the chosen one is done: what a value of the braces were, would not be computed.
        for (const one of of) if (one.kind === "let") throw new Fault(one.at, LET_IN_CHOOSE);
        return { kind: "choose", at, number, of };
      }
      case "heights":
        return this.heights(at);
      case "viewpoint":
        return { kind: "viewpoint", at, name: this.named("viewpoint", "the viewpoint's name in quotes") };
      case "impostor": {
        if (!this.isSymbol("(")) throw this.expected(ASKS_FOR_PICTURES);
        const numbers = this.givenTo("impostor", IMPOSTOR, at);
        return { kind: "impostor", at, numbers: rowOf("numbers", numbers) };
      }
      case "model": {
        return { kind: "model", at, path: this.path("a glTF file in quotes") };
      }
    }
    const solid = solidNamed(word.text);
    if (solid) return this.solid(solid, at);
    if (this.isSymbol("(") || this.isSymbol(".")) return { kind: "call", call: this.call(word.text, at, "rule") };
    if (word.text === "else") throw new Fault(at, ELSE);
    if (word.text === "then") throw new Fault(at, THEN);
    if (this.isSymbol("=")) throw new Fault(at, withoutLet(word.text), "no statement");
    if (word.text === "levels" && this.inPart) throw new Fault(at, LEVELS_OF_PART);
    const usage = LATER.get(word.text);
    if (usage !== undefined) throw new Fault(at, later(word.text, usage), "no statement");
    throw new Fault(at, noStatement(word.text, [...STATEMENTS, ...DECLARATIONS]), "no statement");
  }

  /** Refuses a word that changes the statement behind it where there is none. */
  private behind(word: string, at: At): void {
    const isNone = this.next.kind === "end" || this.isSymbol("}") || this.declares() !== undefined;
    if (isNone) throw new Fault(at, nothingBehind(word));
  }

  /** Statements in braces, without which `what` is missing; what they bind is out of reach behind them. */
  private statements(what = CHOICES): Statement[] {
    const opened = this.next.at;
    return this.nested(() => {
      this.opens(what);
      return this.enclosed(() => {
        const of: Statement[] = [];
        while (!this.closes()) {
          if (this.next.kind === "end") throw new Fault(opened, unclosed("{", "}"));
          of.push(this.statement());
        }
        return of;
      });
    });
  }

  block(): Statement {
    return { kind: "group", of: this.statements(BODY) };
  }

  private numbersOf(transform: Transform, at: At): Row {
    const args = this.args();
    const counts = { move: [3], scale: [1, 3], turn: [1], tilt: [1], roll: [1] }[transform];
    const usual = { move: "`move(x, y, z)`", scale: "`scale(factor)` or `scale(x, y, z)`" };
    const usage = transform === "move" || transform === "scale" ? usual[transform] : `\`${transform}(degrees)\``;
    return rowOf("numbers", unnamed(transform, at, args, counts, usage));
  }

  private solid(solid: SolidKind, at: At): Statement {
    const args = this.givenTo(solid, SOLIDS[solid], at);
    // The top of a cone is computed before its height.
    if (solid === "cone") args.splice(1, 2, ...args.slice(1, 3).reverse());
    const lists = args.slice(0, listsOf(solid)).map((list) => rowOf("rows", [list]));
    return { kind: "solid", at, solid, lists, numbers: rowOf("numbers", args.slice(lists.length)) };
  }

  /** Arguments in brackets, each at the place of its formal; what is not given is what it is then. */
  private givenTo(callee: string, formals: Formals, at: At): Written[] {
    const needed = formals.filter(([, initial]) => initial === undefined).map(([name]) => name);
    const usage = `\`${callee}(${needed.join(", ")})\``;
    if (!this.isSymbol("(")) throw this.expected(`\`(\`, as in ${usage}`);
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
    if (missing) throw new Fault(at, missingNumber(callee, missing[0], usage));
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
    this.expect(",", SECOND_NAME);
    const second = this.name("a name for z");
    this.give(given, second);
    return [first.name, second.name];
  }

  /** Whether what was read goes on as a range, and not with a call of what is called `to`. */
  private isRange(): boolean {
    const behind = this.afterNext;
    return this.isWord("to") && !(behind?.kind === "symbol" && ["(", "."].includes(behind.text));
  }

  private repetition(at: At): Joined {
    const names = this.names();
    this.expectWord("in", FOR);
    const site = this.site();
    const over = rowOf("values", [this.written()]);
    const slots = names.map((name) => this.bind(name));
    if (this.isRange()) throw new Fault(this.next.at, RANGE_OF_LOOP);
    return (body) => ({ kind: "for", at, site, slots, over, body, plan: undefined });
  }

  private scattering(at: At): Joined {
    const site = this.site();
    const count = this.written();
    this.expectWord("as", SCATTER);
    const [x, z] = this.twoNames();
    this.expectWord("in", SCATTER);
    const width = this.written();
    this.expectWord("by", SCATTER);
    const over = rowOf("numbers", [count, width, this.written()]);
    const slots: [number, number] = [this.bind(x), this.bind(z)];
    return (body) => ({ kind: "scatter", at, site, slots, over, body });
  }

  private edges(at: At): Joined {
    const names = this.names();
    if (names.length > 2) {
      throw new Fault(at, "edges must be `edges length in …` or `edges length, number in …`");
    }
    this.expectWord("in", EDGES);
    const site = this.site();
    const polygon = rowOf("rows", [this.written()]);
    const slots = names.map((name) => this.bind(name));
    return (body) => ({ kind: "edges", at, site, slots, polygon, body });
  }

  /** `WIDTH by DEPTH` or `ALONG by ACROSS`, where `=` may stand behind. */
  private twoBeforeSign(): [Written, Written] {
    const first = this.writtenBeforeSign();
    this.expectWord("by", HEIGHTS);
    return [first, this.writtenBeforeSign()];
  }

  private writtenBeforeSign(): Written {
    const { at } = this.next;
    return { at, of: this.valueBeforeSign() };
  }

  private heights(at: At): Statement {
    const [x, z] = this.twoNames();
    this.expectWord("in", HEIGHTS);
    const extent = this.twoBeforeSign();
    this.expectWord("steps", HEIGHTS);
    const over = rowOf("numbers", [...extent, ...this.twoBeforeSign()]);
    this.expect("=");
    return this.enclosed(() => {
      const slots: [number, number] = [this.bind(x), this.bind(z)];
      return { kind: "heights", at, slots, over, height: rowOf("numbers", [this.written()]), plan: undefined };
    });
  }
}
