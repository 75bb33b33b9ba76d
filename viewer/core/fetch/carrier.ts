/**
 * How does a download come over the wire, and is it what its URL promises? Tried again with back-off, its bytes counted and, where the URL
 * holds their hash, verified; then this device may keep it.
 */
import { reasonOf } from "../basics/reason.ts";
import type { FrameBudget } from "../pace/framebudget.ts";
import { addressOf, BundleError, BundleReader, offersBundles } from "../strategy/bundles.ts";
import { leftOf } from "../strategy/file.ts";
import { PRIORITY } from "../strategy/priority.ts";
import type { BackOff } from "./backoff.ts";
import type { Breaker } from "./breaker.ts";
import type { Download } from "./download.ts";
import type { FetchQueueOptions } from "./fetchqueue.ts";
import type { Meter } from "./linemeter.ts";
import { mayPass } from "./losses.ts";
import { Patience } from "./patience.ts";
import { Rungs, type Way } from "./rungs.ts";
import type { Silence, Silences } from "./silences.ts";
import { cancelled, FetchError, pause, type Receive, StallError, type TransferOptions, transfer } from "./transfer.ts";
import { isImmutable, isRung, promisedHash, verify } from "./verify.ts";

/** What went over the wire so far. */
export interface FetchTally {
  /** Body bytes, content encoding removed: comparable with the sizes in the published documents. */
  bytes: number;
  requests: number;
  retries: number;
  /** Objects that came in bundles. */
  bundled: number;
  /** Bodies that could not be compared with the hash in their name; pointers and lists, which have none, do not count. */
  unverified: number;
  /** Bytes that need not travel, because this device had kept them. */
  kept_bytes: number;
}

/** What is larger gains nothing by going another way: bundles are not compressed. */
const MOST_BUNDLED_BYTES = 1024 * 1024;

const BROKEN = { kind: "broken", status: undefined } as const;

type Manner = Omit<TransferOptions, "fetch" | "quiet_ms" | "answered">;

/** Who hears how one download does. */
export interface Hooks {
  /** A piece of it has come. */
  readonly came: () => void;
  /** Nothing has come for long, so that it takes nothing of the line. */
  readonly hushed: () => void;
  /** Whether others need its place then. */
  readonly yields: () => boolean;
  /** More is known of how its server answers, for which others may wait. */
  readonly learnt: () => void;
}

/** Nothing came of a download for long, and others need its place. */
export class Yielded extends Error {
  override readonly name = "Yielded";
}

export class Carrier {
  readonly tally: FetchTally = { bytes: 0, requests: 0, retries: 0, bundled: 0, unverified: 0, kept_bytes: 0 };
  /** When a request may begin; at once unless told. */
  budget: FrameBudget | undefined;
  /** Who is told what was answered. */
  breaker: Breaker | undefined;
  readonly rungs = new Rungs((download, hooks, way) => this.carry(download, hooks, way));
  private readonly patience: Patience;
  private offered = false;
  private refused = false;

  constructor(
    private readonly options: FetchQueueOptions,
    private readonly meter: Meter,
    /** Told of what is silent while it is tried again. */
    private readonly silences: Silences,
    /** Told of what a server asks for, which is waited for before another try. */
    private readonly backOff: BackOff,
  ) {
    this.patience = new Patience(options.quiet_ms);
  }

  /** Whether the server offers bundles, and answers them as it should. */
  get offersBundles(): boolean {
    return this.offered && !this.refused;
  }

  /** Brings one download alone. Fails with {@link Yielded} where nothing comes for long of its first try and others need its place. */
  bring(download: Download, hooks: Hooks): Promise<ArrayBuffer> {
    const { within } = download;
    return within ? this.rungs.bring(download, within, hooks) : this.carry(download, hooks);
  }

