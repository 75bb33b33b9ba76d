/** What does a file declare? Imports, parameters, values, materials, functions and rules; all else is its body. */
import {
  argumentTwice,
  DcgError,
  Fault,
  functionAsValue,
  LEVELS_OF_PART,
  loneLet,
  ofItself,
  ownValue,
  reserved,
  THEN_WITHOUT_LEVELS,
  unknown,
  unknownProperty,
  unopened,
} from "../error.ts";
import { words } from "../lexer.ts";
import { MAX_CODE, MAX_TEXT_BYTES, reached } from "../limits.ts";
import {
  BUILT_INS,
  type Formal,
  isBuiltIn,
  type Module,
  PROPERTIES,
  type Property,
  type Row,
  rowOf,
  type Written,
} from "../syntax.ts";
import { DECLARATIONS, type Given, type NamedAt } from "./cursor.ts";
import { atItsOperator } from "./dangling.ts";
import { isReserved, StatementParser } from "./statements.ts";
import * as usage from "./usage.ts";

/** What opens and what closes. */
const PAIRS = [
  ["{", "}"],
  ["(", ")"],
  ["[", "]"],
] as const;

/** Values that the language gives, whatever a file calls its own. */
const OWN_VALUES = ["detail", "level"];

/** Reads a file. */
export function parse(file: string, text: string): Module {
  const module: Module = {
    file,
    text,
    imports: [],
    parameters: [],
    globals: [],
    rules: [],
    functions: [],
    materials: [],
    body: [],
    bodySlots: 0,
    calls: [],
    uses: [],
    room: MAX_CODE,
  };
  try {
    if (new TextEncoder().encode(text).length > MAX_TEXT_BYTES) {
      throw new Fault(0, reached("bytes of text", MAX_TEXT_BYTES));
    }
    new Parser(module, words(text)).file();
  } catch (error) {
    if (!(error instanceof Fault)) throw error;
    const { at, problem, kind } = atItsOperator(text, error);
    throw DcgError.at(file, text, at, problem, kind);
  }
  return module;
}

class Parser extends StatementParser {
  /** Declared names and where, to find what is given twice. */
  private readonly given: Given = new Map();

  file(): void {
    for (let word = this.next; word.kind !== "end"; word = this.next) {
      if (word.kind === "name" && DECLARATIONS.includes(word.text)) {
        this.skip();
        this.declaration(word.text);
      } else if (this.takesWord("let")) {
        const { name, at } = this.fileValue("a name for the value");
        this.expect("=");
        this.module.globals.push({ name, at, value: this.valueWithout(name) });
      } else {
        this.refuseUnopened();
        this.module.body.push(this.statement());
      }
    }
    this.module.bodySlots = this.slots;
    this.resolveUses();
  }

  /** The value of something of the whole file, which must not read itself. */
  private valueWithout(name: string): Row {
    const { value, own } = this.namedValue(name);
    const [at] = own;
    if (at !== undefined) throw new Fault(at, ofItself(name));
    return rowOf("values", [value]);
  }

  /** Refuses what closes something where nothing is open. */
  private refuseUnopened(): void {
    const found = PAIRS.find(([, close]) => this.isSymbol(close));
    if (found) throw new Fault(this.next.at, unopened(found[1], found[0]));
  }

  private declaration(word: string): void {
    if (word === "import") this.import();
    else if (word === "parameter") this.parameter();
    else if (word === "material") this.material();
    else if (word === "function") this.functionRule();
    else this.rule(word === "part");
  }

  /** A name for what is called by a word of its own. */
  private declared(what: string): NamedAt {
    const { name, at } = this.declaredValue(what);
    if (isReserved(name)) {
      throw new Fault(at, reserved(name));
    }
    return { name, at };
  }

  /** A name for something of the whole file. */
  private declaredValue(what: string): NamedAt {
    const named = this.name(what);
    this.give(this.given, named);
    return named;
  }

  /** The same for a value, which is read by that name alone. */
  private fileValue(what: string): NamedAt {
    const named = this.declaredValue(what);
    if (OWN_VALUES.includes(named.name)) throw new Fault(named.at, ownValue(named.name));
    return named;
  }

  private import(): void {
    const { at } = this.next;
    const path = this.path("the file to import, in quotes");
    if (!this.takesWord("as")) throw this.expected("`as` and a name for the file");
    const { name: alias } = this.declared("a name for the file");
    this.aliases.add(alias);
    this.module.imports.push({ alias, at, path, module: 0 });
  }

  private parameter(): void {
    const { name, at } = this.fileValue("a name for the parameter");
    this.expect("=");
    const formal = { name, at, initial: this.valueWithout(name) };
    const from = this.next.at;
    if (!this.takesWord("from")) {
      this.module.parameters.push({ formal, shown: name });
      return;
    }
    const range = this.span(usage.RANGE);
    const shown = onOneLine(this.module.text.slice(from, this.next.at));
    this.module.parameters.push({ formal, range, shown: shown.length <= MOST_SHOWN ? `${name} ${shown}` : name });
  }

