/** What can be computed with? Numbers, and lists of them, which are never changed. */
import { step, stepNumber } from "./random.ts";

export interface List {
  readonly items: readonly Value[];
  /** How many numbers and lists the items are with all that is inside of them. */
  readonly size: number;
}

export type Value = number | List;

/** Parameters as JSON says them. */
export type JsonValue = number | readonly JsonValue[];

export function listOf(items: readonly Value[]): List {
  return { items, size: items.reduce((sum: number, item) => sum + sizeOf(item), 0) };
}

/** Numbers and lists in it, itself included. */
export function sizeOf(value: Value): number {
  return typeof value === "number" ? 1 : value.size + 1;
}

/** The same value as JSON says it; `undefined` for anything else. */
export function valueFromJson(json: unknown): Value | undefined {
  if (typeof json === "number") return Number.isFinite(json) ? json : undefined;
  if (!Array.isArray(json)) return undefined;
  const items = json.map(valueFromJson);
  return items.some((item) => item === undefined) ? undefined : listOf(items as Value[]);
}

/** What tells values apart. Adding 0 turns −0 into 0. */
export function keyOf(value: Value): string {
  return typeof value === "number" ? `${value + 0}` : `[${value.items.map(keyOf).join()}]`;
}

/** The path after a value. */
export function stepValue(path: number, value: Value): number {
  if (typeof value === "number") return stepNumber(path, value + 0);
  return value.items.reduce(stepValue, step(path, value.items.length));
}
