/** What does each name of a file lead to? As `crates/scene/src/procedural/link.rs`. */

import { withinStack } from "./depth.ts";
import {
  argumentTwice,
  cut,
  DcgError,
  Fault,
  type Kind,
  missingArgument,
  otherKind,
  tooManyArguments,
  unknown,
  unknownArgument,
  unknownOfFile,
} from "./error.ts";
import { foreignValue } from "./foreign.ts";
import { MAX_ALL_TEXT_BYTES, MAX_MODULES, reached } from "./limits.ts";
import { atItsOperator } from "./parser/dangling.ts";
import { parse } from "./parser/index.ts";
import { SOLIDS, solidNamed } from "./solid/kinds.ts";
import {
  type Argument,
  BUILT_INS,
  type Call,
  type Formal,
  isBuiltIn,
  type Module,
  rowOf,
  TRANSFORMS,
  type Wanted,
} from "./syntax.ts";

/**
 * The text of a file, as an `import` names it; throws an `Error` that says why when it cannot be had. Whoever gives this decides what
 * a path may lead to: `insideFolder` refuses those that leave the folder.
 */
export type Load = (path: string) => string;

/** A model that was read and found sound: the first file and all that it imports. */
export interface Program {
  readonly modules: readonly Module[];
  /** Where the names of each lead. */
  readonly names: readonly Names[];
}

/** Reads a file and what it imports. Throws a {@link DcgError}. */
export function readProgram(file: string, text: string, load: Load): Program {
  return withinStack(file, () => readAll(file, text, load));
}

function readAll(file: string, text: string, load: Load): Program {
  const modules = [parse(file, text)];
  const known = new Map([[file, 0]]);
  let textBytes = bytesOf(text);
  for (const module of modules) {
    for (const item of module.imports) {
      const index = known.get(item.path) ?? modules.length;
      if (index === modules.length) {
        if (index === MAX_MODULES) throw errorAt(module, item.at, reached("files", MAX_MODULES));
        const imported = loaded(module, item, load);
        textBytes += bytesOf(imported);
        if (textBytes > MAX_ALL_TEXT_BYTES) {
          throw errorAt(module, item.at, reached("bytes of text in all files", MAX_ALL_TEXT_BYTES));
        }
        modules.push(parse(item.path, imported));
        known.set(item.path, index);
      }
      item.module = index;
    }
  }
  refuseCycles(modules);
  const program = { modules, names: modules.map(namesOf) };
  for (const index of modules.keys()) linkCalls(program, index);
  return program;
}

function bytesOf(text: string): number {
  return new TextEncoder().encode(text).length;
}

/** The same program with another first file, which imports only what the one before did. Throws a {@link DcgError}. */
export function withFirst(before: Program, file: string, text: string): Program {
  const first = parse(file, text);
  const modules = [first, ...before.modules.slice(1)];
  for (const item of first.imports) {
    item.module = modules.findIndex((module) => module.file === item.path);
    if (item.module < 1) throw errorAt(first, item.at, `"${item.path}" is not here`);
  }
  const program = { modules, names: [namesOf(first), ...before.names.slice(1)] };
  linkCalls(program, 0);
  return program;
}

/** Finds what each call of a module leads to. */
function linkCalls(program: Program, from: number): void {
  const { modules } = program;
  const module = modules[from] as Module;
  const callees = new Map<object, Callee>();
  for (const call of module.calls) {
    try {
      link(program, from, call);
      give(call, calleeOf(callees, modules[call.module] as Module, call));
    } catch (error) {
      if (!(error instanceof Fault)) throw error;
      const { at, problem, kind } = atItsOperator(module.text, error);
      throw errorAt(module, at, problem, kind);
    }
  }
}

/** An error at a place of a module. */
export function errorAt(module: Module, at: number, problem: string, kind?: Kind): DcgError {
  return DcgError.at(module.file, module.text, at, problem, kind);
}

function loaded(module: Module, { path, at }: { path: string; at: number }, load: Load): string {
  try {
    return load(path);
  } catch (error) {
    if (!(error instanceof Error)) throw error;
    throw errorAt(module, at, `"${cut(path)}" cannot be imported: ${error.message}`);
  }
}

/** Removes files that import nothing that is left, until none is left; what stays is in a cycle or leads to one. */
function refuseCycles(modules: readonly Module[]): void {
  const left = new Set(modules.keys());
  const open = (module: Module | undefined) => module?.imports.find((item) => left.has(item.module));
  for (let removed = true; removed; ) {
    removed = false;
    for (const i of left) {
      if (!open(modules[i])) removed = left.delete(i) || removed;
    }
  }
  const met = new Set<number>();
  for (let at = [...left][0]; at !== undefined; ) {
    met.add(at);
    const module = modules[at] as Module;
    const item = open(module);
    if (item && met.has(item.module)) {
      const { file } = modules[item.module] as Module;
      throw errorAt(
        module,
        item.at,
        `"${cut(file)}" imports itself, directly or through others; move what both need to a third file`,
      );
    }
    at = item?.module;
  }
}

