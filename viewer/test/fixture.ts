/**
 * What is a small published scene? A row of rooms with doorways, made in memory: pointer, manifest, pages, chunks,
 * records, GLBs and a picture, under the names that their bytes give them.
 *
 * ```text
 *   +------+ +------+ +------+        cells: room 0 = c0, doorway = c1, room 1 = c2, …
 *   | c0  [c1] c2  [c3] c4   |        from a room one sees the room, its doorways and the rooms next door
 *   +------+ +------+ +------+
 * ```
 */
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Bounds, Vec3 } from "../core/basics/geometry.ts";
import type { CellRecord, Portal, Visible } from "../core/documents/cellrecord.ts";
import { FORMAT } from "../core/documents/documents.ts";
import type { PackRef } from "../core/documents/modeldocument.ts";
import { readHeader } from "../core/smooth/header.ts";
import {
  ball,
  box,
  encodeCellRecord,
  encodeGlb,
  encodePng,
  encodePopulation,
  encodeSteps,
  type Shape,
  type WrittenPopulation,
} from "./encode.ts";

/** Smooth LODs as the encoder wrote them. */
export const GOLDEN = join(import.meta.dirname, "../../tests/golden/smooth");

export const ROOM_M = 6;
export const WALL_M = 0.4;
export const HEIGHT_M = 3;
const DOOR_HALF_WIDTH_M = 0.7;
const DOOR_HEIGHT_M = 2.2;
/** From the west wall of a room to that of the next. */
export const PITCH_M = ROOM_M + WALL_M;

export interface FixtureOptions {
  readonly rooms: number;
  /** Lists all objects in the manifest. */
  readonly whole?: boolean;
  /** Entries of one chunk and of one page, small so that the trees have several levels. */
  readonly perChunk?: number;
  /** Puts the coarsest levels of what stands in every room into one pack. */
  readonly packed?: boolean;
  /** Balls have a smooth LOD too. */
  readonly smooth?: boolean;
  /** Balls can be grown too, out of rules that import others. */
  readonly grown?: boolean;
  /** Populations say where those balls stand. */
  readonly populated?: boolean;
  /** Balls have an impostor too, smaller than any level. */
  readonly impostor?: boolean;
  /** The first room has a start. */
  readonly started?: boolean;
  /** Lintels are doors: each hides the room behind it when it is closed. */
  readonly doored?: boolean;
}

/** Paths below the base, `/o/…` and `/v1/…`, and their bytes. */
export type Files = Map<string, Uint8Array>;

interface Placed {
  readonly room: number;
  readonly model: number;
  readonly name: string;
  readonly at: Vec3;
  readonly scale: number;
}

type Kind = "cells" | "models" | "objects" | "populations";
type Entry = ReturnType<Publisher["objectEntry"]>;
/** What a model says of the rules that it has grown from. */
type Procedural = { rules: string; rules_bytes: number; imports: object; part: string; parameters: object };

/** The published tree of a scene called `rooms`. */
export function publish(options: FixtureOptions): Files {
  return new Publisher(options).files;
}

class Publisher {
  readonly files: Files = new Map();
  private readonly models: Record<
    string,
    { levels: { url: string; pack?: PackRef }[]; smooth?: object; impostor?: object; procedural?: Procedural }
  > = {};
  private readonly placed: Placed[] = [];
  private readonly sizes = new Map<number, { finest: number; coarsest: number }>();
  private readonly perChunk: number;

