/**
 * What stands for an object until its entry is here? What its population says: roughly where it is, and what it grows from, in
 * far fewer bytes (Schmalstieg, *The Remote Rendering Pipeline*, 1997, §8.4). Exact places, names, levels, smooth LODs and
 * impostors come with the entry, which then takes its place.
 *
 * The entries are fetched all the same, so a population is worth its bytes only where many of its members are wanted.
 */
import { reasonOf } from "../basics/reason.ts";
import type { Page, PageEntry } from "../documents/documents.ts";
import type { Model } from "../documents/modeldocument.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import type { Member } from "../documents/population.ts";
import { forgive, type Loss, type Retried } from "../fetch/losses.ts";
import { entryOf, type Holder, holdersOf } from "./pagetree.ts";
import type { PublishedScene } from "./published.ts";

/** A population is fetched where it costs at most this share of the chunks of objects for which one would wait. */
const WORTH = 0.5;

/** How urgent is what is fetched for the sake of an object? */
export type PriorityOf = (object: number) => number;

export class StandIns {
  private readonly objects = new Map<number, PlacedObject>();
  private readonly models = new Map<number, Model>();
  private readonly lost = new Map<string, Loss>();

  constructor(
    private readonly scene: PublishedScene,
    private readonly root: Page,
  ) {}

  /** For which objects something stands. */
  get ids(): Iterable<number> {
    return this.objects.keys();
  }

  known(object: number): PlacedObject | undefined {
    return this.objects.get(object);
  }

  /** Why objects had to wait for their entries. */
  get notes(): string[] {
    return [...this.lost.values()].map(({ error }) => `objects wait for their entries: ${reasonOf(error)}`);
  }

  /** Forgets failures, so that they are tried again. */
  forgive(retried: Retried): void {
    forgive(this.lost, retried);
  }

  /**
   * Reads what is worth it instead of waiting for the chunks of some objects. Never fails: without it one waits. `came` is
   * called after each population.
   */
  async read(waiting: readonly Holder[], priorityOf: PriorityOf, came: () => void): Promise<void> {
    const ids = waiting.flatMap((holder) => holder.ids);
    const page = (entry: PageEntry, first: number) => this.scene.page(entry, priorityOf(first));
    const populations = await holdersOf(this.root, ids, page).catch((error: unknown) => this.lose("the index", error));
    const worth = populations.filter(({ chunk }) => !this.lost.has(chunk.url) && this.pays(chunk, waiting));
    await Promise.all(
      worth.map(async ({ chunk, ids: [first = 0] }) => {
        const members = await this.scene
          .population(chunk, priorityOf(first))
          .catch((error: unknown) => this.lose(chunk.url, error));
        for (const member of members) this.objects.set(member.object, this.standIn(member));
        came();
      }),
    );
  }

  private pays(population: PageEntry, waiting: readonly Holder[]): boolean {
    const { queue } = this.scene;
    const chunks = waiting.filter(({ ids }) => ids.some((id) => entryOf({ entries: [population] }, id)));
    const wait_bytes = chunks.reduce((sum, { chunk }) => sum + queue.cost_bytes(chunk), 0);
    return queue.cost_bytes(population) <= WORTH * wait_bytes;
  }

  private lose(url: string, error: unknown): [] {
    this.lost.set(url, { error });
    return [];
  }

  private standIn({ object, recipe, worldFromObject, scale }: Member): PlacedObject {
    const { model, rules } = recipe;
    const known = this.models.get(model) ?? { model, levels: [], rules };
    this.models.set(model, known);
    const [x = 0, y = 0, z = 0] = worldFromObject.slice(12);
    // Nobody knows yet how far it reaches; it is drawn at its finest, so nothing depends on that.
    const bounds = { min: [x, y, z], max: [x, y, z] } as const;
    return { entry: { object, sourceNode: "", bounds, worldFromObject, scale, model }, model: known };
  }
}