/** Where the names of a file lead, so that finding one takes as long however many there are. */
type Names = Readonly<Record<Wanted | "import", ReadonlyMap<string, number>>>;

function namesOf({ rules, functions, materials, imports }: Module): Names {
  // No name is declared twice.
  const byName = (names: readonly string[]) => new Map(names.map((name, index) => [name, index]));
  const named = (items: readonly { readonly name: string }[]) => byName(items.map(({ name }) => name));
  return {
    rule: named(rules),
    function: named(functions),
    material: named(materials),
    import: byName(imports.map(({ alias }) => alias)),
  };
}

function link({ modules, names }: Program, from: number, call: Call): void {
  const own = modules[from] as Module;
  const indexIn = (module: number, kind: keyof Names, name: string) => names[module]?.[kind].get(name) ?? -1;
  const imported = (alias: string) => own.imports[indexIn(from, "import", alias)];
  const { alias } = call;
  if (alias === undefined) {
    const index = indexIn(from, call.wanted, call.name);
    const whole = call.wanted === "rule" ? imported(call.name) : undefined;
    if (index < 0 && !whole) throw unknownCall(own, call);
    call.module = index >= 0 ? from : (whole?.module ?? from);
    call.index = index;
  } else {
    const item = imported(alias);
    if (!item) {
      const aliases = own.imports.map((known) => known.alias);
      throw new Fault(call.at, unknown("imported file", alias, aliases));
    }
    const module = modules[item.module] as Module;
    if (call.isValue) throw foreignValue(module, call);
    call.module = item.module;
    call.index = indexIn(item.module, call.wanted, call.name);
    if (call.index < 0) throw unknownCall(module, call);
  }
}

/** What a call can give, made once for all calls in a file. */
interface Callee {
  readonly formals: readonly Formal[];
  readonly places: ReadonlyMap<string, number>;
  /** Places of those that must be given. */
  readonly needed: readonly number[];
}

function calleeOf(known: Map<object, Callee>, module: Module, { wanted, index }: Call): Callee {
  const list = { rule: module.rules, function: module.functions, material: module.materials }[wanted];
  const called = list[index] ?? module;
  let callee = known.get(called);
  if (!callee) {
    const formals = list[index]?.formals ?? module.parameters.map(({ formal }) => formal);
    const places = new Map(formals.map(({ name }, place) => [name, place]));
    callee = { formals, places, needed: [...formals.keys()].filter((place) => !formals[place]?.initial) };
    known.set(called, callee);
  }
  return callee;
}

function names(module: Module, wanted: Wanted): string[] {
  const list = { rule: module.rules, function: module.functions, material: module.materials }[wanted];
  return list.map(({ name }) => name);
}

/** What else a name is that was called as something that it is not. */
function otherKindOf(module: Module, { alias, name }: Call): string | undefined {
  const kinds = ["rule", "function", "material"] as const;
  const isOwn = alias === undefined;
  const isKnown = (kind: Wanted) =>
    names(module, kind).includes(name) || (kind === "function" && isOwn && isBuiltIn(name));
  return kinds.find(isKnown) ?? (isOwn && solidNamed(name) ? "solid" : undefined);
}

function unknownCall(module: Module, call: Call): Fault {
  const { at } = call;
  const known = names(module, call.wanted);
  const is = otherKindOf(module, call);
  if (is) return new Fault(at, otherKind(call.name, is, call.wanted), "other kind");
  // Of an imported file only what it has itself can be called.
  if (call.alias !== undefined) return new Fault(at, unknownOfFile(call.wanted, call.name, module.file, known));
  if (call.wanted === "rule") {
    for (const { alias } of module.imports) known.push(alias);
    known.push(...Object.keys(SOLIDS), ...TRANSFORMS, "paint");
  }
  if (call.wanted === "function") known.push(...Object.keys(BUILT_INS));
  return new Fault(at, unknown(call.wanted, call.name, known), call.wanted === "function" ? "unknown" : undefined);
}

/** Finds which argument each formal is given: they are computed in the formals' order. Takes no longer the more formals there are. */
function give(call: Call, { formals, places, needed }: Callee): void {
  const found = new Map<number, Argument>();
  call.args.forEach((argument, i) => {
    const { name } = argument;
    const place = name === undefined ? i : places.get(name);
    if (place === undefined) {
      const known = formals.map((formal) => formal.name);
      throw new Fault(argument.at, unknownArgument(name ?? "", call.name, known));
    }
    const formal = formals[place];
    if (!formal) throw new Fault(argument.at, tooManyArguments(call.name, formals.length));
    if (found.has(place)) throw new Fault(argument.at, argumentTwice(formal.name));
    found.set(place, argument);
  });
  const missing = needed.find((place) => !found.has(place));
  if (missing !== undefined) throw new Fault(call.at, missingArgument(call.name, formals[missing]?.name ?? ""));
  call.slots = [...found.keys()].sort((a, b) => a - b);
  call.given = call.slots.map((place) => found.get(place) as Argument);
  call.row = rowOf("values", call.given);
}
