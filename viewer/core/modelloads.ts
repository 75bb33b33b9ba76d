/**
 * Which levels are on their way? Fetches a level's GLB and the textures that nobody holds yet, hands them to the
 * renderer and books what it holds. Loads that drop out of the plan are cancelled; a texture that several levels share
 * travels once and is cancelled only with the last of them.
 */
import type { Level } from "./documents.ts";
import { FetchError, type FetchQueue } from "./fetchqueue.ts";
import { Footprint } from "./footprint.ts";
import type { FrameBudget } from "./framebudget.ts";
import type { PlacedObject } from "./objects.ts";
import { outOf, packsWorth } from "./packs.ts";
import { purposeOf } from "./priority.ts";
import type { ResidencySet } from "./residency.ts";
import type { ModelState, Want } from "./scheduler.ts";
import type { Tree } from "./tree.ts";

/** What draws: takes decoded levels and shows objects that use them. Knows nothing of cells or downloads. */
export interface ModelHost {
  /** Decodes a level and draws all shown objects of its model with it instead of the level before; answers its bytes. */
  upload(model: number, glb: ArrayBuffer, textures: ReadonlyMap<string, ArrayBuffer>): Promise<number>;
  /** Whether a texture must be fetched: one that can be drawn and is not decoded already. */
  needsTexture(url: string): boolean;
  evict(model: number): void;
  /** Draws these objects and no others, each as soon as its model is there. */
  show(objects: readonly PlacedObject[]): void;
  /** Whether an object is in the picture with any level. */
  draws(object: number): boolean;
}

interface Load {
  readonly model: number;
  readonly level: number;
  readonly urls: Set<string>;
  readonly reason: string;
  state: "cancelled" | "fetching" | "uploading";
}

export interface ModelLoadsParts {
  readonly queue: FetchQueue;
  readonly tree: Tree;
  readonly host: ModelHost;
  readonly residency: ResidencySet;
  readonly budget: FrameBudget;
  /** Called after each change of what is held or failed. */
  readonly changed: () => void;
  /** Told of levels that could not be loaded. */
  readonly problem: (error: unknown) => void;
}

const NONE: ReadonlySet<number> = new Set();
/** What refines or comes early leaves this share of the memory free, for what the next cells cannot do without. */
const SPARE = 0.25;
/** After so many wants without memory, what is less urgent waits. */
const REFUSALS = 4;

export class ModelLoads {
  private readonly loads = new Map<number, Load>();
  private readonly failed = new Map<number, Set<number>>();
  private readonly lostTextures = new Set<string>();
  private readonly footprint = new Footprint();
  private closed = false;
  private shortOfMemory = false;

  constructor(private readonly parts: ModelLoadsParts) {}

  /** Whether something visible of which nothing is held had to be left out for want of memory. */
  get short(): boolean {
    return this.shortOfMemory;
  }

  get pending(): number {
    return this.loads.size;
  }

  stateOf(model: number): ModelState {
    return { heldLevel: this.parts.residency.held(model)?.level, failed: this.failed.get(model) ?? NONE };
  }

  /** Forgets failures, so that they are tried again. */
  forgive(): void {
    this.failed.clear();
    this.lostTextures.clear();
  }

  /** Cancels everything; nothing that is still under way reaches the renderer. */
  close(): void {
    this.closed = true;
    for (const load of [...this.loads.values()]) this.cancel(load);
  }

  /** Makes what is under way equal to the plan. */
  follow(wants: readonly Want[]): void {
    const wanted = new Map(wants.map((want) => [want.object.model.model, want]));
    for (const load of [...this.loads.values()]) {
      const want = wanted.get(load.model);
      // A level on its way to a finer one is worth finishing; one that nobody needs any more is not.
      const useful = want !== undefined && want.level <= load.level;
      if (!useful && load.state === "fetching") this.cancel(load);
    }
    // What several loads share is as urgent as the most urgent of them, which comes first.
    for (const want of [...wants].reverse()) {
      const urls = this.loads.get(want.object.model.model)?.urls ?? [];
      for (const url of urls) this.parts.queue.reprioritise(url, want.priority);
    }
    const starting = this.affordable(wants.filter((want) => !this.loads.has(want.object.model.model)));
    const worth = packsWorth(starting.flatMap(({ object, level }) => object.model.levels[level] ?? []));
    for (const want of starting) void this.start(want, worth);
  }

