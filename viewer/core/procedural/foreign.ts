/**
 * What is wrong where a value of an imported file is read? Only what a file makes by itself can be asked for: functions, not values. As
 * `crates/scene/src/procedural/foreign.rs`.
 */
import { Fault, functionAsValue, otherKind, unknownOfFile, valueOfFile } from "./error.ts";
import type { Call, Module } from "./syntax.ts";

/** Why `alias.name` is no value, of the module that is called so. */
export function foreignValue(module: Module, { at, alias, name }: Call): Fault {
  const { functions, rules, materials } = module;
  const named = (known: { readonly name: string }) => known.name === name;
  const known = functions.find(named);
  if (known) {
    const formals = known.formals.map((formal) => formal.name);
    return new Fault(at, functionAsValue(`${alias}.${name}`, formals));
  }
  const is = rules.some(named) ? "rule" : materials.some(named) ? "material" : undefined;
  if (is !== undefined) return new Fault(at, otherKind(name, is, "function"), "other kind");
  const values = valuesOf(module);
  if (values.includes(name)) {
    const getter = freeName(module, name);
    return new Fault(at, valueOfFile(module.file, name, getter, `${alias}.${getter}()`));
  }
  const all = [...functions.map((known) => known.name), ...values];
  return new Fault(at, unknownOfFile("value or function", name, module.file, all));
}

/** The parameters and values of a file. */
function valuesOf({ parameters, globals }: Module): string[] {
  return [...parameters.map(({ formal }) => formal.name), ...globals.map(({ name }) => name)];
}

/** A name for a function that gives a value of the file, which nothing there has. */
function freeName(module: Module, value: string): string {
  const declared = [...module.functions, ...module.rules, ...module.materials].map(({ name }) => name);
  const taken = new Set([...valuesOf(module), ...declared, ...module.imports.map(({ alias }) => alias)]);
  let name = `get_${value}`;
  while (taken.has(name)) name += "_";
  return name;
}
