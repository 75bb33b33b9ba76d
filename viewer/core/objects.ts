/**
 * What is known of an object before it has any geometry? Finds objects and their models by id through the page trees, a chunk of
 * neighbours at a time, and joins each with its model.
 */
import { entryOf } from "./cellindex.ts";
import type { Model, ObjectEntry, PageEntry } from "./documents.ts";
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
  /** Entries of objects whose models nobody has asked for yet. */
  private readonly entries = new Map<number, ObjectEntry>();

  constructor(
    private readonly scene: PublishedScene,
    private readonly uses: Uses = {},
  ) {
    const { whole } = scene.manifest;
    if (!whole) return;
    this.learn(whole.models);
    for (const entry of whole.objects) {
      this.entries.set(entry.object, entry);
      this.placed(entry.object);
    }
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
    const { objects, models } = this.scene.manifest;
    const missing = ids.filter((id) => !this.objects.has(id));
    await this.read(missing, objects.entries, priority, async (entry) => {
      const entries = await this.scene.objectChunk(entry, priority);
      for (const object of entries) if (!this.objects.has(object.object)) this.entries.set(object.object, object);
    });
    const used = missing.flatMap((id) => this.entries.get(id)?.model ?? []);
    const unknown = [...new Set(used)].filter((id) => !this.models.has(id));
    await this.read(unknown, models.entries, priority, async (entry) => {
      this.learn(await this.scene.modelChunk(entry, priority));
    });
    return ids.map((id) => this.placed(id) ?? this.lacks(id));
  }

  /** Every object of the scene, however large it is. */
  async everything(priority: number): Promise<PlacedObject[]> {
    const ids = this.scene.manifest.objects.entries.flatMap(({ first, count }) =>
      Array.from({ length: count }, (_, i) => first + i),
    );
    return this.resolve(ids, priority);
  }

  /** Reads every chunk below `entries` that holds one of the ids; chunks travel side by side. */
  private async read(
    ids: readonly number[],
    entries: readonly PageEntry[],
    priority: number,
    chunk: (entry: PageEntry) => Promise<void>,
  ): Promise<void> {
    await Promise.all(
      entries.map(async (entry) => {
        const below = ids.filter((id) => entryOf({ entries: [entry] }, id));
        if (below.length === 0) return;
        if (entry.kind === "chunk") await chunk(entry);
        else await this.read(below, (await this.scene.page(entry, priority)).entries, priority, chunk);
      }),
    );
  }

  private learn(models: ReadonlyMap<number, Model>): void {
    const { smooth = true, impostors = true, rules = true } = this.uses;
    for (const [id, model] of models) {
      if (this.models.has(id)) continue;
      const used = {
        smooth: smooth ? model.smooth : undefined,
        impostor: impostors ? model.impostor : undefined,
        rules: rules ? model.rules : undefined,
      };
      this.models.set(id, { ...model, ...used });
    }
  }

  /** An object whose entry and model have been read. */
  private placed(id: number): PlacedObject | undefined {
    const known = this.objects.get(id);
    const entry = this.entries.get(id);
    const model = entry && this.models.get(entry.model);
    if (known || !entry || !model) return known;
    const object = { entry, model };
    this.entries.delete(id);
    this.objects.set(id, object);
    return object;
  }

  private lacks(id: number): never {
    throw new Error(`the index does not hold o${id} and its model`);
  }
}