  private formals(): Formal[] {
    const opened = this.next.at;
    this.expect("(", usage.FORMALS);
    const formals: Formal[] = [];
    const given: Given = new Map();
    while (!this.takes(")")) {
      const { name, at } = this.name("a name for a parameter");
      this.give(given, { name, at });
      const initial = this.takes("=") ? rowOf("values", [this.written()]) : undefined;
      this.bind(name);
      formals.push(initial ? { name, at, initial } : { name, at });
      this.separated(opened, "(", ")");
    }
    return formals;
  }

  private material(): void {
    const { name } = this.declared("a name for the material");
    const [{ formals, properties }, slots] = this.framed(() => {
      const formals = this.isSymbol("(") ? this.formals() : [];
      const properties: [Property, Written][] = [];
      this.opens(usage.PROPERTIES);
      while (!this.closes()) {
        const word = this.declares();
        if (word !== undefined) throw this.misplaced(word);
        const { name, at } = this.name("a property, such as `colour`");
        const property = PROPERTIES.find((known) => known === name);
        if (!property) throw new Fault(at, unknownProperty(name, PROPERTIES));
        if (properties.some(([given]) => given === property)) throw new Fault(at, argumentTwice(name));
        this.expect("=");
        properties.push([property, this.written()]);
        this.takes(",");
      }
      return { formals, properties };
    });
    this.module.materials.push({ name, formals, properties, slots });
  }

  private functionRule(): void {
    const { name } = this.declared("a name for the function");
    const [{ formals, value }, slots] = this.framed(() => {
      const formals = this.formals();
      this.expect("=", usage.VALUE_OF_FUNCTION);
      return { formals, value: this.written() };
    });
    this.module.functions.push({ name, formals, value, slots });
  }

  private rule(isPart: boolean): void {
    const { name, at } = this.declared("a name for the rule");
    this.inPart = isPart;
    const [parts, slots] = this.framed(() => {
      const formals = this.formals();
      const levelsAt = this.next.at;
      const levels = this.takesWord("levels") ? rowOf("numbers", [this.written()]) : undefined;
      if (isPart && levels) throw new Fault(levelsAt, LEVELS_OF_PART);
      const withinAt = this.next.at;
      const saysWithin = this.takesWord("within");
      if (saysWithin && !isPart) {
        throw new Fault(withinAt, "only a part can say `within`; write `part` in place of `rule`, or leave it out");
      }
      const within = saysWithin ? this.span(usage.WITHIN) : undefined;
      const body = this.block();
      const thenAt = this.next.at;
      const saysThen = this.takesWord("then");
      if (saysThen && !levels) throw new Fault(thenAt, THEN_WITHOUT_LEVELS);
      const afterwards = saysThen ? this.statement() : undefined;
      return { formals, levels, within, body, afterwards };
    });
    this.inPart = false;
    this.module.rules.push({ name, at, isPart, slots, ...parts });
  }

  /** `LEAST to MOST` */
  private span(inWhat: string): [Written, Written] {
    const least = this.written();
    this.expectWord("to", inWhat);
    return [least, this.written()];
  }

  /** Finds the globals that were used, now that all of them are known. */
  private resolveUses(): void {
    const { parameters, globals, functions, uses } = this.module;
    const names = [...parameters.map(({ formal }) => formal.name), ...globals.map(({ name }) => name)];
    const slots = new Map(names.map((name, slot) => [name, slot]));
    for (const use of uses) {
      const slot = slots.get(use.name);
      if (slot === undefined) {
        const { name, at } = use;
        const lone = this.lone.get(name);
        if (lone !== undefined && lone < at) throw new Fault(at, loneLet(name));
        const formals = formalsOf(name, functions);
        if (formals) throw new Fault(at, functionAsValue(name, formals));
        if (this.own.has(at)) throw new Fault(at, ofItself(name));
        throw new Fault(at, unknown("value", name, [...names, ...OWN_VALUES]), "unknown");
      }
      use.slot = slot;
    }
  }
}

/** What a function of the language or of these takes, where one is called so. */
function formalsOf(name: string, functions: Module["functions"]): readonly string[] | undefined {
  if (isBuiltIn(name)) return BUILT_INS[name];
  return functions.find((known) => known.name === name)?.formals.map((formal) => formal.name);
}

/** Longest range of a parameter that is shown, letters. */
const MOST_SHOWN = 60;

/** Values as they are written, without comments. */
function onOneLine(written: string): string {
  const lines = written.split(/[\n\r]/).map((line) => line.split("//")[0]);
  return lines.join(" ").split(/\s+/).filter(Boolean).join(" ");
}
