/** What is an object that stands somewhere, for those who decide what to fetch of it? One whose levels shrink by halves. */
import type { FileRef } from "../core/documents/documents.ts";
import type { PlacedObject } from "../core/documents/placedobject.ts";
import type { Eye } from "../core/strategy/sight.ts";

/** Where one looks from: the origin, along −Z. */
export const EYE: Eye = { position: [0, 0, 0], viewAngle_rad: Math.PI / 3, height_px: 1080 };

/**
 * An object whose nearest point lies `distance_m` ahead, with one level for each error, finest first, of 1,000, 500, 250 …
 * bytes, which all show the same textures.
 */
export function placedAhead(
  id: number,
  model: number,
  distance_m: number,
  errors: readonly number[],
  textures: readonly FileRef[] = [],
): PlacedObject {
  return {
    entry: {
      object: id,
      sourceNode: `node ${id}`,
      bounds: { min: [-1, -1, -distance_m - 1], max: [1, 1, -distance_m] },
      worldFromObject: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
      scale: 1,
      model,
    },
    model: {
      model,
      levels: errors.map((geometricError, level) => ({
        level,
        url: `/o/${model}-${level}`,
        bytes: 1000 >> level,
        triangles: 1,
        geometricError,
        textures,
        pack: undefined,
      })),
    },
  };
}
