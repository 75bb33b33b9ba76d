/**
 * What is known of an object before it has any geometry? Finds objects and their models by id through the page trees, a chunk of
 * neighbours at a time, and joins each with its model. Where that takes long, something stands in (`standins.ts`). A page or chunk
 * that cannot be had takes with it only what it alone tells of.
 */
import { reasonOf } from "../basics/reason.ts";
import type { ObjectEntry, Page, PageEntry, Whole } from "../documents/documents.ts";
import type { Model } from "../documents/modeldocument.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import { forgive, type Loss, passes, type Retried } from "../fetch/losses.ts";
import { Pacer } from "../pace/pacer.ts";
import { PRIORITY } from "../strategy/priority.ts";
import { byChunk, chunksBelow, type Holder, holdersOf } from "./pagetree.ts";
import type { PublishedScene } from "./published.ts";
import { type PriorityOf, StandIns } from "./standins.ts";

/** Objects that were asked for, as far as they can be had. */
export interface Found {
  /** In the order in which they were asked for. */
  readonly objects: readonly PlacedObject[];
  /** Why that is not all of them; one that passes where there is one. */
  readonly loss: Loss | undefined;
}

/** Part of the index of objects or models cannot be had, so that some of what can be seen is not shown. */
export class IncompleteIndexError extends Error {
  override readonly name = "IncompleteIndexError";
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
  /** Pages and chunks that cannot be had; each is asked for once, until one tries again. */
  private readonly lost = new Map<string, Loss>();

