/**
 * What is on the wire, and what goes next? A queue of downloads: a bounded number at once, the most urgent first, each URL once however many
 * ask for it, cancellable. Small objects come together where the server offers that, and what this device has kept does not
 * travel at all. What brings them is a {@link Carrier}.
 */
import type { FileRef } from "../documents/documents.ts";
import type { FrameBudget } from "../pace/framebudget.ts";
import type { Shelf } from "../shelf/shelf.ts";
import { inOrder, isSmall, NAME_BYTES, together } from "../strategy/bundles.ts";
import { compressed_bytes } from "../strategy/file.ts";
import { PRIORITY, purposeOf } from "../strategy/priority.ts";
import { BackOff } from "./backoff.ts";
import { Breaker, type BreakerEvents } from "./breaker.ts";
import { Carrier, type FetchTally, type Hooks, Yielded } from "./carrier.ts";
import { Download, type Freshness, type Within } from "./download.ts";
import { Kept } from "./kept.ts";
import { LineMeter, type Meter } from "./linemeter.ts";
import type { RequestLog } from "./requestlog.ts";
import { Postponed } from "./rungs.ts";
import { type Silence, Silences } from "./silences.ts";
import type { Part } from "./slices.ts";
import { cancelled, type Fetch, FetchError } from "./transfer.ts";
import { type Digest, type IsSound, isImmutable, verify } from "./verify.ts";

export interface FetchQueueOptions {
  readonly fetch: Fetch;
  /** Transfers at once. */
  readonly concurrency: number;
  /** SHA-256, where the environment has it. */
  readonly digest: Digest | undefined;
  /** How often one download is tried. */
  readonly attempts: number;
  /** A download from which nothing is heard for so long is tried again; twice as long the second time, and so on. */
  readonly stall_ms: number;
  /** When nothing came of something for so long, others are let go before it, or it is asked for once more; unless answers usually take longer. */
  readonly quiet_ms: number;
  /** Pause before the second try; doubles for each further one. */
  readonly backoff_ms: number;
  /** Remembers what was asked for and how it ended. */
  readonly log?: RequestLog;
  /** What is kept from visit to visit. */
  readonly shelf?: Shelf | undefined;
  /** Hears of what nothing comes for long, or only what is damaged, while it is tried on, and of nothing when that is over. */
  readonly silent?: (silence: Silence | undefined) => void;
  /** Says what a request costs; learnt from what travels unless given. */
  readonly meter?: Meter | undefined;
}

export interface Asked {
  /** Whether a cached copy may do only once the server was asked whether it is still current, or not at all. */
  readonly fresh?: Freshness;
  /** Why it is wanted, for the log. */
  readonly reason?: string;
  /** How large it is said to be; what is small may come together with others. */
  readonly bytes?: number | undefined;
  /** Where it also stands, for when its own address has nothing. */
  readonly within?: Within | undefined;
  /** Whether a part of a file is still wanted; until it has come unless given. */
  readonly isWanted?: () => boolean;
}

export const FETCH_DEFAULTS: Omit<FetchQueueOptions, "fetch" | "digest" | "log" | "shelf" | "meter" | "silent"> = {
  concurrency: 8,
  attempts: 4,
  stall_ms: 20_000,
  quiet_ms: 4000,
  backoff_ms: 300,
};

/** Who hears how the server does. */
export interface FetchWatcher extends BreakerEvents {
  /** An immutable object is not there. */
  readonly missing: () => void;
  /** Nothing comes for long of what is tried on, or only what is damaged. */
  readonly silent?: (silence: Silence) => void;
}

/** What is left of a file of which nobody wants any more comes to its end where it is no more than this: to call it off costs a connection. */
const LEAST_REST_BYTES = 16 * 1024;

/** More than any level costs: of what can only be had with all of its stream, and is asked for where nothing else can be drawn. */
const FORGONE_BYTES = 1e12;

