/**
 * What does the inspector want to know of a place? Which cells lie around and what of them is here already, why an
 * object counts as visible, and what is hidden, of most of which nothing is here.
 */
import type { Bounds } from "../basics/geometry.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import type { KnownCells } from "../strategy/ahead.ts";

/** How far the preparation of a cell has come: nothing known, what it sees known, under way, all of it here. */
export type Preparation = "unknown" | "known" | "coming" | "ready";

/** What a survey asks of. The explorer is one. */
export interface Surveyed extends KnownCells {
  placed(object: number): PlacedObject | undefined;
  holds(model: number): boolean;
  /** Whether a cell is being prepared. */
  prepares(cell: number): boolean;
}

export interface Neighbour {
  readonly cell: number;
  readonly bounds: Bounds;
  readonly preparation: Preparation;
}

export function preparationOf(world: Surveyed, cell: number): Preparation {
  const record = world.recordOf(cell);
  if (!record) return "unknown";
  const seen = [...record.lpvs, ...record.opvs].map(({ object }) => world.placed(object));
  if (seen.every((object) => object && world.holds(object.model.model))) return "ready";
  return world.prepares(cell) ? "coming" : "known";
}

/** The cells next door. */
export function neighboursOf(world: Surveyed, cell: number): Neighbour[] {
  return (world.entryOf(cell)?.adjacent ?? []).flatMap((next) => {
    const entry = world.entryOf(next);
    return entry ? { cell: next, bounds: entry.bounds, preparation: preparationOf(world, next) } : [];
  });
}

/** Why things are visible from a cell. */
export interface Reasons {
  /** Objects wholly inside the cell. */
  readonly local: readonly Bounds[];
  /** Objects elsewhere that can be seen from it. */
  readonly objects: readonly Bounds[];
  /** Cells that can be seen into. */
  readonly cells: readonly Bounds[];
}

export function reasonsAt(world: Surveyed, cell: number): Reasons {
  const record = world.recordOf(cell);
  const boxes = (seen: readonly { object: number }[] = []) =>
    seen.flatMap(({ object }) => world.placed(object)?.entry.bounds ?? []);
  return {
    local: boxes(record?.lpvs),
    objects: boxes(record?.opvs),
    cells: (record?.cpvs ?? []).flatMap((seen) => world.entryOf(seen)?.bounds ?? []),
  };
}

/** What is not in the picture. */
export interface Hidden {
  readonly objects: readonly PlacedObject[];
  /** How many of them have nothing here. The models of the others were seen before, lie ahead, or are used by what is visible. */
  readonly absent: number;
  /** Level 0, with its textures, of models of which nothing is here. */
  readonly saved_bytes: number;
  /** The same of all models. */
  readonly whole_bytes: number;
}

/** Of all objects; `isHere` says of which models something is here or under way. */
export function hiddenFrom(
  visible: readonly PlacedObject[],
  all: readonly PlacedObject[],
  isHere: (model: number) => boolean,
): Hidden {
  const shown = new Set(visible.map(({ entry }) => entry.object));
  const seen = new Set(visible.map(({ model }) => model.model));
  const objects = all.filter(({ entry }) => !shown.has(entry.object));
  const isWanted = ({ model }: PlacedObject) => seen.has(model.model) || isHere(model.model);
  const whole_bytes = finestBytes(all);
  const saved_bytes = whole_bytes - finestBytes(all.filter(isWanted));
  return { objects, absent: objects.filter((object) => !isWanted(object)).length, saved_bytes, whole_bytes };
}

function finestBytes(objects: readonly PlacedObject[]): number {
  const files = new Map<string, number>();
  for (const { model } of objects) {
    const finest = model.levels[0];
    if (!finest) continue;
    files.set(finest.url, finest.bytes);
    for (const { url, bytes } of finest.textures) files.set(url, bytes);
  }
  return [...files.values()].reduce((sum, bytes) => sum + bytes, 0);
}