  constructor(private readonly options: FixtureOptions) {
    this.perChunk = options.perChunk ?? 4;
    this.makeModels();
    if (options.smooth) this.addSmooth(3);
    if (options.impostor) this.addImpostor(3);
    if (options.grown) this.addRules(3);
    if (options.packed) this.pack();
    for (let room = 0; room < options.rooms; room += 1) this.furnish(room);
    const objects = this.placed.map((placed, i) => this.objectEntry(placed, i));
    const cells = Array.from({ length: options.rooms * 2 - 1 }, (_, cell) => this.cellEntry(cell));
    const everywhere = objects.reduce((all, { bounds }) => union(all, bounds), objects[0]?.bounds ?? NOWHERE);
    const total = [...this.files.values()].reduce((sum, bytes) => sum + bytes.length, 0);
    const shared = {
      title: "A row of rooms",
      bounds: everywhere,
      up: "+Y",
      unit: "m",
      bytes: { source: total, published: total, level0: total, coarsest: total },
      viewpoints: [
        { name: "First room", position: [1.5, 1.6, 3], orientation: [0, -Math.SQRT1_2, 0, Math.SQRT1_2], cell: "c0" },
        { name: "Corner", position: [5, 1.6, 5], orientation: [0, 0.383, 0, 0.924], cell: "c0" },
      ],
    };
    const counts = { cells: cells.length, objects: objects.length, models: this.sizes.size, triangles: 1 };
    const manifest = this.json({
      format: FORMAT,
      ...shared,
      counts,
      visibility: { method: "sampled", guarantee: "sampled", mean_visible: 1 },
      cells: this.tree(cells, "cells", ({ bounds }) => bounds),
      objects: this.tree(objects, "objects", ({ bounds }) => bounds),
      models: this.tree(Object.entries(this.models), "models", () => everywhere),
      ...(options.populated && { populations: this.tree(objects, "populations", ({ bounds }) => bounds) }),
      ...(options.started && { starts: [this.start(objects)] }),
      whole: options.whole ? { objects, models: this.models } : null,
    });
    const { cells: cellCount, ...others } = counts;
    const revision = manifest.slice(3, 19);
    const pointer = { scene: "rooms", revision, manifest, ...shared, cells: cellCount, ...others };
    this.files.set("/v1/scenes/rooms/index.json", text(pointer));
    const summary = { scene: "rooms", title: shared.title, revision, bounds: everywhere };
    this.files.set("/v1/scenes/index.json", text({ scenes: [summary] }));
  }

  private blob(bytes: Uint8Array, ext: string): string {
    const url = `/o/${createHash("sha256").update(bytes).digest("hex")}.${ext}`;
    this.files.set(url, bytes);
    return url;
  }

  private json(value: unknown): string {
    return this.blob(text(value), "json");
  }

  private model(id: number, levels: { shape: Shape; error: number; texture?: string }[], color: Vec3): void {
    const written = levels.map(({ shape, error, texture }, level) => {
      const bytes = encodeGlb(shape, color, texture?.slice("/o/".length));
      const size = texture ? (this.files.get(texture)?.length ?? 0) : 0;
      return {
        level,
        url: this.blob(bytes, "glb"),
        bytes: bytes.length,
        triangles: shape.indices.length / 3,
        geometric_error_m: error,
        switch_distance_m: error * 935.3,
        ...(texture && { textures: [{ url: texture, bytes: size }] }),
      };
    });
    this.models[`m${id}`] = { levels: written };
    this.sizes.set(id, { finest: written[0]?.bytes ?? 0, coarsest: written.at(-1)?.bytes ?? 0 });
  }

  private makeModels(): void {
    const tiles = encodePng(64, (x, y) => (((x >> 4) + (y >> 4)) % 2 ? [205, 190, 165] : [150, 120, 95]));
    const texture = this.blob(tiles, "png");
    const [half, door] = [ROOM_M / 2, DOOR_HALF_WIDTH_M];
    this.model(0, [{ shape: box([0, -0.1, 0], [PITCH_M, 0, ROOM_M]), error: 0, texture }], [1, 1, 1]);
    this.model(1, [{ shape: box([0, 0, 0], [WALL_M, HEIGHT_M, half - door]), error: 0 }], [0.75, 0.72, 0.68]);
    this.model(2, [{ shape: box([0, 0, -0.2], [PITCH_M, HEIGHT_M, 0]), error: 0 }], [0.6, 0.3, 0.25]);
    this.model(
      3,
      [24, 10, 5].map((rings) => ({ shape: ball(rings), error: 1 - Math.cos(Math.PI / (2 * rings)) })),
      [0.2, 0.45, 0.55],
    );
    const lintel = box([0, DOOR_HEIGHT_M, half - door], [WALL_M, HEIGHT_M, half + door]);
    this.model(4, [{ shape: lintel, error: 0 }], [0.75, 0.72, 0.68]);
  }

