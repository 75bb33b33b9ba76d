/**
 * What is known of an object before it has any geometry? Finds objects by id through the page tree, a chunk of
 * neighbours at a time, and joins each with its model.
 */
import { entryOf } from "./cellindex.ts";
import type { Model, ObjectChunk, ObjectEntry, PageEntry } from "./documents.ts";
import { PRIORITY } from "./priority.ts";
import type { PublishedScene } from "./published.ts";

/** A placed object and the geometry that it shares. */
export interface PlacedObject {
  readonly entry: ObjectEntry;
  readonly model: Model;
}

/** How far the surface of a level or rung may be from the source's, in metres in the world. */
export function geometricError_m(object: PlacedObject, grade: { readonly geometricError: number }): number {
  return grade.geometricError * object.entry.scale;
}

/** What is used besides levels; so unless this says no. */
export interface Uses {
  /** Smooth LODs, where they cost less than levels. */
  readonly smooth?: boolean;
  readonly impostors?: boolean;
  /** Rules: models are grown here where that costs less than levels. */
  readonly rules?: boolean;
}

export class ObjectDirectory {
  private readonly objects = new Map<number, PlacedObject>();
  private readonly models = new Map<number, Model>();

  constructor(
    private readonly scene: PublishedScene,
    private readonly uses: Uses = {},
  ) {
    if (scene.manifest.whole) this.add(scene.manifest.whole);
  }

  /** Objects that have been read so far. */
  known(object: number): PlacedObject | undefined {
    return this.objects.get(object);
  }

  /** All objects of a small world, or `undefined` for a world with cells. */
  whole(): PlacedObject[] | undefined {
    return this.scene.manifest.whole && [...this.objects.values()];
  }

  /** The objects with these ids, in the order in which they were asked for. */
  async resolve(ids: readonly number[], priority: number = PRIORITY.document): Promise<PlacedObject[]> {
    const missing = ids.filter((id) => !this.objects.has(id));
    await this.read(missing, this.scene.manifest.objects.entries, priority);
    return ids.map((id) => {
      const object = this.objects.get(id);
      if (!object) throw new Error(`the index of objects does not hold o${id}`);
      return object;
    });
  }

  /** Every object of the scene, however large it is. */
  async everything(priority: number): Promise<PlacedObject[]> {
    const ids = this.scene.manifest.objects.entries.flatMap(({ first, count }) =>
      Array.from({ length: count }, (_, i) => first + i),
    );
    return this.resolve(ids, priority);
  }

  /** Reads every chunk below `entries` that holds one of the ids; chunks travel side by side. */
  private async read(ids: readonly number[], entries: readonly PageEntry[], priority: number): Promise<void> {
    await Promise.all(
      entries.map(async (entry) => {
        const below = ids.filter((id) => entryOf({ entries: [entry] }, id));
        if (below.length === 0) return;
        if (entry.kind === "chunk") this.add(await this.scene.objectChunk(entry, priority));
        else await this.read(below, (await this.scene.page(entry, priority)).entries, priority);
      }),
    );
  }

  private add(chunk: ObjectChunk): void {
    const { smooth = true, impostors = true, rules = true } = this.uses;
    for (const [id, model] of chunk.models) {
      if (this.models.has(id)) continue;
      const used = {
        smooth: smooth ? model.smooth : undefined,
        impostor: impostors ? model.impostor : undefined,
        rules: rules ? model.rules : undefined,
      };
      this.models.set(id, { ...model, ...used });
    }
    for (const entry of chunk.objects) {
      const model = this.models.get(entry.model);
      if (model && !this.objects.has(entry.object)) this.objects.set(entry.object, { entry, model });
    }
  }
}
