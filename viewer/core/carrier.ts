/**
 * How does a download come over the wire, and is it what its URL promises? Tried again with back-off, its bytes counted and, where the URL
 * holds their hash, verified; then this device may keep it.
 */
import type { Breaker } from "./breaker.ts";
import { addressOf, BundleReader, offersBundles } from "./bundles.ts";
import type { Download } from "./download.ts";
import type { FetchQueueOptions } from "./fetchqueue.ts";
import type { FrameBudget } from "./framebudget.ts";
import type { Meter } from "./linemeter.ts";
import type { Silences } from "./silences.ts";
import { FetchError, pause, StallError, type TransferOptions, transfer } from "./transfer.ts";
import { leftOf } from "./travel.ts";
import { isRung, promisedHash, verify } from "./verify.ts";

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

type Receive = (piece: Uint8Array) => void;
type Manner = Omit<TransferOptions, "fetch">;

export class Carrier {
  readonly tally: FetchTally = { bytes: 0, requests: 0, retries: 0, bundled: 0, unverified: 0, kept_bytes: 0 };
  /** When a request may begin; at once unless told. */
  budget: FrameBudget | undefined;
  /** Who is told what was answered. */
  breaker: Breaker | undefined;
  private offered = false;
  private refused = false;

  constructor(
    private readonly options: FetchQueueOptions,
    private readonly meter: Meter,
    /** Told of what is silent while it is tried again. */
    private readonly silences: Silences,
  ) {}

  /** Whether the server offers bundles, and answers them as it should. */
  get offersBundles(): boolean {
    return this.offered && !this.refused;
  }

  /** Brings one download alone; `came` hears of each piece of it. */
  async bring(download: Download, came: () => void): Promise<ArrayBuffer> {
    const { url, controller, fresh } = download;
    let reload = false;
    for (let attempt = 1; ; attempt += 1) {
      this.tally.requests += 1;
      download.starts();
      try {
        const cache = reload ? "reload" : fresh ? "no-cache" : "default";
        // Who takes long may answer to who waits longer.
        const stall_ms = attempt * this.options.stall_ms;
        await this.transfer(url, { cache, signal: controller.signal, stall_ms }, (piece) => {
          this.silences.over(url);
          this.tally.bytes += piece.byteLength;
          download.receives(piece);
          came();
        });
        const bytes = download.taken();
        if (await this.accept(url, bytes)) return bytes;
        // Who waits for a part has been given it, or knows that it is damaged.
        if (reload || !download.isForAll)
          throw new FetchError("corrupt", url, `${url} does not hold the bytes that its name promises`);
        reload = true;
      } catch (error) {
        if (controller.signal.aborted) throw cancelled(url);
        const final = error instanceof FetchError && error.kind !== "unreachable";
        const last = attempt >= this.options.attempts || this.breaker?.isOpen;
        if (final || last || !download.isWorthAnotherTry) throw error;
        if (error instanceof StallError) this.fallsSilent(error, attempt);
        await pause(this.options.backoff_ms * 2 ** (attempt - 1), controller.signal);
      }
      this.tally.retries += 1;
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
      const { stall_ms } = this.options;
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
      if (error instanceof StallError && url) this.fallsSilent(new StallError(url, error.waited_ms), 0);
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

  private fallsSilent({ url, waited_ms }: StallError, attempt: number): void {
    this.silences.stalled({ url, attempt, attempts: this.options.attempts, waited_ms });
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
      const headers = await transfer(url, { fetch, ...manner }, (piece) => {
        trace.receives(piece.byteLength);
        receive(piece);
      });
      this.breaker?.answered(url);
      return headers;
    } catch (error) {
      if (error instanceof FetchError && error.kind === "status") this.breaker?.answered(url);
      throw error;
    } finally {
      trace.ends();
    }
  }
}

/** Whoever waits for something that is called off hears this. */
export function cancelled(url: string): FetchError {
  return new FetchError("cancelled", url, `${url} is not needed any more`);
}