  /** Brings what is at the address of a download, or what is there another way: a part of a file, or all of it where no parts can be had. */
  private async carry(download: Download, hooks: Hooks, way?: Way): Promise<ArrayBuffer> {
    const { url, controller, fresh } = download;
    let isDamaged = false;
    let pastCache = fresh === "past caches" || way?.pastCache === true;
    for (; ; download.attempt += 1) {
      const { attempt } = download;
      this.tally.requests += 1;
      download.starts();
      try {
        const cache = pastCache ? "reload" : fresh ? "no-cache" : "default";
        await this.race(download, cache, hooks, way, (piece, isAll) => {
          this.silences.over(url);
          this.tally.bytes += piece.byteLength;
          download.receives(piece, isAll);
          hooks.came();
        });
        const bytes = download.taken();
        const name = way && download.comesWhole ? way.url : url;
        if (await this.accept(name, bytes)) {
          // What could not be brought from its own address is here all the same.
          if (way) this.breaker?.answered(url);
          return bytes;
        }
        // Who waits for a part has been given it, or knows that it is damaged.
        if (isDamaged || !download.isForAll)
          throw new FetchError("corrupt", name, `${name} does not hold the bytes that its name promises`);
        isDamaged = true;
        pastCache = true;
      } catch (error) {
        if (controller.signal.aborted) throw cancelled(url);
        if (error instanceof Yielded) throw error;
        const kind = error instanceof FetchError ? error.kind : "unreachable";
        const last = attempt >= this.options.attempts || this.breaker?.isOpen;
        if (!mayPass(kind) || last || !download.isWorthAnotherTry) throw error;
        if (error instanceof StallError) this.tell(url, "stalled", attempt, error.waited_ms);
        if (kind === "broken") this.tell(url, "broken", attempt);
        this.tellBackOff(url, attempt);
        // A browser may have kept what cannot be unpacked.
        pastCache ||= kind === "broken";
        await pause(this.options.backoff_ms * 2 ** (attempt - 1), controller.signal);
        // Others may have been told meanwhile.
        while (this.backOff.isOn(url) && !controller.signal.aborted) {
          await pause(this.backOff.left_ms(url), controller.signal);
        }
        if (controller.signal.aborted) throw cancelled(url);
      }
      this.tally.retries += 1;
    }
  }

  /**
   * One try. Where nothing comes of it for some seconds it gives its place to others; where none need it, a second request goes out beside it,
   * and what begins to come first is taken (Dean and Barroso, *The tail at scale*, 2013). The second goes another way, where there is one: what
   * is wrong with one address on the way need not be so with another.
   */
  private async race(
    download: Download,
    cache: RequestCache,
    hooks: Hooks,
    way: Way | undefined,
    receive: Receive,
  ): Promise<void> {
    const { url, controller, attempt } = download;
    // Who takes long may answer to who waits longer.
    const stall_ms = attempt * this.options.stall_ms;
    const runners = new Set<AbortController>();
    let winner: AbortController | undefined;
    let hasYielded = false;
    const callOff = () => {
      for (const runner of runners) runner.abort(controller.signal.reason);
    };
    controller.signal.addEventListener("abort", callOff);
    const run = (isBundle: boolean, how: RequestCache, quiet: () => void) => {
      const own = new AbortController();
      runners.add(own);
      if (controller.signal.aborted) callOff();
      const manner = { span: way?.span, cache: how, signal: own.signal, stall_ms, quiet };
      const take: Receive = (piece, isAll) => {
        if (!winner && isBundle) this.patience.wasInVain();
        if (!winner) way?.begins(isAll);
        winner ??= own;
        for (const other of runners) if (other !== winner) other.abort();
        if (winner === own) receive(piece, isAll);
      };
      const come = isBundle ? this.bringBundled(download, manner, take) : this.transfer(way?.url ?? url, manner, take);
      return come.then(() => {
        winner ??= own;
      });
    };
    const mayBundle = () => !way && this.mayBundle(download);
    const isOther = attempt % 2 === 0 && mayBundle();
    let second: Promise<void> | undefined;
    const quiet = () => {
      const { quiet_ms } = this.patience;
      download.fallsQuiet();
      if (download.priority < PRIORITY.due) this.tell(url, "quiet", attempt, quiet_ms);
      // While nothing is answered, one try at a time is enough.
      if (winner || second || this.breaker?.isOpen) return;
      if (attempt === 1 && hooks.yields()) {
        hasYielded = true;
        for (const runner of runners) runner.abort();
      } else if (attempt === 1 && isImmutable(url)) {
        this.tally.requests += 1;
        download.trace?.starts();
        // Past the cache: browsers let a second request for the same address wait for the first.
        second = run(mayBundle(), "reload", () => {});
        second.catch(() => {});
      }
      hooks.hushed();
    };
    try {
      await run(isOther, cache, quiet).catch((error) => {
        const [first] = runners;
        if (!second || winner === first) throw error;
        return second;
      });
    } catch (error) {
      throw hasYielded ? new Yielded() : error;
    } finally {
      controller.signal.removeEventListener("abort", callOff);
      for (const runner of runners) if (runner !== winner) runner.abort();
    }
  }