  /** A stream that the encoder's own tests wrote, as if it were the same shape; its errors fall to nothing. */
  private addSmooth(model: number): void {
    const bytes = new Uint8Array(readFileSync(join(GOLDEN, "bowl.slod")));
    const url = this.blob(bytes, "slod");
    const cuts = readHeader(bytes)?.cuts ?? [];
    const rungs = cuts.map(({ bytes: to, triangles }, number) => {
      const from = cuts[number - 1]?.bytes ?? 0;
      const rung = url.replace(".slod", `.r${number}.slod`);
      this.files.set(rung, bytes.slice(from, to));
      const geometric_error_m = number === cuts.length - 1 ? 0 : 0.018 / (1 + number);
      return { url: rung, from, to, triangles, geometric_error_m, rms_error_m: 0 };
    });
    const document = { asset: { version: "2.0" }, materials: [{ name: "glaze" }, { name: "clay" }] };
    const materials = this.blob(text(document), "gltf");
    const materials_bytes = this.files.get(materials)?.length;
    const entry = this.models[`m${model}`];
    if (entry) entry.smooth = { url, bytes: bytes.length, materials, materials_bytes, rungs };
  }

  private addRules(model: number): void {
    const [glaze, ball] = [
      "material glaze { colour = #335588 }",
      'import "glaze.dcg" as glaze\npart ball(radius) { paint glaze.glaze sphere(radius, 24) }',
    ].map((source) => new TextEncoder().encode(source)) as [Uint8Array, Uint8Array];
    const entry = this.models[`m${model}`];
    const imports = { "glaze.dcg": { url: this.blob(glaze, "dcg"), bytes: glaze.length } };
    const url = this.blob(ball, "dcg");
    if (entry)
      entry.procedural = { rules: url, rules_bytes: ball.length, imports, part: "ball", parameters: { radius: 1 } };
  }

  private addImpostor(model: number): void {
    const picture = (letter: string) => {
      const bytes = text(`picture of ${letter}`);
      return { url: this.blob(bytes, "png"), bytes: bytes.length };
    };
    const [colour, shape] = [picture("colour"), picture("shape")];
    const view = { mapping: "octahedral", views: 4, size_px: 16, centre: [0, 0, 0], radius: 1 };
    const entry = this.models[`m${model}`];
    if (entry) entry.impostor = { colour, shape, ...view, error_m: 0.01, switch_distance_m: 10 };
  }

  /** The coarsest levels so far in one pack. */
  private pack(): void {
    const coarsest = Object.values(this.models).map(({ levels }) => levels[levels.length - 1]);
    const files = coarsest.map((level) => this.files.get(level?.url ?? "") ?? new Uint8Array());
    const whole = new Uint8Array(Buffer.concat(files));
    const url = this.blob(whole, "pack");
    let from = 0;
    coarsest.forEach((level, i) => {
      if (level) level.pack = { url, bytes: whole.length, from };
      from += files[i]?.length ?? 0;
    });
  }

  private furnish(room: number): void {
    const x = room * PITCH_M;
    const put = (model: number, name: string, at: Vec3, scale = 1) =>
      this.placed.push({ room, model, name: `${name} ${room}`, at, scale });
    this.model(5 + room, [{ shape: box([-0.3, 0, -0.3], [0.3, 1 + room / 10, 0.3]), error: 0 }], [0.8, 0.6, room / 12]);
    put(5 + room, "pedestal", [x + 3, 0, 4.6]);
    put(0, "floor", [x, 0, 0]);
    put(2, "north wall", [x, 0, 0]);
    put(2, "south wall", [x, 0, ROOM_M + 0.2]);
    for (let i = 0; i <= room % 3; i += 1) put(3, `ball ${i}`, [x + 1.5 + i * 1.4, 0.5, 1.2], 0.5);
    if (room + 1 === this.options.rooms) return;
    put(1, "wall left of the door", [x + ROOM_M, 0, 0]);
    put(1, "wall right of the door", [x + ROOM_M, 0, ROOM_M / 2 + DOOR_HALF_WIDTH_M]);
    put(4, "lintel", [x + ROOM_M, 0, 0]);
  }

  private objectEntry({ model, name, at, scale }: Placed, object: number) {
    const reach = model === 3 ? scale : undefined;
    const bounds = reach
      ? { min: at.map((a) => a - reach), max: at.map((a) => a + reach) }
      : { min: at, max: [at[0] + PITCH_M, at[1] + HEIGHT_M, at[2] + ROOM_M] };
    return {
      object: `o${object}`,
      source_node: name,
      part: 0,
      bounds: bounds as unknown as Bounds,
      transform: [scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0, ...at, 1],
      scale,
      model: `m${model}`,
      mover: false,
    };
  }

