/**
 * What is on its way? Has the files of a grade fetched and made into something to draw (`modelfiles.ts`), hands it to the
 * renderer and books what that holds. Loads that drop out of the plan are cancelled; a texture that several of them share travels
 * once and is cancelled only with the last of them.
 */
import type { FileRef } from "../documents/documents.ts";
import type { Impostor } from "../documents/impostordocument.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import type { FetchQueue } from "../fetch/fetchqueue.ts";
import { passes, type Retried } from "../fetch/losses.ts";
import { FetchError } from "../fetch/transfer.ts";
import type { Tree } from "../fetch/tree.ts";
import type { FrameBudget } from "../pace/framebudget.ts";
import type { CostOf } from "../strategy/file.ts";
import { type Holding, isFailed, levelOf, nameOf, needsSmooth } from "../strategy/grade.ts";
import { packsWorth } from "../strategy/packs.ts";
import { NO_PICTURES, type Pictures } from "../strategy/pictures.ts";
import type { Stock } from "../strategy/plan.ts";
import { reasonFor, reasonForPack, type Want } from "../strategy/priority.ts";
import type { Part, ResidencySet } from "../strategy/residency.ts";
import { FailedGrades } from "./failedgrades.ts";
import type { Growing } from "./growing.ts";
import { type Coming, type Load, ModelFiles } from "./modelfiles.ts";
import { ModelMemory } from "./modelmemory.ts";
import type { SmoothLods } from "./smoothlods.ts";

/** What is decoded and not drawn yet; it is either drawn or released. */
export interface Decoded<As extends readonly unknown[] = []> {
  /** What it takes alone. */
  readonly bytes: number;
  /** What each of its pictures takes, where others may be drawn with them, too. */
  readonly pictures?: Pictures;
  /** Fulfilled when it can be drawn without waiting; at once where it is left out. */
  readonly ready?: Promise<void>;
  /** Draws all shown objects of its model with it instead of what was before, in one step. */
  draw(...as: As): void;
  /** Frees it. */
  release(): void;
}

/** What draws: decodes levels and shows objects that use them. Knows nothing of cells or downloads. */
export interface ModelHost {
  /** Decodes a GLB of a model. When it is drawn as a base it is kept while a detail is; a new base takes the place of both. */
  decode(model: number, glb: ArrayBuffer, textures: ReadonlyMap<string, ArrayBuffer>): Promise<Decoded<[part: Part]>>;
  /** Whether a texture must be fetched: one that can be drawn and is not decoded already. */
  needsTexture(url: string): boolean;
  /** Decodes the pictures of an impostor, which are kept beside what its model is drawn with. */
  decodeImpostor(model: number, impostor: Impostor, pictures: ReadonlyMap<string, ArrayBuffer>): Promise<Decoded>;
  /** Draws a model by its base again. */
  blunt(model: number): void;
  evict(model: number): void;
  /** Draws these of the shown objects by their impostors, and the others not. */
  drawFar(objects: ReadonlySet<number>): void;
  /** Draws these objects and no others, each as soon as its model is there. */
  show(objects: readonly PlacedObject[]): void;
  /** Whether an object is in the picture, however coarse, or waits for its turn to be. */
  draws(object: number): boolean;
  /** How many objects wait for their turn. */
  readonly waiting?: number;
}

export interface ModelLoadsParts {
  readonly queue: FetchQueue;
  readonly tree: Tree;
  readonly host: ModelHost;
  readonly residency: ResidencySet;
  readonly budget: FrameBudget;
  readonly smooth: SmoothLods;
  readonly growing: Growing;
  /** Called after each change of what is held or failed; says whether something went. */
  readonly changed: (hasGone: boolean) => void;
  /** Told of levels and textures that could not be loaded. Where a smooth LOD cannot, or rules are wrong, levels stand in. */
  readonly problem: (error: unknown) => void;
}

/** What one can ask of models. */
export interface ModelNotes extends Stock {
  /** Why a model is drawn by levels although it has a smooth LOD or could be grown. */
  noteOf(model: number): string | undefined;
  /** All of these reasons. */
  readonly notes: readonly string[];
}

export class ModelLoads implements ModelNotes {
  private readonly loads = new Map<number, Load>();
  private readonly failed = new FailedGrades();
  private readonly files: ModelFiles;
  private readonly memory: ModelMemory;
  private closed = false;

  constructor(private readonly parts: ModelLoadsParts) {
    this.files = new ModelFiles(parts);
    this.memory = new ModelMemory(parts);
  }

  /** Whether something visible of which nothing is held had to be left out for want of memory. */
  get short(): boolean {
    return this.memory.short;
  }

  get pending(): number {
    return this.loads.size;
  }

  /** Whether something of a model is on its way. */
  isComing(model: number): boolean {
    return this.loads.has(model);
  }