/** What was silent for long takes so many transfers at most: a browser has few connections to a server, and others must have some, too. */
const MOST_LATE = 3;

/** One transfer, with what it takes of the line. */
interface Underway {
  readonly downloads: readonly Download[];
  readonly requests: number;
}

export class FetchQueue {
  private readonly carrier: Carrier;
  private readonly kept: Kept;
  private readonly waiting = new Map<string, Download>();
  private readonly running = new Map<string, Download>();
  /** Transfers under way, and how many of them are bundles. */
  private readonly transfers = new Set<Underway>();
  private bundles = 0;
  private pumping = false;
  private orders = 0;
  private closed = false;

  private readonly meter: Meter;
  private readonly silences = new Silences((silence) => {
    this.options.silent?.(silence);
    if (silence) this.watcher?.silent?.(silence);
  });
  private readonly backOff = new BackOff(() => this.pump());
  private watcher: FetchWatcher | undefined;
  private breaker: Breaker | undefined;

  constructor(private readonly options: FetchQueueOptions) {
    this.meter = options.meter ?? new LineMeter();
    this.carrier = new Carrier(options, this.meter, this.silences, this.backOff);
    this.kept = new Kept(options.shelf, this.carrier.rungs, this.isSound);
  }

  /** What went over the wire so far. */
  get tally(): FetchTally {
    return this.carrier.tally;
  }

  /** From now on a request begins when a frame has time for it: to a browser that is as much work as to decode a small file. */
  beginWithin(budget: FrameBudget): void {
    this.carrier.budget = budget;
  }

  /** From now on downloads wait while the server does not answer, until {@link probe} lets one of them try, or one is a document; `undefined` ends that. */
  watch(watcher: FetchWatcher | undefined): void {
    this.watcher = watcher;
    this.breaker = watcher && new Breaker(watcher);
    this.carrier.breaker = this.breaker;
  }

  /** Tries whether a server that was silent answers again, with one download. */
  probe(): void {
    this.breaker?.allow();
    this.pump();
  }

  /** Downloads waiting or running. */
  get pending(): number {
    return this.waiting.size + this.running.size;
  }

  /** What is kept from visit to visit, if anything is. */
  get shelf(): Shelf | undefined {
    return this.options.shelf;
  }

  /** A file turned out to be damaged: what is kept of it is of no use. */
  forget(url: string): void {
    this.kept.forget(url);
  }

  /**
   * Asks for the bytes of a URL; the lowest priority number goes first. Asking again joins the download and may only
   * make it more urgent.
   */
  request(url: string, priority: number, asked: Asked = {}): Promise<ArrayBuffer> {
    return this.ask(url, priority, asked).all();
  }

  /** Asks for a file that also stands in another one: it is given while that still comes, unless it is damaged there. */
  slice(part: Part, of: string, priority: number, asked: Asked = {}): Promise<ArrayBuffer> {
    return this.ask(of, priority, asked).part(part, asked.isWanted);
  }

  /** Whether a file is on its way. */
  isComing(url: string): boolean {
    return this.running.has(url) || this.waiting.has(url);
  }

  /** Whether something is silent that is waited for. */
  get isSilent(): boolean {
    return this.silences.any;
  }

  /** Comes true when nothing comes for long of a file that is on its way. */
  untilQuiet(url: string): Promise<void> {
    return (this.running.get(url) ?? this.waiting.get(url))?.untilQuiet() ?? new Promise(() => {});
  }

  /** How much has come of a file that is on its way. */
  came_bytes(url: string): number {
    return this.running.get(url)?.came_bytes ?? 0;
  }