  /** Promises memory to what will be fetched, the most urgent first; leaves out what there is none for. */
  private affordable(wants: readonly Want[]): Want[] {
    this.shortOfMemory = false;
    let refused = 0;
    return wants.filter((want) => {
      const level = want.object.model.levels[want.level];
      if (!level || refused >= REFUSALS) return false;
      const { residency, host } = this.parts;
      const first = purposeOf(want.priority) === "coarsest";
      const terms = first
        ? { spare_bytes: 0, within_steps: -1 }
        : { spare_bytes: SPARE * residency.limit_bytes, within_steps: 1 };
      const going = residency.promise(want.object.model.model, this.footprint.estimate_bytes(level), terms);
      for (const model of going ?? []) host.evict(model);
      if (going) return true;
      refused += 1;
      this.shortOfMemory ||= first;
      return false;
    });
  }

  private cancel(load: Load): void {
    load.state = "cancelled";
    this.parts.residency.withdraw(load.model);
    if (this.loads.get(load.model) === load) this.loads.delete(load.model);
    const shared = new Set([...this.loads.values()].flatMap((other) => [...other.urls]));
    for (const url of load.urls) if (!shared.has(url)) this.parts.queue.cancel(url);
  }

  private async start(want: Want, packs: ReadonlySet<string>): Promise<void> {
    const { model } = want.object;
    const level = model.levels[want.level];
    if (!level || this.closed) return;
    const load: Load = {
      model: model.model,
      level: want.level,
      urls: new Set(),
      reason: reasonFor(want),
      state: "fetching",
    };
    this.loads.set(model.model, load);
    try {
      await this.bring(load, level, want.priority, packs);
    } catch (error) {
      if (load.state === "cancelled" || (error instanceof FetchError && error.kind === "cancelled")) return;
      const levels = this.failed.get(model.model) ?? new Set();
      this.failed.set(model.model, levels.add(want.level));
      this.parts.problem(error);
    } finally {
      if (this.loads.get(model.model) === load) {
        this.loads.delete(model.model);
        this.parts.residency.withdraw(model.model);
      }
    }
    if (!this.closed) this.parts.changed();
  }

  private async bring(load: Load, level: Level, priority: number, packs: ReadonlySet<string>): Promise<void> {
    const { host, residency, budget } = this.parts;
    const textures = new Map<string, ArrayBuffer>();
    const [glb] = await Promise.all([
      this.fetchGlb(load, level, priority, packs),
      this.fetchTextures(load, level, priority, textures),
    ]);
    await budget.run(async () => {
      // A texture that was held a moment ago may have gone with the last model that used it.
      await this.fetchTextures(load, level, priority, textures);
      if (load.state === "cancelled") return;
      load.state = "uploading";
      const bytes = await host.upload(load.model, glb, textures);
      if (this.closed) return;
      this.footprint.learn(level, bytes);
      residency.hold(load.model, { level: load.level, bytes });
      for (const model of residency.evict()) host.evict(model);
    });
  }

  /** A level's GLB, out of its pack where that is worth it. One that cannot be had so is fetched alone. */
  private async fetchGlb(load: Load, level: Level, priority: number, packs: ReadonlySet<string>): Promise<ArrayBuffer> {
    const { pack } = level;
    if (pack && packs.has(pack.url)) {
      try {
        const glb = outOf(await this.fetch(load, pack.url, priority), pack, level);
        if (glb) return glb;
      } catch (error) {
        if (load.state === "cancelled") throw error;
      }
    }
    return this.fetch(load, level.url, priority);
  }

  /** Adds textures that the renderer does not hold. One that cannot be fetched stays out: plain beats a hole. */
  private async fetchTextures(
    load: Load,
    level: Level,
    priority: number,
    textures: Map<string, ArrayBuffer>,
  ): Promise<void> {
    const { host, problem } = this.parts;
    const missing = level.textures.filter(
      ({ url }) => !textures.has(url) && !this.lostTextures.has(url) && host.needsTexture(url),
    );
    await Promise.all(
      missing.map(async ({ url }) => {
        try {
          textures.set(url, await this.fetch(load, url, priority));
        } catch (error) {
          if (load.state === "cancelled") throw error;
          this.lostTextures.add(url);
          problem(error);
        }
      }),
    );
  }

  private fetch(load: Load, url: string, priority: number): Promise<ArrayBuffer> {
    const address = this.parts.tree.resolve(url);
    load.urls.add(address);
    return this.parts.queue.request(address, priority, { reason: load.reason });
  }
}

function reasonFor({ object, level, priority, error_px }: Want): string {
  const what = `m${object.model.model} level ${level}`;
  if (purposeOf(priority) === "prefetch") return `seen ahead: ${what}`;
  return error_px === undefined ? `not here yet: ${what}` : `${error_px.toFixed(1)} px off: ${what}`;
}
