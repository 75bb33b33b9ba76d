import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, it } from "vitest";
import type { Vec3 } from "../basics/geometry.ts";
import type { FileRef } from "../documents/documents.ts";
import type { Model } from "../documents/modeldocument.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import { approaches, type KnownCells } from "./ahead.ts";
import { costAlone_bytes } from "./file.ts";
import { ALL_RUNGS, filesOf, type Grade, gradesOf, type Holding, nameOf } from "./grade.ts";
import { Motion } from "./motion.ts";
import { type Stock, targetWithin } from "./plan.ts";
import { wanted } from "./planner.ts";
import type { Want } from "./priority.ts";
import { firstProgress, sharpProgress } from "./progress.ts";
import type { Eye } from "./sight.ts";

/**
 * Does the viewer decide as the Rust client does what to fetch? `situations.json` holds a small world and where somebody is
 * in it; `decisions.json` is what `client/tests/golden_strategy.rs` found for it.
 */
interface Situations {
  readonly cells: readonly {
    readonly cell: number;
    readonly min: Vec3;
    readonly max: Vec3;
    readonly openings: readonly { readonly to: number; readonly min: Vec3; readonly max: Vec3 }[];
    readonly sees: readonly number[];
  }[];
  readonly objects: readonly {
    readonly model: number;
    readonly min: Vec3;
    readonly max: Vec3;
    readonly scale: number;
  }[];
  readonly models: readonly Shape[];
  readonly packs: readonly { readonly bytes: number }[];
  readonly walks: readonly Walk[];
}

interface Shape {
  /** Bytes, triangles and error of each. */
  readonly levels: readonly (readonly [number, number, number])[];
  /** Bytes of the pictures of each level. */
  readonly pictures?: readonly (readonly number[])[];
  /** End, triangles and error of each. */
  readonly rungs?: readonly (readonly [number, number, number])[];
  /** Which one holds the coarsest level, and from where on. */
  readonly pack?: readonly [number, number];
  /** Of the one file of rules from which all grow that do. */
  readonly rules_bytes?: number;
}

interface Walk {
  readonly name: string;
  readonly cell: number;
  readonly poses: readonly (readonly [number, Vec3])[];
  readonly bytes_per_s: number | null;
  readonly most_triangles?: number;
  readonly held?: readonly (readonly [number, string])[];
  readonly lost?: readonly string[];
}

const GOLDEN = join(import.meta.dirname, "../../../tests/golden/strategy");
const read = (name: string) => JSON.parse(readFileSync(join(GOLDEN, name), "utf8"));
const situations: Situations = read("situations.json");
const decisions: Record<string, unknown> = read("decisions.json");
/** The picture that published switching distances are made for. */
const PICTURE = { viewAngle_rad: Math.PI / 3, height_px: 1080 };

function modelOf({ levels, pictures, rungs, pack, rules_bytes }: Shape, model: number): Model {
  const [[, triangles, geometricError] = [0, 0, 0]] = levels;
  return {
    model,
    levels: levels.map(([bytes, triangles, geometricError], level) => ({
      level,
      url: `/o/m${model}-${level}.glb`,
      bytes,
      triangles,
      geometricError,
      textures: (pictures?.[level] ?? []).map((bytes, i) => ({ url: `/o/m${model}-${level}-${i}.png`, bytes })),
      pack: pack && level === levels.length - 1 ? packOf(pack) : undefined,
    })),
    smooth: rungs && {
      url: `/o/m${model}.slod`,
      bytes: rungs.at(-1)?.[0] ?? 0,
      materials: { url: `/o/m${model}.gltf`, bytes: 300 },
      textures: [],
      rungs: rungs.map(([to, triangles, geometricError], number) => ({
        url: `/o/m${model}.r${number}.slod`,
        from: rungs[number - 1]?.[0] ?? 0,
        to,
        triangles,
        geometricError,
      })),
    },
    rules: rules_bytes === undefined ? undefined : { ...RULES, file: rulesOf(rules_bytes), triangles, geometricError },
  };
}

const RULES = { imports: new Map(), part: undefined, parameters: {}, seed: 0 };
const rulesOf = (bytes: number): FileRef => ({ url: "/o/rules.dcg", bytes });

const packOf = ([pack, from]: readonly [number, number]) => ({
  url: `/o/${pack}.pack`,
  bytes: situations.packs[pack]?.bytes ?? 0,
  from,
});