  /** Whether a download may be asked for as a bundle of one. */
  private mayBundle({ url, bytes }: Download): boolean {
    return this.offersBundles && isImmutable(url) && bytes !== undefined && bytes <= MOST_BUNDLED_BYTES;
  }

  /** Brings one download as a bundle of one. What goes wrong with that says nothing of it. */
  private async bringBundled(download: Download, manner: Manner, receive: Receive): Promise<void> {
    const { url } = download;
    const reader = new BundleReader(1);
    try {
      await this.transfer(addressOf([download]), manner, (piece) => {
        for (const bytes of reader.push(piece)) receive(new Uint8Array(bytes), false);
      });
      if (!reader.isWhole) throw new BundleError("the bundle is too short");
      this.breaker?.answered(url);
    } catch (error) {
      if (error instanceof StallError) throw new StallError(url, error.waited_ms);
      const { kind, status } = error instanceof FetchError && mayPass(error.kind) ? error : BROKEN;
      throw new FetchError(kind, url, `${url} does not come in a bundle (${reasonOf(error)})`, status);
    }
  }

  /** Brings several together, in their order; `came` takes each as soon as it is here. Never fails: what did not come, did not. */
  async bringTogether<T extends { readonly url: string; readonly bytes: number | undefined }>(
    members: readonly T[],
    signal: AbortSignal,
    came: (member: T, bytes: ArrayBuffer) => Promise<void>,
  ): Promise<void> {
    const reader = new BundleReader(members.length);
    const given: Promise<void>[] = [];
    this.tally.requests += 1;
    try {
      // They need not wait for longer: each can be asked for alone.
      const stall_ms = Math.min(this.options.stall_ms, this.patience.quiet_ms);
      await this.transfer(addressOf(members), { cache: "default", signal, stall_ms }, (piece) => {
        this.tally.bytes += piece.byteLength;
        for (const bytes of reader.push(piece)) {
          const member = members[given.length];
          if (member) given.push(came(member, bytes));
        }
      });
      if (!reader.isWhole) this.refused = true;
    } catch (error) {
      // What the server cannot answer so once, it is not asked so again.
      if (!(error instanceof FetchError) || error.kind === "status") this.refused = true;
      // They go alone now.
      const { url } = members[given.length] ?? {};
      if (error instanceof StallError && url) this.tell(url, "stalled", 0, error.waited_ms);
      if (url) this.tellBackOff(url, 0);
    }
    await Promise.all(given);
  }

  /** Whether bytes are what their URL promises; then they are kept. */
  async accept(url: string, bytes: ArrayBuffer): Promise<boolean> {
    const verdict = await verify(url, bytes, this.options.digest);
    if (verdict === "unverified" && (promisedHash(url) || isRung(url))) this.tally.unverified += 1;
    if (verdict === "verified" || verdict === "later") this.options.shelf?.keep(url, bytes);
    return verdict !== "mismatch";
  }

  /** Says for how long the server asked to be left alone, if it did. */
  private tellBackOff(url: string, attempt: number): void {
    const left_ms = this.backOff.left_ms(url);
    if (left_ms > 0) this.tell(url, "backing off", attempt, left_ms);
  }

  private tell(url: string, how: Silence["how"], attempt: number, waited_ms = 0): void {
    this.silences.begins({ url, how, attempt, attempts: this.options.attempts, waited_ms });
  }

  private async transfer(url: string, manner: Manner, receive: Receive): Promise<void> {
    const go = () => this.travel(url, manner, receive);
    const headers = await (this.budget?.begin(go) ?? go());
    this.offered ||= offersBundles(headers);
  }

  private async travel(url: string, manner: Manner, receive: Receive): Promise<Headers> {
    const { fetch } = this.options;
    const trace = this.meter.starts(leftOf(url));
    try {
      const { quiet_ms } = this.patience;
      const answered = (wait_ms: number) => this.patience.waited(wait_ms);
      const headers = await transfer(url, { fetch, quiet_ms, answered, ...manner }, (piece, isAll) => {
        trace.receives(piece.byteLength);
        receive(piece, isAll);
      });
      this.breaker?.answered(url);
      return headers;
    } catch (error) {
      if (error instanceof FetchError) {
        if (error.kind === "status" || error.kind === "range") this.breaker?.answered(url);
        this.backOff.hears(error);
      }
      throw error;
    } finally {
      trace.ends();
    }
  }
}