  /** `told` hears of the first thing that cannot be had. */
  constructor(
    private readonly scene: PublishedScene,
    private readonly uses: Uses = {},
    private readonly told: (error: unknown) => void = () => {},
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

  /** What is known of the objects below some entries of the index, of which none lies below another, or of what stands for them. */
  knownBelow(entries: readonly PageEntry[]): PlacedObject[] {
    const ids = new Set([...this.objects.keys(), ...this.entries.keys(), ...(this.standIns?.ids ?? [])]);
    return [...byChunk(entries, ids).values()].flat().flatMap((id) => this.beheld(id) ?? []);
  }

  /** All objects of a small world, or `undefined` for a world with cells. */
  whole(): PlacedObject[] | undefined {
    return this.scene.manifest.whole && [...this.objects.values()];
  }

  /** Why some objects are not shown, or had to wait for their entries. */
  get notes(): readonly string[] {
    return [...[...this.lost.values()].map(({ error }) => reasonOf(error)), ...(this.standIns?.notes ?? [])];
  }

  /** Forgets failures, so that they are tried again. */
  forgive(retried: Retried): void {
    forgive(this.lost, retried);
    this.standIns?.forgive(retried);
  }

  /** The objects with these ids, in the order in which they were asked for, which is that in which they come. */
  async resolve(ids: readonly number[], priority: number): Promise<Found> {
    const missing = ids.filter((id) => !this.placed(id));
    const priorityOf = inOrder(missing, priority);
    const losses: Loss[] = [];
    await this.read(await this.holders(missing, priorityOf, losses), priorityOf, losses);
    return found(ids, (id) => this.placed(id), losses);
  }

  /**
   * The same as soon as can be: what stands for an object will do. `came` is told what there is while only some of them can
   * be drawn: where others are grown, or something is silent.
   */
  async behold(
    ids: readonly number[],
    urgency: Urgency = AT_ONCE,
    came: (some: PlacedObject[]) => void = () => {},
  ): Promise<Found> {
    const missing = ids.filter((id) => !this.beheld(id));
    const beforeAll = inOrder(missing, urgency.documents);
    const losses: Loss[] = [];
    const holders = await this.holders(missing, beforeAll, losses);
    const telling = new Pacer(() => came(ids.flatMap((id) => this.beheld(id) ?? [])), TOLD_EVERY_MS);
    const tell = () => telling.ask();
    // What more important objects grow from is as urgent.
    const amongModels = inOrder(ids, urgency.models);
    try {
      await this.standIns?.read(holders, amongModels, tell);
      const bare = missing.filter((id) => !this.beheld(id));
      const tellLate = () => this.scene.queue.isSilent && tell();
      if (bare.length === missing.length) await this.read(holders, beforeAll, losses, tellLate);
      else await this.read(await this.holders(bare, amongModels, losses), amongModels, losses, tell);
    } finally {
      telling.close();
    }
    return found(ids, (id) => this.beheld(id), losses);
  }

  /** Every object of the scene, however large it is. */
  async everything(priority: number): Promise<Found> {
    const losses: Loss[] = [];
    const page = (entry: PageEntry) => this.unlessLost(entry, losses, () => this.scene.page(entry, priority));
    const chunks = await chunksBelow(this.scene.manifest.objects, page);
    const known = byChunk(chunks, new Set([...this.objects.keys(), ...this.entries.keys()]));
    const parts = await Promise.all(
      chunks.map((chunk) => {
        const placed = (known.get(chunk) ?? []).flatMap((id) => this.placed(id) ?? []);
        return this.complete(chunk, placed, priority);
      }),
    );
    losses.push(...parts.flatMap(({ loss }) => loss ?? []));
    return { objects: parts.flatMap(({ objects }) => objects), loss: theOneToTell(losses) };
  }

  /** The objects that a chunk of the index holds, however many it is said to hold. */
  async below(chunk: PageEntry, priority: number): Promise<Found> {
    return this.complete(chunk, this.knownOf(chunk), priority);
  }

  /** Those of a chunk that have been read. It is looked through what is less: what is known, or the ids that the chunk says that it holds. */
  private knownOf(chunk: PageEntry): PlacedObject[] {
    const { first, count } = chunk;
    const isShort = count <= this.objects.size + this.entries.size;
    const ids = isShort
      ? Array.from({ length: count }, (_, i) => first + i)
      : (byChunk([chunk], [...this.objects.keys(), ...this.entries.keys()]).get(chunk) ?? []);
    return ids.flatMap((id) => this.placed(id) ?? []);
  }

  /** The objects of a chunk of which these are known. */
  private async complete(chunk: PageEntry, known: readonly PlacedObject[], priority: number): Promise<Found> {
    if (known.length >= chunk.count) return { objects: known, loss: undefined };
    const losses: Loss[] = [];
    const ids = await this.readEntries(chunk, priority, losses);
    if (ids.length === 0) return { objects: known, loss: theOneToTell(losses) };
    await this.readModels(ids, priority, losses);
    return found(ids, (id) => this.placed(id), losses);
  }

  /** Reads the chunks of some objects and of their models; they travel side by side. `came` is called when more objects are placed. */
  private async read(
    holders: readonly Holder[],
    priorityOf: PriorityOf,
    losses: Loss[],
    came: () => void = () => {},
  ): Promise<void> {
    await Promise.all(
      holders.map(async ({ chunk, ids: [first = 0, ...others] }) => {
        const priority = priorityOf(first);
        await this.readEntries(chunk, priority, losses);
        await this.readModels([first, ...others], priority, losses);
        came();
      }),
    );
  }

  /** Reads a chunk; answers the objects that it tells of. */
  private async readEntries(chunk: PageEntry, priority: number, losses: Loss[]): Promise<number[]> {
    const entries = (await this.unlessLost(chunk, losses, () => this.scene.objectChunk(chunk, priority))) ?? [];
    for (const entry of entries) if (!this.objects.has(entry.object)) this.entries.set(entry.object, entry);
    return entries.map(({ object }) => object);
  }

  private async readModels(objects: readonly number[], priority: number, losses: Loss[]): Promise<void> {
    const used = new Set(objects.flatMap((id) => this.entries.get(id)?.model ?? []));
    const unknown = [...used].filter((id) => !this.models.has(id));
    const page = (entry: PageEntry) => this.unlessLost(entry, losses, () => this.scene.page(entry, priority));
    const holders = await holdersOf(this.scene.manifest.models, unknown, page);
    await Promise.all(
      holders.map(async ({ chunk }) => {
        const models = await this.unlessLost(chunk, losses, () => this.scene.modelChunk(chunk, priority));
        if (models) this.learn(models);
      }),
    );
  }

  private holders(objects: readonly number[], priorityOf: PriorityOf, losses: Loss[]): Promise<Holder[]> {
    const page = (entry: PageEntry, first: number): Promise<Page | undefined> =>
      this.unlessLost(entry, losses, () => this.scene.page(entry, priorityOf(first)));
    return holdersOf(this.scene.manifest.objects, objects, page);
  }

  /** What `read` brings of an entry of the index; where that cannot be had, why goes to `losses`. */
  private async unlessLost<T>({ url }: PageEntry, losses: Loss[], read: () => Promise<T>): Promise<T | undefined> {
    if (!this.lost.has(url)) {
      try {
        return await read();
      } catch (cause) {
        this.lose(url, cause);
      }
    }
    const loss = this.lost.get(url);
    if (loss) losses.push(loss);
    return undefined;
  }

  private lose(url: string, cause: unknown): void {
    // Several wait for the same document.
    if (this.lost.has(url)) return;
    const isFirst = this.lost.size === 0;
    const error = new IncompleteIndexError(`some objects cannot be shown: ${reasonOf(cause)}`, { cause });
    this.lost.set(url, { error });
    if (isFirst) this.told(error);
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
}

/** Those of some objects that are known, and why others are not: because something was lost, or the index is wrong. */
function found(
  ids: readonly number[],
  known: (id: number) => PlacedObject | undefined,
  losses: readonly Loss[],
): Found {
  const missing = ids.find((id) => !known(id));
  const wrong = () => ({ error: new Error(`the index does not hold o${missing} and its model`) });
  const loss = missing === undefined ? undefined : (theOneToTell(losses) ?? wrong());
  return { objects: ids.flatMap((id) => known(id) ?? []), loss };
}

/** One that passes, if any does: then the rest may come yet. */
function theOneToTell(losses: readonly Loss[]): Loss | undefined {
  return losses.find(({ error }) => passes(error)) ?? losses[0];
}

/** What comes first is the most urgent. */
function inOrder(ids: readonly number[], priority: number): PriorityOf {
  let ranks: ReadonlyMap<number, number> | undefined;
  return (id) => {
    ranks ??= new Map(ids.map((each, rank) => [each, rank]));
    return priority + (ranks.get(id) ?? 0);
  };
}