  /** How much of one of its files has come for a model of which something is on its way. */
  came_bytes(model: number, file: Coming): number {
    const load = this.loads.get(model);
    return load ? this.files.came_bytes(load, file) : 0;
  }

  of(model: number): Holding {
    const held = this.parts.residency.held(model)?.grade;
    const plain = held && this.memory.plain.of(model, held);
    return {
      held,
      taken: this.parts.smooth.taken(model),
      failed: this.failed.of(model),
      hasImpostor: this.memory.hasPictures(model),
      isPlain: plain?.lacks.some((url) => !this.files.isLost(url)) ?? false,
    };
  }

  readonly costOf: CostOf = (file) => (this.files.isHere(file.url) ? 0 : this.parts.queue.cost_bytes(file));

  noteOf(model: number): string | undefined {
    return this.failed.reasonFor(model);
  }

  get notes(): readonly string[] {
    return this.failed.allReasons;
  }

  /** Forgets failures, so that they are tried again. */
  forgive(retried: Retried): void {
    this.failed.forgive(retried);
    this.files.forgive(retried);
  }

  /** Cancels everything; nothing that is still under way reaches the renderer. */
  close(): void {
    this.closed = true;
    this.cancel([...this.loads.values()]);
    this.parts.smooth.end();
    this.parts.growing.end();
  }

  /** Makes what is under way equal to the plan. */
  follow(wants: readonly Want[]): void {
    const wanted = new Map(wants.map((want) => [want.object.model.model, want]));
    const isUseless = (load: Load) => {
      const want = wanted.get(load.model.model);
      // What is on its way to something finer is worth finishing; what nobody needs any more is not.
      const useful = want !== undefined && want.grade.geometricError <= load.grade.geometricError;
      return !useful && load.state === "fetching";
    };
    this.cancel([...this.loads.values()].filter(isUseless));
    // What several loads share is as urgent as the most urgent of them, which comes first.
    for (const want of [...wants].reverse()) {
      const load = this.loads.get(want.object.model.model);
      if (!load) continue;
      load.priority = want.priority;
      for (const url of load.urls) this.parts.queue.reprioritise(url, want.priority);
    }
    const starting = this.memory.affordable(wants.filter((want) => !this.loads.has(want.object.model.model)));
    const worth = packsWorth(
      starting.flatMap(({ object, grade }) => levelOf(object.model, grade) ?? []),
      (pack) => (this.isOnItsWay(pack) ? 0 : this.costOf(pack)),
    );
    for (const want of starting) void this.start(want, worth);
  }

  /** Whether a pack comes anyway. */
  private isOnItsWay({ url }: FileRef): boolean {
    return this.parts.queue.isComing(this.parts.tree.resolve(url));
  }

  private cancel(loads: readonly Load[]): void {
    if (loads.length === 0) return;
    for (const load of loads) {
      load.state = "cancelled";
      const { model } = load.model;
      this.parts.residency.withdraw(model);
      if (this.loads.get(model) === load) this.loads.delete(model);
    }
    const shared = new Set([...this.loads.values()].flatMap((other) => [...other.urls]));
    for (const { urls } of loads) for (const url of urls) if (!shared.has(url)) this.parts.queue.cancel(url);
  }

  private async start(want: Want, packs: ReadonlyMap<string, number>): Promise<void> {
    const { model } = want.object;
    if (this.closed) return;
    const load: Load = {
      model,
      grade: want.grade,
      priority: want.priority,
      urls: new Set(),
      here: new Set(),
      reason: reasonFor(want),
      packReason: reasonForPack(want, packs.get(levelOf(model, want.grade)?.pack?.url ?? "") ?? 0),
      plain: want.cause.kind === "plain" ? this.memory.plain.of(model.model, want.grade) : undefined,
      isNeeded: needsSmooth(model, this.of(model.model)),
      state: "fetching",
    };
    this.loads.set(model.model, load);
    try {
      await (load.grade.kind === "impostor" ? this.bringImpostor(load) : this.bring(load, packs));
    } catch (error) {
      if (load.state === "cancelled" || (error instanceof FetchError && error.isCancelled)) return;
      this.fail(load, error);
    } finally {
      if (this.loads.get(model.model) === load) {
        this.loads.delete(model.model);
        this.parts.residency.withdraw(model.model);
      }
    }
    if (!this.closed) this.parts.changed(this.memory.takeReleased());
  }

  private fail({ model: { model, smooth }, grade }: Load, error: unknown): void {
    this.failed.add(model, grade, error);
    // That is no loss: levels are the better buy.
    if (error instanceof FetchError && error.kind === "forgone") return;
    if (grade.kind !== "rung" && grade.kind !== "grown") {
      this.parts.problem(error);
      return;
    }
    this.failed.explain(model, error);
    if (grade.kind === "grown" || passes(error)) return;
    this.parts.smooth.close(model);
    // Any of them may be the damaged one.
    for (const { url } of smooth ? [smooth, ...smooth.rungs] : []) this.parts.queue.forget(url);
  }

