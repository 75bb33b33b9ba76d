/** What does a published document say of a model: in which ways can it be drawn, and which files does each take? */
import { denseId, type Json } from "../basics/json.ts";
import type { FileRef } from "./documents.ts";
import { type Impostor, readFile, readImpostor } from "./impostordocument.ts";
import { type Rules, readRules } from "./rulesdocument.ts";

/** One level of detail; 0 is the finest. Errors are in model space until an object's scale makes them metres. */
export interface Level {
  readonly level: number;
  readonly url: string;
  readonly bytes: number;
  readonly triangles: number;
  readonly geometricError: number;
  readonly textures: readonly FileRef[];
  /** Where the same GLB stands among others that the same cells see. */
  readonly pack: PackRef | undefined;
}

/** A place in a pack, which is nothing but GLBs, one after the other. */
export interface PackRef {
  readonly url: string;
  /** Of the whole pack. */
  readonly bytes: number;
  /** Where the GLB starts. */
  readonly from: number;
}

/** Unique geometry. */
export interface Model {
  readonly model: number;
  /** Finest first; none only while nothing but its rules is known. */
  readonly levels: readonly Level[];
  /** The same as one progressive stream, where there is one. */
  readonly smooth?: Smooth | undefined;
  /** Pictures of it for far away, where there are any. */
  readonly impostor?: Impostor | undefined;
  /** What level 0 has grown from, where it can be grown alone. */
  readonly rules?: Rules | undefined;
}

/** A smooth LOD and the rungs that caches can share. */
export interface Smooth {
  /** The whole stream; its hash is in its name. */
  readonly url: string;
  readonly bytes: number;
  /** A glTF document without meshes: its materials are those of the stream, by number. */
  readonly materials: FileRef;
  readonly textures: readonly FileRef[];
  /** Coarsest first, without gaps, never empty. */
  readonly rungs: readonly Rung[];
}

/** A slice of a smooth LOD, and what the stream gives up to its end. */
export interface Rung {
  readonly url: string;
  readonly from: number;
  readonly to: number;
  readonly triangles: number;
  readonly geometricError: number;
}

export function readModelChunk(json: Json): Map<number, Model> {
  const models = new Map<number, Model>();
  json.field("models").entries((model, key) => {
    const id = denseId("m", key) ?? json.field("models").fail("an object whose keys are model ids");
    models.set(id, readModel(model, id));
  });
  return models;
}

function readModel(json: Json, model: number): Model {
  const levels = json.field("levels").list(readLevel);
  const [finest] = levels;
  if (!finest) return json.field("levels").fail("a list with at least one level");
  levels.forEach((level, i) => {
    if (level.level !== i) json.field("levels").fail("numbered from 0, finest first");
  });
  return {
    model,
    levels,
    smooth: json.field("smooth").optional(readSmooth),
    impostor: json.field("impostor").optional(readImpostor),
    rules: json.field("procedural").optional((rules) => readRules(rules, finest)),
  };
}

function readLevel(json: Json): Level {
  const bytes = json.field("bytes").count();
  return {
    level: json.field("level").count(),
    url: json.field("url").blob(),
    bytes,
    triangles: json.field("triangles").count(),
    geometricError: json.field("geometric_error_m").number(),
    textures: json.field("textures").optional(readTextures) ?? [],
    pack: json.field("pack").optional((pack) => readPack(pack, bytes)),
  };
}

function readSmooth(json: Json): Smooth {
  const rungs = json.field("rungs").list((rung) => ({
    url: rung.field("url").rung(),
    from: rung.field("from").count(),
    to: rung.field("to").count(),
    triangles: rung.field("triangles").count(),
    geometricError: rung.field("geometric_error_m").number(),
  }));
  const [url, bytes] = [json.field("url").blob(), json.field("bytes").count()];
  const disjoint = rungs.every(({ from, to }, i) => from === (rungs[i - 1]?.to ?? 0) && to > from);
  if (!disjoint || rungs.at(-1)?.to !== bytes) json.field("rungs").fail("disjoint slices that are the whole stream");
  // Else nothing would ever be compared with the hash in their names.
  const areOfIt = rungs.every((rung, i) => rung.url === rungUrl(url, i));
  if (!areOfIt) json.field("rungs").fail(`slices of ${url}, by their numbers`);
  return {
    url,
    bytes,
    materials: { url: json.field("materials").blob(), bytes: json.field("materials_bytes").count() },
    textures: json.field("textures").optional(readTextures) ?? [],
    rungs,
  };
}

/** The URL of a rung of a stream. */
function rungUrl(stream: string, number: number): string {
  return stream.replace(/\.slod$/, `.r${number}.slod`);
}

function readTextures(json: Json): FileRef[] {
  return json.list(readFile);
}

/** Where a GLB of so many bytes stands. */
function readPack(json: Json, glbBytes: number): PackRef {
  const [bytes, from] = [json.field("bytes").count(), json.field("from").count()];
  if (from + glbBytes > bytes) json.fail("a place in the pack");
  return { url: json.field("url").blob(), bytes, from };
}
