/**
 * What does an explorer do with a small published scene? One with a renderer that draws nothing and a web server in memory,
 * which both remember what they were asked.
 */
import type { Uses } from "../core/atlas/objects.ts";
import { PublishedScene } from "../core/atlas/published.ts";
import type { Vec3 } from "../core/basics/geometry.ts";
import type { Impostor } from "../core/documents/impostordocument.ts";
import type { PlacedObject } from "../core/documents/placedobject.ts";
import { Explorer } from "../core/explorer/explorer.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../core/fetch/fetchqueue.ts";
import { RequestLog } from "../core/fetch/requestlog.ts";
import type { Silence } from "../core/fetch/silences.ts";
import { Tree } from "../core/fetch/tree.ts";
import { webCryptoDigest } from "../core/fetch/verify.ts";
import type { Growing, Seedling } from "../core/models/growing.ts";
import { grownGlb } from "../core/models/grownglb.ts";
import type { Decoded, ModelHost } from "../core/models/modelloads.ts";
import { FrameBudget } from "../core/pace/framebudget.ts";
import { growModel } from "../core/procedural/index.ts";
import type { Shelf } from "../core/shelf/shelf.ts";
import { HEADER_BYTES } from "../core/strategy/file.ts";
import type { Part } from "../core/strategy/residency.ts";
import { type Files, type FixtureOptions, publish } from "./fixture.ts";
import { type ServerOptions, serveFiles } from "./serve.ts";

/** Draws nothing, and remembers what it was given. */
export class RecordingHost implements ModelHost {
  readonly uploads: { model: number; bytes: number; missing: number | undefined }[] = [];
  readonly evicted: number[] = [];
  readonly blunted: number[] = [];
  /** Models that are drawn finer than by what came first. */
  readonly details = new Set<number>();
  private shown = new Map<number, PlacedObject>();
  private readonly templates = new Set<number>();
  /** Textures and pictures that it was given. */
  readonly textures = new Set<string>();
  readonly pictured = new Set<number>();
  far: ReadonlySet<number> = new Set();
  missing: () => number | undefined = () => 0;

  async decode(
    model: number,
    glb: ArrayBuffer,
    textures: ReadonlyMap<string, ArrayBuffer>,
  ): Promise<Decoded<[part: Part]>> {
    for (const url of textures.keys()) this.textures.add(url);
    const draw = (part: Part) => {
      this.templates.add(model);
      if (part === "detail") this.details.add(model);
      else this.details.delete(model);
      this.uploads.push({ model, bytes: glb.byteLength, missing: this.missing() });
    };
    return { bytes: glb.byteLength, draw, release: () => {} };
  }
  needsTexture(url: string): boolean {
    return !this.textures.has(url);
  }
  blunt(model: number): void {
    this.details.delete(model);
    this.blunted.push(model);
  }
  evict(model: number): void {
    this.templates.delete(model);
    this.details.delete(model);
    this.pictured.delete(model);
    this.evicted.push(model);
  }
  async decodeImpostor(
    model: number,
    impostor: Impostor,
    pictures: ReadonlyMap<string, ArrayBuffer>,
  ): Promise<Decoded> {
    for (const url of pictures.keys()) this.textures.add(url);
    const draw = () => {
      this.pictured.add(model);
    };
    return { bytes: impostor.colour.bytes + impostor.shape.bytes, draw, release: () => {} };
  }
  drawFar(objects: ReadonlySet<number>): void {
    this.far = objects;
  }
  show(objects: readonly PlacedObject[]): void {
    this.shown = new Map(objects.map((object) => [object.entry.object, object]));
  }
  draws(object: number): boolean {
    const placed = this.shown.get(object);
    if (!placed) return false;
    return (this.far.has(object) ? this.pictured : this.templates).has(placed.model.model);
  }
}

/** Grows on this thread. */
export class HereGrowing implements Growing {
  async grow({ seed, ...recipe }: Seedling): Promise<ArrayBuffer> {
    return grownGlb(growModel(recipe, { seed }));
  }
  end(): void {}
}

export interface SetUp extends Partial<FixtureOptions>, ServerOptions {
  readonly memory_limit_bytes?: number;
  readonly most_triangles?: number;
  readonly spoil?: (files: Files) => void;
  readonly uses?: Uses;
  readonly growing?: Growing;
  readonly shelf?: Shelf;
  /** Hears of what is silent. */
  readonly silent?: (silence: Silence | undefined) => void;
  /** What a request costs; low, so that choices do not depend on how fast this machine is. */
  readonly request_bytes?: number;
}

/** An explorer of the published rooms. */
export async function explore({
  memory_limit_bytes = 1e9,
  most_triangles,
  spoil,
  uses = {},
  growing = new HereGrowing(),
  shelf,
  request_bytes = HEADER_BYTES,
  bundles = false,
  ranges = false,
  delay_ms = 0,
  answer = () => undefined,
  answerAfter_ms = () => 0,
  silent = () => {},
  ...options
}: SetUp = {}) {
  const starts = () => ({ receives: () => {}, ends: () => {} });
  const meter = { request_bytes, bytes_per_s: Number.POSITIVE_INFINITY, hasRoom: () => true, starts };
  const files = publish({ rooms: 6, ...options });
  spoil?.(files);
  const { fetch, requests } = serveFiles(files, { bundles, ranges, delay_ms, answerAfter_ms, answer });
  const log = new RequestLog(() => 0);
  const digest = webCryptoDigest();
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, backoff_ms: 1, fetch, digest, shelf, meter, log, silent });
  const scene = await PublishedScene.open(queue, new Tree("https://host/sub/"), "rooms");
  const host = new RecordingHost();
  const problems: unknown[] = [];
  /** What was told besides. */
  const told: ("answered" | "outdated")[] = [];
  const budget = new FrameBudget(1e9, () => 0);
  const explorer = new Explorer(
    scene,
    host,
    budget,
    { memory_limit_bytes, target_px: 1.5, uses, growing, ...(most_triangles !== undefined && { most_triangles }) },
    {
      changed: () => {},
      problem: (error) => problems.push(error),
      answered: () => told.push("answered"),
      outdated: () => told.push("outdated"),
    },
  );
  host.missing = () => explorer.missing;
  const go = (position: Vec3, velocity: Vec3 = [0, 0, 0]) =>
    explorer.follow({ position, viewAngle_rad: 1, height_px: 720 }, velocity);
  /** Waits until nothing is on its way any more. */
  const quiet = async () => {
    for (let calm = 0; calm < 5; ) {
      await new Promise((resolve) => setTimeout(resolve, 2));
      calm = explorer.pending === 0 ? calm + 1 : 0;
    }
  };
  return { explorer, host, problems, told, requests, log, files, scene, go, quiet };
}
