/**
 * What is around a point, where no cell says what can be seen from there? The objects in the chunks that are nearest, those
 * first that fill most of the view. Of what cannot be had counts what is known already.
 */
import { type Bounds, diagonal_m, length, middle, subtract, type Vec3 } from "../basics/geometry.ts";
import type { PageEntry } from "../documents/documents.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import { type Loss, passes } from "../fetch/losses.ts";
import { StallError } from "../fetch/transfer.ts";
import { Pacer } from "../pace/pacer.ts";
import { PRIORITY } from "../strategy/priority.ts";
import type { Found, ObjectDirectory } from "./objects.ts";
import { nearestChunks } from "./pagetree.ts";
import type { PublishedScene } from "./published.ts";

/** So many chunks of objects are read. */
const MOST_CHUNKS = 16;
/** Who has gone such a share of the world's diagonal has strayed. */
const STRAYED_SHARE = 0.1;

/** While more and more of it gets known, it is told so often. */
const TOLD_EVERY_MS = 100;

export interface Around {
  readonly objects: readonly PlacedObject[];
  /** Whether that has to do: nothing else was found that may come yet. */
  readonly isAll: boolean;
}

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
  private soFar: () => void = () => {};

  constructor(
    private readonly scene: PublishedScene,
    private readonly directory: ObjectDirectory,
    private readonly problem: (error: unknown) => void,
  ) {}

  /** Who has gone so far has strayed. */
  get strayed_m(): number {
    return STRAYED_SHARE * diagonal_m(this.scene.manifest.bounds);
  }

  /** Whether one has looked around near by, or does so. */
  covers(point: Vec3): boolean {
    return this.around !== undefined && length(subtract(this.around, point)) < this.strayed_m;
  }

  /**
   * What is around a point; `undefined` for who has looked around near by, or looks around elsewhere meanwhile. `some` hears of what is known of
   * it while something is silent.
   */
  async look(
    point: Vec3,
    some: (objects: readonly PlacedObject[]) => void,
    how?: "meanwhile",
  ): Promise<Around | undefined> {
    if (this.covers(point)) return undefined;
    this.around = point;
    const whole = this.directory.whole();
    const { objects, isAll } = whole ? { objects: whole, isAll: true } : await this.readAround(point, some, how);
    return this.around === point ? { objects: bySolidAngle(objects, point), isAll } : undefined;
  }

  /** Something is silent: tells what is known so far of what is being looked for. */
  tell(): void {
    this.soFar();
  }

  /** Looks around the next time wherever that is. */
  forget(): void {
    this.around = undefined;
  }

  /** That something cannot be had is told once. */
  private async readAround(
    point: Vec3,
    some: (objects: readonly PlacedObject[]) => void,
    how?: "meanwhile",
  ): Promise<Around> {
    const { scene, directory } = this;
    const losses: Loss[] = [];
    const lostPages: PageEntry[] = [];
    const found: Promise<Found>[] = [];
    const chunks: PageEntry[] = [];
    const read = async (entry: PageEntry) => {
      const address = scene.tree.resolve(entry.url);
      const reading = scene.page(entry, PRIORITY.document);
      try {
        if (how !== "meanwhile") return await reading;
        // What is silent is done without for now.
        const silent = scene.queue.untilQuiet(address).then(() => Promise.reject(new StallError(address, 0)));
        return await Promise.race([reading, silent]);
      } catch (error) {
        reading.catch(() => {});
        if (losses.length === 0 && !(error instanceof StallError)) this.problem(error);
        losses.push({ error });
        lostPages.push(entry);
        return undefined;
      }
    };
    const telling = new Pacer(() => {
      const known = directory.knownBelow([...chunks, ...lostPages]);
      if (this.around === point) some(bySolidAngle(known, point));
    }, TOLD_EVERY_MS);
    const tell = () => scene.queue.isSilent && telling.ask();
    for await (const chunk of nearestChunks(scene.manifest.objects, point, read)) {
      found.push(directory.below(chunk, PRIORITY.document));
      chunks.push(chunk);
      found.at(-1)?.then(tell, () => {});
      if (found.length === MOST_CHUNKS) break;
    }
    this.soFar = tell;
    losses.push(...(await Promise.all(found)).flatMap(({ loss }) => loss ?? []));
    telling.close();
    if (this.soFar === tell) this.soFar = () => {};
    const objects = directory.knownBelow([...chunks, ...lostPages]);
    const isAll = !losses.some(({ error }) => passes(error)) && (objects.length > 0 || losses.length === 0);
    return { objects, isAll };
  }
}
