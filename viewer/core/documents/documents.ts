/**
 * What do the JSON documents of a published tree hold, but for what they say of models? One type and one reader for each; the readers refuse anything
 * that the rest of the viewer would have to doubt. Dense ids (`c12`, `o9`, `m3`) become numbers here.
 */
import type { Bounds, Plane, Vec3 } from "../basics/geometry.ts";
import type { Json } from "../basics/json.ts";
import { readFile } from "./impostordocument.ts";
import { type Model, readModelChunk } from "./modeldocument.ts";

/** The version of the published format that this build reads. */
export const FORMAT = 4;

export interface SceneSummary {
  readonly scene: string;
  readonly title: string;
  readonly bounds: Bounds;
}

export interface Viewpoint {
  readonly name: string;
  readonly position: Vec3;
  /** Unit quaternion x, y, z, w; the identity looks along −Z with +Y up. */
  readonly orientation: readonly number[];
  readonly cell: number;
  /** Whether the author named no place to begin, and the bake chose this one. */
  readonly isMadeUp: boolean;
}

/** `/v1/scenes/{scene}/index.json`: which revision is current. */
export interface Pointer {
  readonly scene: string;
  readonly title: string;
  readonly revision: string;
  readonly manifest: string;
  readonly bounds: Bounds;
  readonly bytes: ReadonlyMap<string, number>;
}

/** One page of an index tree. */
export interface Page {
  readonly entries: readonly PageEntry[];
}

export interface PageEntry {
  readonly kind: "page" | "chunk";
  readonly url: string;
  readonly bytes: number;
  /** The first id below it. */
  readonly first: number;
  /** How many ids lie below it. */
  readonly count: number;
  readonly bounds: Bounds;
}

export interface Manifest {
  readonly title: string;
  readonly bounds: Bounds;
  readonly counts: { readonly cells: number; readonly objects: number; readonly models: number };
  readonly viewpoints: readonly Viewpoint[];
  readonly cells: Page;
  readonly objects: Page;
  readonly models: Page;
  /** Where grown models stand, by id of object; `undefined` when none does. */
  readonly populations: Page | undefined;
  /** What who begins in one of these cells needs to know first. */
  readonly starts: readonly StartRef[];
  /** A small world: every object at once, and all of them count as visible. */
  readonly whole: Whole | undefined;
}

/** What the index knows of a cell. */
export interface CellEntry {
  readonly cell: number;
  readonly bounds: Bounds;
  /** Half-spaces that together with the box are the cell; none when it is its box. */
  readonly planes: readonly Plane[];
  readonly adjacent: readonly number[];
  readonly record: string;
  readonly recordBytes: number;
  /** What changes on the way to each adjacent cell; `undefined` when there is none. */
  readonly steps: { readonly url: string; readonly bytes: number } | undefined;
}

/** An immutable object and its size. */
export interface FileRef {
  readonly url: string;
  readonly bytes: number;
}

export interface ObjectEntry {
  readonly object: number;
  readonly sourceNode: string;
  readonly bounds: Bounds;
  /** `world_from_object`, column-major. */
  readonly worldFromObject: readonly number[];
  /** Multiplies the model's errors into metres. */
  readonly scale: number;
  readonly model: number;
  /** Whether it is a door, which can be closed. */
  readonly door?: boolean;
}

/** All objects of a small world, and their models. */
export interface Whole {
  readonly objects: readonly ObjectEntry[];
  readonly models: ReadonlyMap<number, Model>;
}

/** What one needs to know first in a cell: those around, all that can be seen from them, and the models of that. */
export interface Start extends Whole {
  /** Where one begins. */
  readonly start: number;
  readonly cells: readonly CellEntry[];
}

/** Where a start is. */
export interface StartRef extends FileRef {
  readonly cell: number;
  /** The box around its hull. */
  readonly bounds: Bounds;
  /** Bytes of what who grows rules would read instead. */
  readonly grownBytes: number;
}

export function readSceneList(json: Json): SceneSummary[] {
  return json.field("scenes").list((scene) => ({
    scene: scene.field("scene").text(),
    title: scene.field("title").text(),
    bounds: scene.field("bounds").bounds(),
  }));
}

