/**
 * What is around a point, where no cell says what can be seen from there? The objects in the chunks that are nearest, those
 * first that fill most of the view.
 */
import type { PageEntry } from "./documents.ts";
import { type Bounds, diagonal_m, length, middle, subtract, type Vec3 } from "./geometry.ts";
import type { ObjectDirectory, PlacedObject } from "./objects.ts";
import { nearestChunks } from "./pagetree.ts";
import { PRIORITY } from "./priority.ts";
import type { PublishedScene } from "./published.ts";

/** So many chunks of objects are read. */
const MOST_CHUNKS = 16;
/** Who has gone such a share of the world's diagonal has strayed. */
const STRAYED_SHARE = 0.1;

/** About the share of the view that a box fills; 1 from inside. */
function sizeInView(bounds: Bounds, point: Vec3): number {
  const radius_m = diagonal_m(bounds) / 2;
  const distance_m = Math.max(radius_m, length(subtract(middle(bounds), point)));
  return distance_m === 0 ? 1 : (radius_m / distance_m) ** 2;
}

/** In the order of their solid angle, largest first. */
export function bySolidAngle(objects: readonly PlacedObject[], point: Vec3): PlacedObject[] {
  const sizes = new Map(objects.map((object) => [object, sizeInView(object.entry.bounds, point)]));
  return [...objects].sort((a, b) => (sizes.get(b) ?? 0) - (sizes.get(a) ?? 0));
}

/** Looks around, and anew where one has strayed. */
export class Surroundings {
  private around: Vec3 | undefined;

  constructor(
    private readonly scene: PublishedScene,
    private readonly directory: ObjectDirectory,
    private readonly problem: (error: unknown) => void,
  ) {}

  /** Who has gone so far has strayed. */
  get strayed_m(): number {
    return STRAYED_SHARE * diagonal_m(this.scene.manifest.bounds);
  }

  /** What is around a point; `undefined` for who has looked around near by, or looks around elsewhere meanwhile. */
  async look(point: Vec3): Promise<PlacedObject[] | undefined> {
    if (this.around && length(subtract(this.around, point)) < this.strayed_m) return undefined;
    this.around = point;
    const objects = this.directory.whole() ?? (await this.readAround(point));
    return this.around === point ? bySolidAngle(objects, point) : undefined;
  }

  /** Looks around the next time wherever that is. */
  forget(): void {
    this.around = undefined;
  }

  /** What cannot be had is told once and left out. */
  private async readAround(point: Vec3): Promise<PlacedObject[]> {
    const { scene, directory } = this;
    let isTold = false;
    const leave = (error: unknown) => {
      if (!isTold) this.problem(error);
      isTold = true;
      return undefined;
    };
    const found: Promise<PlacedObject[] | undefined>[] = [];
    const read = (entry: PageEntry) => scene.page(entry, PRIORITY.document).catch(leave);
    for await (const { first, count } of nearestChunks(scene.manifest.objects, point, read)) {
      const ids = Array.from({ length: count }, (_, i) => first + i);
      found.push(directory.resolve(ids, PRIORITY.document).catch(leave));
      if (found.length === MOST_CHUNKS) break;
    }
    return (await Promise.all(found)).flatMap((objects) => objects ?? []);
  }
}
