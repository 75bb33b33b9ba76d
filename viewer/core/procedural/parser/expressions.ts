/** How is a value written? Operators by rising strength: `or`, `and`, `not`, comparisons, `+ −`, `* /`, a sign, `[item]`. */
import { Fault, tooManyArguments, unknown } from "../error.ts";
import {
  type Argument,
  type At,
  BUILT_INS,
  type Expr,
  isBuiltIn,
  type Operator,
  rowOf,
  type Wanted,
} from "../syntax.ts";
import { Cursor } from "./cursor.ts";

const COMPARISONS: readonly Operator[] = ["==", "!=", "<=", ">=", "<", ">"];
const SUMS: readonly Operator[] = ["+", "-"];
const PRODUCTS: readonly Operator[] = ["*", "/"];

export class ExpressionParser extends Cursor {
  expression(): Expr {
    return this.nested(() => {
      if (!this.takesWord("if")) return this.disjunction();
      const condition = this.expression();
      this.expectWord("then");
      const yes = this.expression();
      this.expectWord("else");
      return { kind: "if", condition, yes, no: this.expression() };
    });
  }

  private disjunction(): Expr {
    let left = this.conjunction();
    for (let count = 0; this.takesWord("or"); ) {
      count = this.chained(count);
      left = { kind: "or", left, right: this.conjunction() };
    }
    return left;
  }

  private conjunction(): Expr {
    let left = this.negation();
    for (let count = 0; this.takesWord("and"); ) {
      count = this.chained(count);
      left = { kind: "and", left, right: this.negation() };
    }
    return left;
  }

  private negation(): Expr {
    if (this.takesWord("not")) return this.nested(() => ({ kind: "not", of: this.negation() }));
    const left = this.sum();
    const found = this.operator(COMPARISONS);
    return found ? { kind: "binary", ...found, left, right: this.sum() } : left;
  }

  private sum(): Expr {
    let left = this.product();
    for (let count = 0, found = this.operator(SUMS); found; found = this.operator(SUMS)) {
      count = this.chained(count);
      left = { kind: "binary", ...found, left, right: this.product() };
    }
    return left;
  }

  private product(): Expr {
    let left = this.signed();
    for (let count = 0, found = this.operator(PRODUCTS); found; found = this.operator(PRODUCTS)) {
      count = this.chained(count);
      left = { kind: "binary", ...found, left, right: this.signed() };
    }
    return left;
  }

  private signed(): Expr {
    if (this.takes("-")) return this.nested(() => ({ kind: "minus", of: this.signed() }));
    let value = this.atom();
    for (let count = 0; this.isSymbol("["); ) {
      count = this.chained(count);
      const { at } = this.next;
      this.skip();
      const index = this.expression();
      this.expect("]");
      value = { kind: "item", at, of: value, index };
    }
    return value;
  }

  private atom(): Expr {
    const word = this.next;
    if (word.kind === "number") {
      this.skip();
      return { kind: "number", value: word.value };
    }
    if (word.kind === "colour") {
      this.skip();
      return { kind: "colour", channels: word.channels };
    }
    if (this.takes("(")) {
      const value = this.expression();
      this.expect(")");
      return value;
    }
    if (this.takes("[")) {
      const items: Expr[] = [];
      while (!this.takes("]")) {
        items.push(this.expression());
        if (!this.isSymbol("]")) this.expect(",");
      }
      return { kind: "list", items, at: word.at };
    }
    if (word.kind !== "name") throw this.expected("a value");
    if (word.text === "if") throw this.expected("a value; put brackets around `if … then … else …` here");
    const { name, at } = this.name("a value");
    return this.isSymbol("(") || this.isSymbol(".") ? this.application(name, at) : this.variable(name, at);
  }

  /** The nearest value of that name: of the rule, else of the file or the language. */
  private variable(name: string, at: At): Expr {
    const slot = this.slotOf(name);
    if (slot >= 0) return { kind: "local", slot };
    if (name === "detail" || name === "level") return { kind: name };
    this.module.uses.push({ name, at, slot: 0 });
    return { kind: "global", use: this.module.uses.length - 1 };
  }

  /** A function with its arguments. */
  private application(name: string, at: At): Expr {
    if (!isBuiltIn(name)) return { kind: "call", call: this.call(name, at, "function") };
    const [least, most] = BUILT_INS[name];
    const site = this.site();
    const args = this.args();
    const surplus = args[most];
    if (surplus) throw new Fault(surplus.at, tooManyArguments(name, most));
    const named = args.find((argument) => argument.name !== undefined);
    if (named) throw new Fault(named.at, unknown("parameter of this function", named.name ?? "", []));
    if (args.length < least || (name === "random" && args.length === 1)) {
      throw this.expected(`${most} arguments of \`${name}\` before this`);
    }
    return { kind: "builtin", name, at, site, args: args.map((argument) => argument.value) };
  }

  /** The rest of a call, from behind its first name on; its place in the table of calls. */
  call(first: string, at: At, wanted: Wanted): number {
    const name = this.takes(".") ? this.name("a name of the imported file").name : undefined;
    const site = this.site();
    const args = wanted !== "material" || this.isSymbol("(") ? this.args() : [];
    this.module.calls.push({
      at,
      alias: name === undefined ? undefined : first,
      name: name ?? first,
      args,
      site,
      wanted,
      module: 0,
      index: -1,
      given: [],
      slots: [],
      row: rowOf("values"),
      missing: [],
    });
    return this.module.calls.length - 1;
  }

  /** Arguments in brackets. */
  args(): Argument[] {
    this.expect("(");
    const args: Argument[] = [];
    while (!this.takes(")")) {
      const { next, afterNext } = this;
      const isNamed = next.kind === "name" && afterNext?.kind === "symbol" && afterNext.text === "=";
      if (isNamed) this.skip(2);
      else if (args.at(-1)?.name !== undefined) {
        throw new Fault(next.at, "an argument without a name cannot follow one with a name; name this one too");
      }
      args.push({ name: isNamed ? next.text : undefined, at: next.at, value: this.expression() });
      if (!this.isSymbol(")")) this.expect(",");
    }
    return args;
  }

  private operator(known: readonly Operator[]): { operator: Operator; at: At } | undefined {
    const { at } = this.next;
    const operator = known.find((symbol) => this.takes(symbol));
    return operator && { operator, at };
  }
}
