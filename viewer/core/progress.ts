/**
 * How much of what one can see is here? Exact, because the documents say how large every level is: bytes of levels and
 * of their textures, each once however many objects share them.
 */
import type { Level } from "./documents.ts";
import type { PlacedObject } from "./objects.ts";
import { desiredLevel, type Eye } from "./scheduler.ts";

export interface Progress {
  readonly loaded_bytes: number;
  readonly total_bytes: number;
}

/** The level that is held of a model, if any. */
export type HeldLevel = (model: number) => number | undefined;

/** Towards the first picture: the coarsest level of everything visible. */
export function coarsestProgress(visible: readonly PlacedObject[], heldLevel: HeldLevel): Progress {
  return progressTowards(visible, heldLevel, ({ model }) => model.levels.length - 1);
}

/** Towards the sharp picture: of everything visible the level that will do from here. */
export function sharpProgress(
  visible: readonly PlacedObject[],
  heldLevel: HeldLevel,
  eye: Eye,
  target_px: number,
): Progress {
  return progressTowards(visible, heldLevel, (object) => desiredLevel(object, eye, target_px));
}

function progressTowards(
  visible: readonly PlacedObject[],
  heldLevel: HeldLevel,
  wantedLevel: (object: PlacedObject) => number,
): Progress {
  const wanted = new Map<number, Level>();
  for (const object of visible) {
    const { model, levels } = object.model;
    const level = levels[wantedLevel(object)];
    const other = wanted.get(model);
    if (level && (!other || level.level < other.level)) wanted.set(model, level);
  }
  const textures = new Map<string, { bytes: number; loaded: boolean }>();
  let loaded_bytes = 0;
  let total_bytes = 0;
  for (const [model, level] of wanted) {
    const loaded = (heldLevel(model) ?? Number.POSITIVE_INFINITY) <= level.level;
    total_bytes += level.bytes;
    if (loaded) loaded_bytes += level.bytes;
    for (const { url, bytes } of level.textures) {
      textures.set(url, { bytes, loaded: loaded || (textures.get(url)?.loaded ?? false) });
    }
  }
  for (const { bytes, loaded } of textures.values()) {
    total_bytes += bytes;
    if (loaded) loaded_bytes += bytes;
  }
  return { loaded_bytes, total_bytes };
}
