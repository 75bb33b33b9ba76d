/** What can be computed with? Numbers, and lists of them, which are never changed. */
import { MAX_LIST_DEPTH } from "./limits.ts";
import { step, stepNumber } from "./random.ts";

export interface List {
  readonly items: readonly Value[];
  /** How many numbers and lists the items are with all that is inside of them. */
  readonly size: number;
  /** How many lists are inside each other, itself included. */
  readonly depth: number;
}

export type Value = number | List;

/** Parameters as JSON says them. */
export type JsonValue = number | readonly JsonValue[];

export function listOf(items: readonly Value[]): List {
  const size = sizesOf(items);
  const depth = 1 + items.reduce((most: number, item) => Math.max(most, depthOf(item)), 0);
  return { items, size, depth };
}

/** Whether it is a list of so many numbers. */
export function isNumbers(value: Value, count: number): boolean {
  if (typeof value === "number" || value.items.length !== count) return false;
  return value.items.every((item) => typeof item === "number");
}

/** Numbers and lists in it, itself included. */
export function sizeOf(value: Value): number {
  return typeof value === "number" ? 1 : value.size + 1;
}

/** The same of a list; nothing of a number. */
export function listedOf(value: Value): number {
  return typeof value === "number" ? 0 : sizeOf(value);
}

/** The same of all of these. */
export function sizesOf(values: readonly Value[]): number {
  return values.reduce((sum: number, value) => sum + sizeOf(value), 0);
}

/** Lists inside each other. */
export function depthOf(value: Value): number {
  return typeof value === "number" ? 0 : value.depth;
}

/** The same value as JSON says it; `undefined` for anything else, and for too many lists inside each other. */
export function valueFromJson(json: unknown): Value | undefined {
  if (typeof json === "number") return Number.isFinite(json) ? json : undefined;
  if (!Array.isArray(json)) return undefined;
  const items = json.map(valueFromJson);
  if (items.some((item) => item === undefined)) return undefined;
  const list = listOf(items as Value[]);
  return list.depth > MAX_LIST_DEPTH ? undefined : list;
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