  private adjacent(cell: number): number[] {
    return [cell - 1, cell + 1].filter((id) => id >= 0 && id < this.options.rooms * 2 - 1);
  }

  /** The lintel between two rooms next to each other, where it is a door. */
  private doorBetween(a: number, b: number): number[] {
    const found = this.placed.findIndex(({ room, model }) => room === Math.min(a, b) && model === 4);
    return this.options.doored && found >= 0 ? [found] : [];
  }

  private record(cell: number): CellRecord {
    const adjacent = this.adjacent(cell);
    const bounds = cellBounds(cell);
    const seen = cell % 2 === 0 ? [cell / 2 - 1, cell / 2, cell / 2 + 1] : [(cell - 1) / 2, (cell + 1) / 2];
    const inside = (placed: Placed) => cell === placed.room * 2 && (placed.model === 3 || placed.model > 4);
    const entries = this.placed.map((placed, object) => ({ placed, object }));
    const visible = entries.filter(({ placed }) => seen.includes(placed.room));
    const list = (lpvs: boolean): Visible[] =>
      visible
        .filter(({ placed }) => inside(placed) === lpvs)
        .map(({ object, placed }) => {
          const doors = cell % 2 === 0 && placed.room !== cell / 2 ? this.doorBetween(cell / 2, placed.room) : [];
          return { object, fraction: 0.5, solidAngle: 1 / (1 + object), doors };
        });
    const models = [...new Set(visible.map(({ placed }) => placed.model))];
    const texture = models.includes(0) ? ([...this.files].find(([url]) => url.endsWith(".png"))?.[1].length ?? 0) : 0;
    const sum = (level: "coarsest" | "finest") =>
      texture + models.reduce((total, model) => total + (this.sizes.get(model)?.[level] ?? 0), 0);
    return {
      cell,
      hull: hullOf(bounds),
      adjacent,
      portals: adjacent.map((to) => {
        const way = Math.min(cell, to) >> 1;
        return { ...portal(cell, to), door: this.doorBetween(way, way + 1)[0] };
      }),
      cpvs: adjacent,
      opvs: list(false),
      lpvs: list(true),
      method: "sampled",
      conservative: false,
      missBound: 0.001,
      visibleLevel0Bytes: sum("finest"),
      visibleCoarsestBytes: sum("coarsest"),
    };
  }

  private cellEntry(cell: number) {
    const record = this.record(cell);
    const bytes = encodeCellRecord(record);
    const neighbours = this.adjacent(cell).map((id) => this.record(id));
    const steps = encodeSteps(record, neighbours);
    return {
      cell: `c${cell}`,
      bounds: cellBounds(cell),
      adjacent: record.adjacent.map((id) => `c${id}`),
      record: this.blob(bytes, "cell"),
      record_bytes: bytes.length,
      ...(neighbours.length > 0 && { steps: this.blob(steps, "steps"), steps_bytes: steps.length }),
      record_json: this.json({ cell: `c${cell}` }),
    };
  }

  /** What one needs to know first in the first room, its doorway and the room behind that. */
  private start(entries: readonly Entry[]) {
    const cells = [0, 1, 2].filter((cell) => cell < this.options.rooms * 2 - 1);
    const records = cells.map((cell) => this.record(cell));
    const seen = new Set(records.flatMap(({ lpvs, opvs }) => [...lpvs, ...opvs].map(({ object }) => object)));
    const objects = [...seen].sort((a, b) => a - b).flatMap((object) => entries[object] ?? []);
    const models = Object.fromEntries(objects.map(({ model }) => [model, this.models[model]]));
    const body = { start: "c0", cells: cells.map((cell) => this.cellEntry(cell)), objects, models };
    const size = text(body).length;
    return { cell: "c0", bounds: cellBounds(0), url: this.json(body), bytes: size, grown_bytes: size };
  }

  /** A chunk of an index. */
  private leaf(kind: Kind, items: readonly unknown[], first: number): { url: string; bytes: number } {
    if (kind === "populations") {
      const bytes = encodePopulation(this.populationOf(items as readonly Entry[]), first);
      return { url: this.blob(bytes, "pop"), bytes: bytes.length };
    }
    const body = { [kind]: kind === "models" ? Object.fromEntries(items as [string, object][]) : items };
    return { url: this.json(body), bytes: text(body).length };
  }

