/** What does a published document say of the rules that a model has grown from? */
import type { Json } from "../basics/json.ts";
import type { JsonValue } from "../procedural/value.ts";
import type { FileRef } from "./documents.ts";
import { readFile } from "./impostordocument.ts";

/** What to make of texts (`docs/FORMAT.md`, "Objects"). */
interface Making {
  /** The part of them; `undefined` for the file as a whole. */
  readonly part: string | undefined;
  readonly parameters: Readonly<Record<string, JsonValue>>;
  readonly seed: number;
}

/** Texts, and what grows out of them. */
export interface Rules extends Making {
  readonly file: FileRef;
  /** What it imports, by the names that it gives it. */
  readonly imports: ReadonlyMap<string, FileRef>;
  readonly triangles: number;
  /** In model space; as level 0, from which it differs only by how that was rounded. */
  readonly geometricError: number;
}

/** What a model says of itself; `finest` is its level 0. */
export function readRules(json: Json, finest: Pick<Rules, "geometricError" | "triangles">): Rules {
  return {
    file: { url: json.field("rules").blob(), bytes: json.field("rules_bytes").count() },
    imports: readImports(json),
    ...readMaking(json),
    triangles: finest.triangles,
    geometricError: finest.geometricError,
  };
}

export function readImports(json: Json): ReadonlyMap<string, FileRef> {
  return new Map(json.field("imports").optional((imports) => imports.entries(readFile)));
}

export function readMaking(json: Json): Making {
  return {
    part: json.field("part").optional((part) => part.text()),
    parameters: Object.fromEntries(json.field("parameters").entries(readValue)),
    seed: json.field("seed").optional((seed) => seed.count()) ?? 0,
  };
}

function readValue(json: Json): JsonValue {
  return json.isList ? json.list(readValue) : json.number();
}