export function readPointer(json: Json): Pointer {
  return {
    scene: json.field("scene").text(),
    title: json.field("title").text(),
    revision: json.field("revision").text(),
    manifest: json.field("manifest").blob(),
    bounds: json.field("bounds").bounds(),
    bytes: new Map(json.field("bytes").entries((bytes) => bytes.count())),
  };
}

function readViewpoint(json: Json): Viewpoint {
  return {
    name: json.field("name").text(),
    position: json.field("position").vec3(),
    orientation: json.field("orientation").numbers(4),
    cell: json.field("cell").id("c"),
    isMadeUp: json.field("made_up").optional((madeUp) => madeUp.boolean()) ?? false,
  };
}

export function readManifest(json: Json): Manifest {
  const format = json.field("format").count();
  if (format !== FORMAT) json.field("format").fail(`${FORMAT}, the format that this viewer reads, and not ${format}`);
  const viewpoints = json.field("viewpoints").list(readViewpoint);
  if (viewpoints.length === 0) json.field("viewpoints").fail("a list with at least one viewpoint");
  const counts = json.field("counts");
  return {
    title: json.field("title").text(),
    bounds: json.field("bounds").bounds(),
    counts: {
      cells: counts.field("cells").count(),
      objects: counts.field("objects").count(),
      models: counts.field("models").count(),
    },
    viewpoints,
    cells: readPage(json.field("cells")),
    objects: readPage(json.field("objects")),
    models: readPage(json.field("models")),
    populations: json.field("populations").optional(readPage),
    starts: json.field("starts").optional((starts) => starts.list(readStartRef)) ?? [],
    whole: json.field("whole").optional(readWhole),
  };
}

export function readPage(json: Json): Page {
  return {
    entries: json.field("entries").list((entry) => {
      const kind = entry.field("kind").text();
      if (kind !== "page" && kind !== "chunk") return entry.field("kind").fail("page or chunk");
      return {
        kind,
        url: entry.field("url").blob(),
        bytes: entry.field("bytes").count(),
        first: entry.field("first").u32(),
        count: entry.field("count").u32(),
        bounds: entry.field("bounds").bounds(),
      };
    }),
  };
}

export function readCellChunk(json: Json): CellEntry[] {
  return json.field("cells").list(readCellEntry);
}

function readCellEntry(cell: Json): CellEntry {
  return {
    cell: cell.field("cell").id("c"),
    bounds: cell.field("bounds").bounds(),
    planes: cell.field("planes").optional((planes) => planes.list(readPlane)) ?? [],
    adjacent: cell.field("adjacent").list((id) => id.id("c")),
    record: cell.field("record").blob(),
    recordBytes: cell.field("record_bytes").count(),
    steps: cell.field("steps").optional((url) => ({ url: url.blob(), bytes: cell.field("steps_bytes").count() })),
  };
}

function readStartRef(json: Json): StartRef {
  return {
    ...readFile(json),
    cell: json.field("cell").id("c"),
    bounds: json.field("bounds").bounds(),
    grownBytes: json.field("grown_bytes").count(),
  };
}

export function readStart(json: Json): Start {
  return { start: json.field("start").id("c"), cells: readCellChunk(json), ...readWhole(json) };
}

function readPlane(json: Json): Plane {
  const [x = 0, y = 0, z = 0, offset = 0] = json.numbers(4);
  return { normal: [x, y, z], offset };
}

function readWhole(json: Json): Whole {
  const models = readModelChunk(json);
  const objects = readObjectChunk(json);
  for (const entry of objects) {
    if (!models.has(entry.model)) json.field("models").fail(`a table that also holds m${entry.model}`);
  }
  return { objects, models };
}

export function readObjectChunk(json: Json): ObjectEntry[] {
  return json.field("objects").list(readObjectEntry);
}

function readObjectEntry(json: Json): ObjectEntry {
  return {
    object: json.field("object").id("o"),
    sourceNode: json.field("source_node").text(),
    bounds: json.field("bounds").bounds(),
    worldFromObject: json.field("transform").numbers(16),
    scale: json.field("scale").number(),
    model: json.field("model").id("m"),
    door: json.field("door").optional((door) => door.boolean()) ?? false,
  };
}