  private ask(url: string, priority: number, { fresh, reason = "", bytes, within }: Asked): Download {
    const known = this.waiting.get(url) ?? this.running.get(url);
    if (known) {
      known.priority = Math.min(known.priority, priority);
      if (this.breaker?.isOpen) this.pumpSoon();
      return known;
    }
    const trace = this.closed ? undefined : this.options.log?.asks(url, purposeOf(priority), reason);
    const wish = { url, fresh, bytes, within, order: this.orders++, trace };
    const download = new Download(wish, priority, this.isSound);
    if (this.closed) {
      download.fails(cancelled(url), "cancelled");
      return download;
    }
    this.waiting.set(url, download);
    this.pumpSoon();
    return download;
  }

  /** What a file takes until it is here, a share of a request included. */
  cost_bytes({ url, bytes }: FileRef): number {
    if (this.kept.has(url)) return 0;
    if (this.carrier.rungs.isForgone(url)) return FORGONE_BYTES;
    const { request_bytes } = this.meter;
    const small = this.carrier.offersBundles && isSmall({ url, bytes }, request_bytes);
    return small ? bytes + NAME_BYTES : compressed_bytes({ url, bytes }) + request_bytes;
  }

  /** How fast the line is; infinite while nobody knows. */
  get bytes_per_s(): number {
    return this.meter.bytes_per_s;
  }

  /** Whether bytes that came in pieces, or in another file, are what their URL promises, as far as one can say. */
  readonly isSound: IsSound = async (url, bytes) => (await verify(url, bytes, this.options.digest)) !== "mismatch";

  /** Makes a download more urgent, when it is still under way. */
  hasten(url: string, priority: number): void {
    const download = this.waiting.get(url);
    if (download) download.priority = Math.min(download.priority, priority);
    if (this.breaker?.isOpen) this.pumpSoon();
  }

  /** Changes how urgent a waiting download is. */
  reprioritise(url: string, priority: number): void {
    const download = this.waiting.get(url);
    if (download) download.priority = priority;
  }

  /** Gives up a download; whoever waits for it hears a `cancelled` error. */
  cancel(url: string): void {
    const download = this.waiting.get(url) ?? this.running.get(url);
    if (!download) return;
    this.waiting.delete(url);
    if (this.running.delete(url)) this.keepParts(download);
    download.controller.abort();
    download.fails(cancelled(url), "cancelled");
    this.silences.over(url);
    this.breaker?.cancelled(url);
    this.pump();
  }

  /** Gives up all downloads, and begins none any more. */
  close(): void {
    this.closed = true;
    for (const url of [...this.waiting.keys(), ...this.running.keys()]) this.cancel(url);
    this.backOff.close();
  }

  /** What is asked for in one go can only come together when it is looked at together. */
  private pumpSoon(): void {
    if (!this.carrier.offersBundles) this.pump();
    else if (!this.pumping) {
      this.pumping = true;
      queueMicrotask(() => {
        this.pumping = false;
        this.pump();
      });
    }
  }

  private pump(): void {
    if (this.closed) return;
    while (this.busy < this.options.concurrency) {
      const next = this.next();
      if (next.length === 0) break;
      for (const download of next) {
        this.waiting.delete(download.url);
        this.running.set(download.url, download);
      }
      const [first] = next;
      const transfer = { downloads: next, requests: first && this.travels(first) ? 1 : 0 };
      this.transfers.add(transfer);
      const run = next.length > 1 ? this.runBundle(next) : first && this.run(first);
      void run?.finally(() => {
        this.transfers.delete(transfer);
        this.pump();
      });
    }
    this.makeRoom();
  }

  /**
   * Calls off packs of which all has come that is wanted, where something else waits for the room that they take on the line and more is left
   * of them than calling off costs. Where nothing waits they come to their end, and are kept whole. The same rule as in
   * `client/src/explorer/tasks.rs`.
   */
  private makeRoom(): void {
    const isFull = this.busy >= this.options.concurrency || !this.hasRoom;
    if (this.inLine.length === 0 || !isFull || this.breaker?.isOpen) return;
    const served = [...this.running.values()].filter((one) => one.isServed && one.rest_bytes > LEAST_REST_BYTES);
    for (const { url } of served) this.cancel(url);
  }

