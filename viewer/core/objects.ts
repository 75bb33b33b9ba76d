/**
 * What is known of an object before it has any geometry? Finds objects and their models by id through the page trees, a chunk of
 * neighbours at a time, and joins each with its model. Where that takes long, something stands in (`standins.ts`).
 */
import type { ObjectEntry, Page, PageEntry, Whole } from "./documents.ts";
import type { Retried } from "./losses.ts";
import type { Model } from "./modeldocument.ts";
import { Pacer } from "./pacer.ts";
import { entryOf, type Holder, holdersOf } from "./pagetree.ts";
import { PRIORITY } from "./priority.ts";
import type { PublishedScene } from "./published.ts";
import { type PriorityOf, StandIns } from "./standins.ts";

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

/** How urgent it is to know of objects. */
export interface Urgency {
  readonly documents: number;
  /** What comes as early as the models themselves. */
  readonly models: number;
}

/** While more and more of what can be seen gets known, it is told so often. */
const TOLD_EVERY_MS = 100;

const AT_ONCE: Urgency = { documents: PRIORITY.document, models: PRIORITY.coarsest };

export class ObjectDirectory {
  private readonly objects = new Map<number, PlacedObject>();
  private readonly models = new Map<number, Model>();
  /** Entries of objects whose models nobody has asked for yet. */
  private readonly entries = new Map<number, ObjectEntry>();
  private readonly standIns: StandIns | undefined;

  constructor(
    private readonly scene: PublishedScene,
    private readonly uses: Uses = {},
  ) {
    const { whole, populations } = scene.manifest;
    if (populations && uses.rules !== false) this.standIns = new StandIns(scene, populations);
    if (whole) this.take(whole);
  }

  /** Whether what stands for objects is read where it takes fewer bytes. */
  get grows(): boolean {
    return this.standIns !== undefined;
  }

  /** Takes in objects with all of their models. */
  take({ objects, models }: Whole): void {
    this.learn(models);
    for (const entry of objects) {
      if (!this.objects.has(entry.object)) this.entries.set(entry.object, entry);
      this.placed(entry.object);
    }
  }

  /** Objects whose entries and models have been read so far. */
  known(object: number): PlacedObject | undefined {
    return this.objects.get(object);
  }

  /** An object, or what stands for it, as far as either is known. */
  beheld(id: number): PlacedObject | undefined {
    return this.placed(id) ?? this.standIns?.known(id);
  }

  /** What is known of the objects below some entries of the index, or of what stands for them. */
  knownBelow(entries: readonly PageEntry[]): PlacedObject[] {
    const ids = new Set([...this.objects.keys(), ...this.entries.keys(), ...(this.standIns?.ids ?? [])]);
    return [...ids].filter((id) => entryOf({ entries }, id)).flatMap((id) => this.beheld(id) ?? []);
  }

  /** All objects of a small world, or `undefined` for a world with cells. */
  whole(): PlacedObject[] | undefined {
    return this.scene.manifest.whole && [...this.objects.values()];
  }

  /** Why some objects had to wait for their entries. */
  get notes(): readonly string[] {
    return this.standIns?.notes ?? [];
  }

  /** Forgets failures, so that they are tried again. */
  forgive(retried: Retried): void {
    this.standIns?.forgive(retried);
  }

  /** The objects with these ids, in the order in which they were asked for, which is that in which they come. */
  async resolve(ids: readonly number[], priority: number): Promise<PlacedObject[]> {
    const missing = ids.filter((id) => !this.placed(id));
    const priorityOf = inOrder(missing, priority);
    await this.read(await this.holders(missing, priorityOf), priorityOf);
    return ids.map((id) => this.placed(id) ?? this.lacks(id));
  }

  /**
   * The same as soon as can be: what stands for an object will do. `came` is told what there is while only some of them can
   * be drawn.
   */
  async behold(
    ids: readonly number[],
    urgency: Urgency = AT_ONCE,
    came: (some: PlacedObject[]) => void = () => {},
  ): Promise<PlacedObject[]> {
    const missing = ids.filter((id) => !this.beheld(id));
    const beforeAll = inOrder(missing, urgency.documents);
    const holders = await this.holders(missing, beforeAll);
    const telling = new Pacer(() => came(ids.flatMap((id) => this.beheld(id) ?? [])), TOLD_EVERY_MS);
    const tell = () => telling.ask();
    // What more important objects grow from is as urgent.
    const amongModels = inOrder(ids, urgency.models);
    try {
      await this.standIns?.read(holders, amongModels, tell);
      const bare = missing.filter((id) => !this.beheld(id));
      if (bare.length === missing.length) await this.read(holders, beforeAll);
      else await this.read(await this.holders(bare, amongModels), amongModels, tell);
    } finally {
      telling.close();
    }
    return ids.map((id) => this.beheld(id) ?? this.lacks(id));
  }

  /** Every object of the scene, however large it is. */
  async everything(priority: number): Promise<PlacedObject[]> {
    const ids = this.scene.manifest.objects.entries.flatMap(({ first, count }) =>
      Array.from({ length: count }, (_, i) => first + i),
    );
    return this.resolve(ids, priority);
  }

  /** Reads the chunks of some objects and of their models; they travel side by side. `came` is called when more objects are placed. */
  private async read(holders: readonly Holder[], priorityOf: PriorityOf, came: () => void = () => {}): Promise<void> {
    await Promise.all(
      holders.map(async ({ chunk, ids: [first = 0, ...others] }) => {
        const priority = priorityOf(first);
        for (const entry of await this.scene.objectChunk(chunk, priority)) {
          if (!this.objects.has(entry.object)) this.entries.set(entry.object, entry);
        }
        await this.readModels([first, ...others], priority);
        came();
      }),
    );
  }

  private async readModels(objects: readonly number[], priority: number): Promise<void> {
    const used = new Set(objects.flatMap((id) => this.entries.get(id)?.model ?? []));
    const unknown = [...used].filter((id) => !this.models.has(id));
    const holders = await holdersOf(this.scene.manifest.models, unknown, (entry) => this.scene.page(entry, priority));
    await Promise.all(
      holders.map(async ({ chunk }) => {
        this.learn(await this.scene.modelChunk(chunk, priority));
      }),
    );
  }

  private holders(objects: readonly number[], priorityOf: PriorityOf): Promise<Holder[]> {
    const page = (entry: PageEntry, first: number): Promise<Page> => this.scene.page(entry, priorityOf(first));
    return holdersOf(this.scene.manifest.objects, objects, page);
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

/** What comes first is the most urgent. */
function inOrder(ids: readonly number[], priority: number): PriorityOf {
  let ranks: ReadonlyMap<number, number> | undefined;
  return (id) => {
    ranks ??= new Map(ids.map((each, rank) => [each, rank]));
    return priority + (ranks.get(id) ?? 0);
  };
}
