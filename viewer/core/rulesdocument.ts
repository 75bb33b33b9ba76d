/** What does a published document say of the rules that a model has grown from? */
import type { FileRef } from "./documents.ts";
import { readFile } from "./impostordocument.ts";
import type { Json } from "./json.ts";
import type { JsonValue } from "./procedural/value.ts";

/** Texts, and what to make of them (`docs/FORMAT.md`, "Objects"). */
export interface Rules {
  readonly file: FileRef;
  /** What it imports, by the names that it gives it. */
  readonly imports: ReadonlyMap<string, FileRef>;
  /** The part of it; `undefined` for the file as a whole. */
  readonly part: string | undefined;
  readonly parameters: Readonly<Record<string, JsonValue>>;
  readonly seed: number;
}

export function readRules(json: Json): Rules {
  return {
    file: { url: json.field("rules").blob(), bytes: json.field("rules_bytes").count() },
    imports: new Map(json.field("imports").optional((imports) => imports.entries(readFile))),
    part: json.field("part").optional((part) => part.text()),
    parameters: Object.fromEntries(json.field("parameters").entries(readValue)),
    seed: json.field("seed").optional((seed) => seed.count()) ?? 0,
  };
}

function readValue(json: Json): JsonValue {
  return json.isList ? json.list(readValue) : json.number();
}