  private populationOf(objects: readonly Entry[]): WrittenPopulation {
    const grows = (model: string) => this.models[model]?.procedural;
    const [procedural] = objects.flatMap(({ model }) => grows(model) ?? []);
    const { rules: url, rules_bytes: bytes, imports, ...making } = procedural ?? {};
    const recipes = [{ rules: 0, ...making, model: "m3", triangles: 1104 }];
    const members = objects
      .filter(({ model }) => grows(model))
      .map(({ object, transform, scale }) => ({
        object: Number(object.slice(1)),
        recipe: 0,
        position: transform.slice(12, 15),
        rotation: [0, 0, 0, 1],
        scale,
      }));
    return { rules: procedural ? [{ url, bytes, imports }] : [], recipes: procedural ? recipes : [], members };
  }

  /** Builds an index tree, chunks first, and answers its root page. */
  private tree<T>(items: readonly T[], kind: Kind, boundsOf: (item: T) => Bounds) {
    let row = chunksOf(items, kind === "populations" ? 4 * this.perChunk : this.perChunk).map(({ first, slice }) => {
      const bounds = slice.map(boundsOf).reduce(union);
      return { kind: "chunk", ...this.leaf(kind, slice, first), first, count: slice.length, bounds };
    });
    while (row.length > this.perChunk) {
      row = chunksOf(row, this.perChunk).map(({ slice }) => {
        const count = slice.reduce((total, entry) => total + entry.count, 0);
        const bounds = slice.map((entry) => entry.bounds).reduce(union);
        const body = { entries: slice };
        return {
          kind: "page",
          url: this.json(body),
          bytes: text(body).length,
          first: slice[0]?.first ?? 0,
          count,
          bounds,
        };
      });
    }
    return { entries: row };
  }
}

const NOWHERE: Bounds = { min: [0, 0, 0], max: [0, 0, 0] };

function text(value: unknown): Uint8Array {
  return new TextEncoder().encode(JSON.stringify(value));
}

function chunksOf<T>(items: readonly T[], size: number): { first: number; slice: T[] }[] {
  const starts = Array.from({ length: Math.ceil(items.length / size) }, (_, i) => i * size);
  return starts.map((first) => ({ first, slice: items.slice(first, first + size) }));
}

function union(a: Bounds, b: Bounds): Bounds {
  const pick = (f: (x: number, y: number) => number, p: Vec3, q: Vec3): Vec3 => [
    f(p[0], q[0]),
    f(p[1], q[1]),
    f(p[2], q[2]),
  ];
  return { min: pick(Math.min, a.min, b.min), max: pick(Math.max, a.max, b.max) };
}

/** Rooms have even ids, the doorway between rooms `i` and `i + 1` is `2 i + 1`. */
export function cellBounds(cell: number): Bounds {
  const x = Math.floor(cell / 2) * PITCH_M;
  if (cell % 2 === 0) return { min: [x, 0, 0], max: [x + ROOM_M, HEIGHT_M, ROOM_M] };
  const middle = ROOM_M / 2;
  return {
    min: [x + ROOM_M, 0, middle - DOOR_HALF_WIDTH_M],
    max: [x + PITCH_M, DOOR_HEIGHT_M, middle + DOOR_HALF_WIDTH_M],
  };
}

export function hullOf({ min, max }: Bounds): CellRecord["hull"] {
  const corner = (i: number): Vec3 => [(i & 1 ? max : min)[0], (i & 2 ? max : min)[1], (i & 4 ? max : min)[2]];
  return {
    points: [0, 1, 2, 3, 4, 5, 6, 7].map(corner),
    faces: [
      [0, 4, 6, 2],
      [1, 3, 7, 5],
      [0, 1, 5, 4],
      [2, 6, 7, 3],
      [0, 2, 3, 1],
      [4, 5, 7, 6],
    ],
  };
}

function portal(from: number, to: number): Portal {
  const door = cellBounds(from % 2 === 1 ? from : to);
  const nearSide = from % 2 === 1 ? to < from : to > from;
  const x = nearSide ? door.min[0] : door.max[0];
  const [y0, y1, z0, z1] = [door.min[1], door.max[1], door.min[2], door.max[2]];
  return {
    to,
    polygon: [
      [x, y0, z0],
      [x, y1, z0],
      [x, y1, z1],
      [x, y0, z1],
    ],
    door: undefined,
  };
}
