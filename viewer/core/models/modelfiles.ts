/**
 * How do the files of a grade become something to draw? Fetches a level, the next rungs of a smooth LOD, or rules, with the
 * textures that nobody holds yet, and answers a GLB.
 */
import type { FileRef } from "../documents/documents.ts";
import type { Level, Model, PackRef, Smooth } from "../documents/modeldocument.ts";
import type { Within } from "../fetch/download.ts";
import type { FetchQueue } from "../fetch/fetchqueue.ts";
import { forgive, type Loss, passes, type Retried } from "../fetch/losses.ts";
import type { Tree } from "../fetch/tree.ts";
import { type Grade, levelOf, nameOf, type Slice, slicesOf, texturesOf } from "../strategy/grade.ts";
import type { Growing } from "./growing.ts";
import { GrowthQueue } from "./growthqueue.ts";
import type { Plain } from "./plainmodels.ts";
import type { SmoothLods } from "./smoothlods.ts";
import type { Refined } from "./smoothstream.ts";

/** A grade that is on its way. */
export interface Load {
  readonly model: Model;
  readonly grade: Grade;
  /** As it is wanted now; lower is more urgent. */
  priority: number;
  readonly urls: Set<string>;
  /** Files of it that have come. */
  readonly here: Set<string>;
  readonly reason: string;
  /** Of the pack that brings it. */
  readonly packReason: string;
  /** What is drawn of it already, where only textures are fetched. */
  readonly plain: Plain | undefined;
  /** Whether nothing else can be drawn of its model. */
  readonly isNeeded: boolean;
  state: "cancelled" | "fetching" | "uploading";
}

/** A file that may also come in a pack. */
export type Coming = FileRef & { readonly pack?: PackRef | undefined };

/** Makes something to draw of what was fetched. */
export type Make = () => Promise<Refined>;

export interface ModelFilesParts {
  readonly queue: FetchQueue;
  readonly tree: Tree;
  readonly host: { needsTexture(url: string): boolean };
  readonly smooth: SmoothLods;
  readonly growing: Growing;
  /** Told of textures that could not be loaded. */
  readonly problem: (error: unknown) => void;
}

export class ModelFiles {
  /** Rules, and glTF documents with nothing but materials; small, and shared by many models. */
  private readonly texts = new Map<string, string>();
  private readonly lostTextures = new Map<string, Loss>();
  /** Textures that failed once for a reason that passes. */
  private readonly lateTextures = new Map<string, unknown>();
  private readonly growths: GrowthQueue;

  constructor(private readonly parts: ModelFilesParts) {
    this.growths = new GrowthQueue(parts.growing);
  }

  /** Whether a file need not be fetched any more, or cannot be. */
  isHere(url: string): boolean {
    return this.texts.has(url) || this.lostTextures.has(url) || !this.parts.host.needsTexture(url);
  }

  /** Whether a texture could not be had. */
  isLost(url: string): boolean {
    return this.lostTextures.has(url);
  }

  /** Forgets which textures could not be had. */
  forgive(retried: Retried): void {
    forgive(this.lostTextures, retried);
  }

  fetchGrade(load: Load, packs: ReadonlyMap<string, number>): Promise<Make> {
    if (load.grade.kind === "rung") return this.fetchRungs(load);
    return load.grade.kind === "grown" ? this.fetchRules(load) : this.fetchLevel(load, packs);
  }

  private async fetchLevel(load: Load, packs: ReadonlyMap<string, number>): Promise<Make> {
    const level = levelOf(load.model, load.grade);
    if (!level) throw new Error(`m${load.model.model} has no ${nameOf(load.grade)}`);
    const glb = await this.fetchGlb(load, level, packs);
    return async () => ({ glb, state_bytes: 0 });
  }

  /** The rungs after those that have come. From when they are decoded on, the load is not cancelled. */
  private async fetchRungs(load: Load): Promise<Make> {
    const { model, grade } = load;
    const { smooth } = model;
    if (!smooth) throw new Error(`m${model.model} has no smooth LOD`);
    const next = slicesOf(smooth, grade.number, this.parts.smooth.taken(model.model));
    const [materials, ...rungs] = await Promise.all([
      this.fetchText(load, smooth.materials),
      ...next.map((slice) => this.fetch(load, slice, this.within(load, smooth, slice))),
    ]);
    return () => {
      load.state = "uploading";
      return this.parts.smooth.refine(model.model, smooth, grade.number, rungs, materials);
    };
  }

  /** Where a rung stands in its stream; that itself stands nowhere else. */
  private within({ isNeeded }: Load, smooth: Smooth, { url, from, bytes }: Slice): Within | undefined {
    if (url === smooth.url) return undefined;
    return { url: this.parts.tree.resolve(smooth.url), from, to: from + bytes, of_bytes: smooth.bytes, isNeeded };
  }

