/**
 * What is around a point, where no cell says what can be seen from there? The objects in the chunks that are nearest, those
 * first that fill most of the view.
 */
import { type Bounds, distanceToBounds, length, middle, subtract, type Vec3 } from "./geometry.ts";
import type { ObjectDirectory, PlacedObject } from "./objects.ts";
import { PRIORITY } from "./priority.ts";
import type { PublishedScene } from "./published.ts";

/** So many chunks of objects are read. */
const MOST_CHUNKS = 16;

/** About the share of the view that a box fills; 1 from inside. */
function sizeInView(bounds: Bounds, point: Vec3): number {
  const radius_m = length(subtract(bounds.max, bounds.min)) / 2;
  const distance_m = Math.max(radius_m, length(subtract(middle(bounds), point)));
  return distance_m === 0 ? 1 : (radius_m / distance_m) ** 2;
}

/** In the order of their solid angle, largest first. */
export function bySolidAngle(objects: readonly PlacedObject[], point: Vec3): PlacedObject[] {
  const sizes = new Map(objects.map((object) => [object, sizeInView(object.entry.bounds, point)]));
  return [...objects].sort((a, b) => (sizes.get(b) ?? 0) - (sizes.get(a) ?? 0));
}

/** What is around a point; what cannot be had of it is told and left out. */
export async function surroundings(
  scene: PublishedScene,
  directory: ObjectDirectory,
  point: Vec3,
  problem: (error: unknown) => void,
): Promise<PlacedObject[]> {
  const found: Promise<PlacedObject[]>[] = [];
  const open = [...scene.manifest.objects.entries];
  while (open.length > 0 && found.length < MOST_CHUNKS) {
    open.sort((a, b) => distanceToBounds(b.bounds, point) - distanceToBounds(a.bounds, point));
    const next = open.pop();
    if (next?.kind === "page") {
      const page = await scene.page(next, PRIORITY.document).catch(problem);
      open.push(...(page?.entries ?? []));
    } else if (next) {
      const ids = Array.from({ length: next.count }, (_, i) => next.first + i);
      const left = (error: unknown) => {
        problem(error);
        return [];
      };
      found.push(directory.resolve(ids, PRIORITY.document).catch(left));
    }
  }
  return bySolidAngle((await Promise.all(found)).flat(), point);
}