  /** What waits for a place, and not for what is learnt of its server. */
  private get inLine(): Download[] {
    return [...this.waiting.values()].filter((one) => !this.carrier.rungs.waits(one));
  }

  /** How many transfers go on. Those that wait until a server may be asked again hold up nothing else. */
  private get busy(): number {
    return [...this.transfers].filter(({ downloads }) => downloads.some((one) => this.mayBeAsked(one))).length;
  }

  /** Whether it is on the device, or its server has not asked to be left alone. */
  private mayBeAsked(download: Download): boolean {
    return !this.backOff.isOn(download.url) || !this.travels(download);
  }

  private get hasRoom(): boolean {
    // What is silent does not use the line.
    const heard = [...this.transfers].filter(({ downloads }) => downloads.some(({ isQuiet }) => !isQuiet));
    const requests = heard.reduce((sum, transfer) => sum + transfer.requests, 0);
    const bytes = heard.reduce((sum, transfer) => sum + transfer.requests * lineBytes(transfer.downloads), 0);
    return this.meter.hasRoom(requests, bytes);
  }

  /** What has come of a file that does not come to its end. */
  private keepParts(download: Download): void {
    if (!this.shelf) return;
    for (const { url, bytes } of download.given()) void this.carrier.accept(url, bytes);
  }

  /** What goes next: one download, or several that come together. */
  private next(): Download[] {
    const askable = this.inLine.filter((one) => this.mayBeAsked(one));
    const inLine = askable.sort((a, b) => rankOf(a) - rankOf(b) || a.order - b.order);
    if (this.breaker?.isOpen) {
      const kept = inLine.find((one) => !this.travels(one));
      const next = kept ?? this.breaker.choose(inLine, ({ priority }) => purposeOf(priority) === "document");
      return next ? [next] : [];
    }
    // Half of the transfers are left for what is large, or turns out to be urgent.
    const full = 2 * this.bundles >= this.options.concurrency;
    const { hasRoom } = this;
    const hasLateRoom = this.late < MOST_LATE;
    const mayGo = (one: Download) =>
      (hasLateRoom || !one.isLate) &&
      (hasRoom || !this.waitsForRoom(one)) &&
      (!full || purposeOf(one.priority) === "document" || !this.mayCome(one));
    const first = inLine.find(mayGo);
    if (!first) return [];
    if (full || !this.mayCome(first)) return [first];
    const purpose = purposeOf(first.priority);
    const alike = inLine.filter((one) => purposeOf(one.priority) === purpose && this.mayCome(one));
    return together(alike, this.meter.bytes_per_s);
  }

  /** How many that were silent before, or are, are being tried. */
  private get late(): number {
    return [...this.running.values()].filter(({ isLate, isQuiet }) => isLate || isQuiet).length;
  }

  /** Whether others need the place of a download that is silent. */
  private yields(): boolean {
    // Only what alone is silent is asked for twice at once.
    return this.late > 1 || this.inLine.some(({ isLate }) => !isLate);
  }

  private hooksOf(download: Download): Hooks {
    return {
      came: () => download.isServed && this.makeRoom(),
      hushed: () => this.pumpSoon(),
      yields: () => this.yields(),
      learnt: () => this.pumpSoon(),
    };
  }

  /** Whether a download takes its share of the line: what is kept does not. */
  private travels({ url }: Download): boolean {
    return !this.kept.has(url);
  }

  /** Whether a download goes only when the line has room for it: documents always go. */
  private waitsForRoom(download: Download): boolean {
    return purposeOf(download.priority) !== "document" && this.travels(download);
  }

  /** Whether a download may come in a bundle. */
  private mayCome(download: Download): boolean {
    const { url, fresh, alone } = download;
    return (
      this.carrier.offersBundles &&
      !fresh &&
      !alone &&
      isSmall(download, this.meter.request_bytes) &&
      !this.kept.has(url)
    );
  }