  /** From when it grows on, the load is not cancelled, so that nothing grows twice. */
  private async fetchRules(load: Load): Promise<Make> {
    const { rules } = load.model;
    if (!rules) throw new Error(`m${load.model.model} has no rules`);
    const { part, parameters, seed, triangles } = rules;
    const imports = [...rules.imports].map(async ([name, file]) => [name, await this.fetchText(load, file)] as const);
    const [text, texts] = await Promise.all([this.fetchText(load, rules.file), Promise.all(imports)]);
    const seedling = { rules: text, imports: new Map(texts), part, parameters, seed, triangles };
    const begin = () => {
      if (load.state === "cancelled") return false;
      load.state = "uploading";
      return true;
    };
    return async () => {
      const glb = await this.growths.grow(seedling, { load, begin });
      if (!glb) throw new Error(`m${load.model.model} is not wanted any more`);
      return { glb, state_bytes: 0 };
    };
  }

  private async fetchText(load: Load, file: FileRef): Promise<string> {
    const known = this.texts.get(file.url);
    if (known !== undefined) return known;
    const text = new TextDecoder().decode(await this.fetch(load, file));
    this.texts.set(file.url, text);
    return text;
  }

  /** A level's GLB, out of its pack where that is worth it, or where it is lost alone. One that cannot be had so, or not soon, is fetched alone. */
  private async fetchGlb(load: Load, level: Level, packs: ReadonlyMap<string, number>): Promise<ArrayBuffer> {
    const { pack } = level;
    if (pack && packs.has(pack.url) && this.parts.queue.cost_bytes(level) > 0) {
      let alone: Promise<ArrayBuffer> | undefined;
      try {
        const outOf = this.fetchOutOf(load, level, pack);
        const silent = this.parts.queue.untilQuiet(this.parts.tree.resolve(pack.url));
        const come = await Promise.race([outOf, silent]);
        // What a silent pack holds is asked for alone, too, and comes as it comes first.
        if (come) return come;
        alone = this.fetch(load, level);
        return await Promise.any([outOf, alone]);
      } catch (error) {
        // It has been had neither way: why not alone is what to tell.
        if (alone) return await alone;
        if (load.state === "cancelled") throw error;
      }
    }
    try {
      return await this.fetch(load, level);
    } catch (error) {
      // What fails for a reason that passes comes by itself.
      if (!pack || load.state === "cancelled" || passes(error)) throw error;
      return await this.fetchOutOf(load, level, pack).catch(() => Promise.reject(error));
    }
  }

  /**
   * Adds textures that the renderer does not hold. One that cannot be fetched stays out, and is tried again later: plain beats a hole. But
   * when that is for a reason that passes, the load fails the first time and is tried again as a whole, so that little is drawn twice.
   */
  async fetchTextures(load: Load, textures: Map<string, ArrayBuffer>): Promise<void> {
    const { problem } = this.parts;
    await Promise.all(
      this.missingTextures(load, textures).map(async (file) => {
        try {
          textures.set(file.url, await this.fetch(load, file));
          this.lateTextures.delete(file.url);
        } catch (error) {
          if (load.state === "cancelled") throw error;
          // All who waited for the same download hear of the same error.
          const isFirst = !this.lateTextures.has(file.url) || this.lateTextures.get(file.url) === error;
          if (passes(error) && isFirst && !load.plain) {
            this.lateTextures.set(file.url, error);
            throw error;
          }
          this.lostTextures.set(file.url, { error });
          problem(error);
        }
      }),
    );
  }

  /** Textures that neither are here nor are known to be lost. */
  missingTextures(load: Load, textures: ReadonlyMap<string, ArrayBuffer>): FileRef[] {
    return texturesOf(load.model, load.grade).filter(
      ({ url }) => !textures.has(url) && !this.lostTextures.has(url) && this.parts.host.needsTexture(url),
    );
  }

  /** Textures that it would be drawn without. */
  lostOf({ model, grade }: Load): string[] {
    const lost = texturesOf(model, grade).filter(({ url }) => this.isLost(url) && this.parts.host.needsTexture(url));
    return lost.map(({ url }) => url);
  }

  async fetch(load: Load, { url, bytes }: FileRef, within?: Within): Promise<ArrayBuffer> {
    const address = this.parts.tree.resolve(url);
    load.urls.add(address);
    const come = await this.parts.queue.request(address, load.priority, { reason: load.reason, bytes, within });
    load.here.add(url);
    return come;
  }

  /** A level as soon as it has come in its pack. */
  private async fetchOutOf(load: Load, { url, bytes }: Level, pack: PackRef): Promise<ArrayBuffer> {
    const { queue, tree } = this.parts;
    const address = tree.resolve(pack.url);
    load.urls.add(address);
    const part = { url: tree.resolve(url), bytes, from: pack.from };
    const isWanted = () => load.state !== "cancelled" && !load.here.has(url);
    const asked = { reason: load.packReason, bytes: pack.bytes, isWanted };
    const come = await queue.slice(part, address, load.priority, asked);
    load.here.add(url);
    return come;
  }

  /** How much has come of a file that a load is for, alone or in a pack. */
  came_bytes(load: Load, { url, bytes, pack }: Coming): number {
    if (load.here.has(url)) return bytes;
    const cameOf = (published: string) => {
      const address = this.parts.tree.resolve(published);
      return load.urls.has(address) ? this.parts.queue.came_bytes(address) : 0;
    };
    const came = Math.max(cameOf(url), pack ? cameOf(pack.url) - pack.from : 0);
    return Math.max(0, Math.min(bytes, came));
  }
}
