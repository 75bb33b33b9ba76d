/** How is a value written? Operators by rising strength: `or`, `and`, `not`, comparisons, `+ −`, `* /`, a sign, `[item]`. */
import { COMPARED, comparison, EQUALS, Fault, namedArgument, tooFewArguments, tooManyArguments } from "../error.ts";
import {
  type Argument,
  type At,
  BUILT_INS,
  type Expr,
  isBuiltIn,
  type Operator,
  rowOf,
  type Wanted,
  type Written,
} from "../syntax.ts";
import { Cursor, OPERATORS } from "./cursor.ts";
import { BRACKETS, IF } from "./usage.ts";

const COMPARISONS: readonly Operator[] = ["==", "!=", "<=", ">=", "<", ">"];
const SUMS: readonly Operator[] = ["+", "-"];
const PRODUCTS: readonly Operator[] = ["*", "/"];

export class ExpressionParser extends Cursor {
  /** Names by which files were imported. */
  protected readonly aliases = new Set<string>();

  expression(): Expr {
    const value = this.valueBeforeSign();
    if (this.isSymbol("=")) {
      const { next, afterNext } = this;
      const sign = afterNext?.kind === "symbol" ? afterNext.text : "";
      throw new Fault(next.at, sign === "<" || sign === ">" ? comparison(`=${sign}`, `${sign}=`) : EQUALS);
    }
    return value;
  }

  /** A value, and where it begins. */
  written(): Written {
    const { at } = this.next;
    return { at, of: this.expression() };
  }

  /** The value of something that is called so, and where it reads that. */
  protected namedValue(name: string): { readonly value: Written; readonly own: readonly At[] } {
    const { uses } = this.module;
    const first = uses.length;
    const value = this.written();
    const own = uses.slice(first).filter((use) => use.name === name);
    return { value, own: own.map(({ at }) => at) };
  }

  /** A value behind which `=` may stand. */
  valueBeforeSign(): Expr {
    const chain: { condition: Expr; yes: Expr }[] = [];
    while (this.takesWord("if")) {
      const branch = this.nested(() => {
        const condition = this.expression();
        this.expectWord("then", IF);
        return { condition, yes: this.expression() };
      });
      this.expectWord("else", IF);
      this.surrounds();
      chain.push(branch);
    }
    const last = this.disjunction();
    this.leaves(chain.length);
    return chain.reduceRight<Expr>((no, branch) => ({ kind: "if", ...branch, no }), last);
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
    if (!found) return left;
    if (found.operator === "<" && this.isSymbol(">")) throw new Fault(found.at, comparison("<>", "!="));
    const right = this.sum();
    const { at } = this.next;
    if (this.operator(COMPARISONS)) throw new Fault(at, COMPARED);
    return { kind: "binary", ...found, left, right };
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
      const index = this.nested(() => {
        this.skip();
        const index = this.expression();
        this.expect("]");
        return index;
      });
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
    if (this.isSymbol("(")) {
      return this.nested(() => {
        this.skip();
        const value = this.expression();
        this.expect(")", BRACKETS);
        return value;
      });
    }
    if (this.isSymbol("[")) {
      return this.nested(() => {
        this.skip();
        const items: Expr[] = [];
        while (!this.takes("]")) {
          items.push(this.expression());
          this.separated(word.at, "[", "]");
        }
        return { kind: "list", items, at: word.at };
      });
    }
    if (this.isSymbol(".")) throw this.expected("a value; a number begins with a digit, as in `0.5`");
    if (word.kind !== "name") throw this.expected("a value");
    if (word.text === "if") throw this.expected("a value; put brackets around `if … then … else …` here");
    if (word.text === "not") throw this.expected("a value; put brackets around `not …` here");
    if (OPERATORS.includes(word.text)) throw this.expected("a value");
    const { name, at } = this.name("a value");
    return this.isSymbol("(") || this.isSymbol(".") ? this.application(name, at) : this.variable(name, at);
  }

  /** The nearest value of that name: of the rule, else of the file or the language. */
  private variable(name: string, at: At): Expr {
    const slot = this.slotOf(name);
    if (slot !== undefined) return { kind: "local", slot };
    if (name === "detail" || name === "level") return { kind: name };
    this.module.uses.push({ name, at, slot: 0 });
    return { kind: "global", use: this.module.uses.length - 1 };
  }

  /** A function with its arguments. */
  private application(name: string, at: At): Expr {
    if (!isBuiltIn(name)) return { kind: "call", call: this.call(name, at, "function") };
    const formals = BUILT_INS[name];
    const site = this.site();
    const args = this.args();
    const counts = name === "random" ? [0, 2] : [formals.length];
    return {
      kind: "builtin",
      name,
      at,
      site,
      args: unnamed(name, at, args, counts, `\`${name}(${formals.join(", ")})\``),
    };
  }

  /** The rest of a call, from behind its first name on; its place in the table of calls. */
  call(first: string, at: At, wanted: Wanted): number {
    const name = this.takes(".") ? this.name("a name of the imported file").name : undefined;
    const isImported = name !== undefined && this.aliases.has(first);
    const hasBrackets = this.isSymbol("(");
    const isValue = wanted === "function" && isImported && !hasBrackets;
    const site = this.site();
    const args = hasBrackets || (wanted !== "material" && !isValue) ? this.args() : [];
    this.module.calls.push({
      at,
      alias: name === undefined ? undefined : first,
      name: name ?? first,
      args,
      site,
      wanted,
      isValue,
      module: 0,
      index: -1,
      given: [],
      slots: [],
      row: rowOf("values", []),
    });
    return this.module.calls.length - 1;
  }

  /** Arguments in brackets. */
  args(): Argument[] {
    return this.nested(() => this.argsInside());
  }

  private argsInside(): Argument[] {
    const opened = this.next.at;
    this.expect("(");
    const args: Argument[] = [];
    while (!this.takes(")")) {
      const { next, afterNext } = this;
      const isNamed = next.kind === "name" && afterNext?.kind === "symbol" && afterNext.text === "=";
      if (isNamed) this.skip(2);
      else if (args.at(-1)?.name !== undefined) {
        throw new Fault(next.at, "an argument without a name cannot follow one with a name; name this one too");
      }
      args.push({ name: isNamed ? next.text : undefined, at: next.at, of: this.expression() });
      this.separated(opened, "(", ")");
    }
    return args;
  }

  private operator(known: readonly Operator[]): { operator: Operator; at: At } | undefined {
    const { at } = this.next;
    const operator = known.find((symbol) => this.takes(symbol));
    return operator && { operator, at };
  }
}

/** Arguments of what has no names for them: one of these counts of them, or else it is to be called like `usage`. */
export function unnamed(
  callee: string,
  at: At,
  args: readonly Argument[],
  counts: readonly number[],
  usage: string,
): readonly Written[] {
  const most = counts.at(-1) ?? 0;
  const named = args.find((argument) => argument.name !== undefined);
  if (named) throw new Fault(named.at, namedArgument(callee, usage));
  const surplus = args[most];
  if (surplus) throw new Fault(surplus.at, tooManyArguments(callee, most));
  if (!counts.includes(args.length)) throw new Fault(at, tooFewArguments(callee, usage));
  return args;
}