  private async run(download: Download): Promise<void> {
    const mark = this.breaker?.mark ?? 0;
    try {
      const { url, fresh } = download;
      const kept = !fresh && this.kept.has(url) ? await this.kept.take(download) : undefined;
      if (kept) this.tally.kept_bytes += kept.byteLength;
      const bytes = kept ?? (await this.carrier.bring(download, this.hooksOf(download)));
      this.settle(download, bytes, kept ? "kept" : "done");
    } catch (error) {
      const isRunning = this.running.get(download.url) === download;
      if (isRunning && (error instanceof Yielded || error instanceof Postponed)) {
        this.running.delete(download.url);
        if (error instanceof Yielded) download.fallsBehind();
        else this.silences.over(download.url);
        this.waiting.set(download.url, download);
        return;
      }
      if (isRunning) {
        this.running.delete(download.url);
        this.keepParts(download);
        this.tell(download.url, error, mark);
      }
      const isLeft = error instanceof FetchError && (error.kind === "cancelled" || error.kind === "forgone");
      download.fails(error, isRunning ? (isLeft ? "cancelled" : "failed") : undefined);
      this.silences.over(download.url);
    } finally {
      // Whatever has come of it without an answer, another one may try; unless that is asked for anew, and tries itself.
      if (!this.running.has(download.url)) this.breaker?.cancelled(download.url);
    }
  }

  /** A download that began at a mark was given up. */
  private tell(url: string, error: unknown, mark: number): void {
    if (!(error instanceof FetchError)) return;
    const { kind, isGone } = error;
    if (kind === "unreachable") this.breaker?.lost(url, mark);
    else if (kind === "broken") this.breaker?.broke(url);
    else if (isImmutable(url) && isGone) this.watcher?.missing();
  }

  private settle(download: Download, bytes: ArrayBuffer, result: "done" | "kept"): void {
    if (this.running.get(download.url) !== download) return;
    this.running.delete(download.url);
    this.silences.over(download.url);
    download.succeeds(bytes, result);
  }

  /** Downloads that come together. What does not come so, for whatever reason, then goes alone. */
  private async runBundle(downloads: readonly Download[]): Promise<void> {
    const members = inOrder(downloads);
    const controller = new AbortController();
    const isWanted = (download: Download) => this.running.get(download.url) === download;
    for (const { controller: one } of members) {
      one.signal.addEventListener("abort", () => members.some(isWanted) || controller.abort());
    }
    this.bundles += 1;
    for (const { trace } of members) trace?.starts();
    await this.carrier.bringTogether(members, controller.signal, (member, bytes) => this.take(member, bytes));
    this.bundles -= 1;
    for (const member of members.filter(isWanted)) {
      this.running.delete(member.url);
      // A server that asked to wait once is not wrong about bundles.
      const backsOff = this.backOff.isOn(member.url);
      member.alone = !backsOff || member.hasBackedOff;
      member.hasBackedOff = backsOff;
      this.waiting.set(member.url, member);
    }
  }

  /** A member of a bundle, unless it is damaged. */
  private async take(download: Download, bytes: ArrayBuffer): Promise<void> {
    download.trace?.receives(bytes.byteLength);
    if (!(await this.carrier.accept(download.url, bytes))) return;
    this.tally.bundled += 1;
    this.breaker?.answered(download.url);
    this.settle(download, bytes, "done");
  }
}

/** What was silent goes after all that is needed for a picture, and before what is finer. */
function rankOf({ priority, isLate }: Download): number {
  return isLate ? Math.max(priority, PRIORITY.due - 1) : priority;
}

/** What comes with one request takes so many bytes on the line; bundles are not compressed, whatever is in them. */
function lineBytes(downloads: readonly Download[]): number {
  const travels = ({ url, coming_bytes: bytes }: Download) =>
    downloads.length > 1 ? bytes : compressed_bytes({ url, bytes });
  return downloads.reduce((sum, download) => sum + travels(download), 0);
}