const models = situations.models.map(modelOf);
const objects = situations.objects.map(({ model, min, max, scale }, object): PlacedObject => {
  const entry = { object, sourceNode: "", bounds: { min, max }, worldFromObject: [], scale, model };
  return { entry, model: models[model] as Model };
});
const seenFrom = (cell: number) => (situations.cells[cell]?.sees ?? []).map((id) => objects[id] as PlacedObject);
const cells = {
  entryOf: (id: number) => {
    const cell = situations.cells[id];
    return cell && { cell: id, bounds: cell, adjacent: cell.openings.map(({ to }) => to) };
  },
  recordOf: (id: number) => ({
    portals: situations.cells[id]?.openings.map(({ to, min, max }) => ({ to, polygon: [min, max], door: undefined })),
  }),
} as unknown as KnownCells;

/** What is here, as if it had come at once. */
class Shelves implements Stock {
  private readonly here = new Set<string>();
  private readonly holdings = new Map<number, Holding>();

  of(model: number): Holding {
    return this.holdings.get(model) ?? { held: undefined, taken: 0, failed: new Set() };
  }

  readonly costOf = (file: FileRef) => (this.here.has(file.url) ? 0 : costAlone_bytes(file));

  /** Whether nothing need come for it. */
  has({ object: { model }, grade }: Want): boolean {
    return filesOf(model, grade, this.of(model.model).taken).every((file) => this.costOf(file) === 0);
  }

  hold(model: Model, held: Grade): void {
    const before = this.of(model.model);
    for (const { url } of filesOf(model, held, before.taken)) this.here.add(url);
    const taken = held.kind === "rung" ? held.number + 1 : 0;
    this.holdings.set(model.model, { ...before, held, taken });
  }

  lose(what: string): void {
    const [, model = "", name = ""] = /^m(\d+) (.*)$/.exec(what) ?? [];
    const before = this.of(Number(model));
    const failed = new Set([...before.failed, name === "stream" ? ALL_RUNGS : name]);
    this.holdings.set(Number(model), { ...before, failed });
  }
}

function told({ object, grade, cause }: Want): string {
  const why = cause.kind === "ahead" ? `c${cause.cell} ${cause.due ? "due" : "later"}` : cause.kind;
  return `${why}: m${object.model.model} ${grade.kind === "grown" ? "grown from rules" : nameOf(grade)}`;
}

const rounded = (x: number) => Math.round(x * 1e6) / 1e6 + 0;

function decide({ cell, poses, bytes_per_s, most_triangles, held = [], lost = [] }: Walk): unknown {
  const motion = new Motion();
  for (const [t_ms, position] of poses) motion.observe(t_ms, position);
  const eye: Eye = { position: poses.at(-1)?.[1] ?? [0, 0, 0], ...PICTURE };
  const stock = new Shelves();
  for (const [number, name] of held) {
    const model = models[number] as Model;
    stock.hold(model, gradesOf(model).find((grade) => nameOf(grade) === name) as Grade);
  }
  for (const what of lost) stock.lose(what);
  const found = approaches(cell, cells, eye.position, motion.velocity_mps);
  const ahead = found.map((approach) => ({ ...approach, objects: seenFrom(approach.cell) }));
  const here = seenFrom(cell);
  const scope = { objects: here, count: here.length, told_bytes: undefined, isHiding: false };
  const first = firstProgress(scope, (model) => stock.of(model));
  const sharp = sharpProgress(scope, (model) => stock.of(model), eye, 1);
  const target_px = targetWithin(here, eye, 1, most_triangles ?? Number.POSITIVE_INFINITY);
  const view = { eye, here, isAllKnown: true, ahead };
  const fetched: string[] = [];
  for (;;) {
    const [next] = wanted(view, stock, target_px, bytes_per_s ?? Number.POSITIVE_INFINITY);
    if (!next || fetched.length > 1000) break;
    if (!stock.has(next)) fetched.push(told(next));
    stock.hold(next.object.model, next.grade);
  }
  return {
    velocity_mps: motion.velocity_mps.map(rounded),
    approaches: found.map((approach) => [approach.cell, approach.step, rounded(approach.in_s)]),
    first_bytes: [first.loaded_bytes, first.total_bytes],
    sharp_bytes: [sharp.loaded_bytes, sharp.total_bytes],
    fetched,
  };
}

it.each(situations.walks.map((walk) => [walk.name, walk] as const))("%s: the same as in Rust", (name, walk) => {
  expect(decide(walk)).toEqual(decisions[name]);
});

it("nothing else was decided", () => {
  expect(Object.keys(decisions).sort()).toEqual(situations.walks.map(({ name }) => name).sort());
});