  private async bring(load: Load, packs: ReadonlyMap<string, number>): Promise<void> {
    const { host, residency, smooth } = this.parts;
    const { model, grade, plain } = load;
    const textures = new Map<string, ArrayBuffer>();
    const kept = plain && { glb: plain.glb, state_bytes: this.memory.stream_bytes(model.model) };
    const [make] = await Promise.all([
      kept ? async () => kept : this.files.fetchGrade(load, packs),
      this.files.fetchTextures(load, textures),
    ]);
    // Once rungs are decoded the load is not cancelled any more, and another one may have taken its place.
    if (load.state === "cancelled") return;
    // What is drawn plain is drawn anew when it is less so.
    if (plain && this.files.lostOf(load).length >= plain.lacks.length) return;
    const { glb, state_bytes } = await make();
    const isWhole = () => this.files.missingTextures(load, textures).length === 0;
    const complete = () => this.files.fetchTextures(load, textures);
    let lacks: string[] = [];
    const decode = async () => {
      const decoded = await host.decode(model.model, glb, textures);
      // Now: a texture may be tried again before it is drawn without.
      lacks = this.files.lostOf(load);
      return decoded;
    };
    const whole = await this.decodeWhole(load, isWhole, complete, decode);
    await this.drawReady(load, whole, (decoded) => {
      // What was held when it was decoded may have gone since.
      const base = residency.base(model.model)?.grade;
      const isSame = base !== undefined && nameOf(base) === nameOf(grade);
      const isSound = base !== undefined && !isSame && !isFailed(this.of(model.model), base);
      const part = residency.partFor(model.model, grade, isSound);
      decoded.draw(part);
      const { bytes, pictures = NO_PICTURES } = decoded;
      if (grade.kind !== "rung") smooth.close(model.model);
      this.memory.holdMesh(model, part, { grade, bytes, pictures }, state_bytes, { glb, lacks });
    });
  }

  /** The pictures of an impostor, which stay beside a mesh that is held or comes later. */
  private async bringImpostor(load: Load): Promise<void> {
    const { host } = this.parts;
    const { model, grade } = load;
    const { impostor } = model;
    if (!impostor) throw new Error(`m${model.model} has no impostor`);
    const pictures = new Map<string, ArrayBuffer>();
    const missing = () =>
      [impostor.colour, impostor.shape].filter(({ url }) => !pictures.has(url) && host.needsTexture(url));
    const fetch = async (file: FileRef) => pictures.set(file.url, await this.files.fetch(load, file));
    const complete = () => Promise.all(missing().map(fetch));
    await complete();
    const isWhole = () => missing().length === 0;
    const decode = () => host.decodeImpostor(model.model, impostor, pictures);
    const whole = await this.decodeWhole(load, isWhole, complete, decode);
    await this.drawReady(load, whole, (decoded) => {
      decoded.draw();
      const { bytes, pictures = NO_PICTURES } = decoded;
      this.memory.holdPictures(model, { grade, bytes, pictures });
    });
  }

  /**
   * Decodes when a frame has time for it and all textures are here, unless it is cancelled: one that was held a moment ago may have gone
   * with the last model that used it. Nothing is fetched in the time of a frame, since to begin that takes such time too.
   */
  private async decodeWhole<D>(
    load: Load,
    isWhole: () => boolean,
    complete: () => Promise<unknown>,
    decode: () => Promise<D>,
  ): Promise<D | undefined> {
    const tryOnce = async () => {
      if (load.state === "cancelled") return { decoded: undefined };
      if (!isWhole()) return undefined;
      load.state = "uploading";
      return { decoded: await decode() };
    };
    for (;;) {
      const tried = await this.parts.budget.run(tryOnce);
      if (tried) return tried.decoded;
      await complete();
    }
  }

  /**
   * Draws when the graphics card is ready for it, unless it is cancelled. Nobody else waits meanwhile, and what is ready goes before what
   * is still to be decoded: else nothing of a room would come into the picture before all of it is decoded.
   */
  private async drawReady<D extends Pick<Decoded, "ready" | "release">>(
    load: Load,
    decoded: D | undefined,
    draw: (decoded: D) => void,
  ): Promise<void> {
    if (!decoded) return;
    let isDrawn = false;
    try {
      await decoded.ready;
      await this.parts.budget.run(() => {
        if (load.state === "cancelled") return;
        isDrawn = true;
        draw(decoded);
      }, "urgent");
    } finally {
      if (!isDrawn) decoded.release();
    }
  }
}
