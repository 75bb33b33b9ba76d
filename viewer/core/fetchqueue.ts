/**
 * What is on the wire? A queue of downloads: a bounded number at once, the most urgent first, each URL once however many
 * ask for it, cancellable, retried with back-off, its bytes counted and, where the URL holds their hash, verified.
 */
import { purposeOf } from "./priority.ts";
import type { RequestLog, RequestTrace } from "./requestlog.ts";
import { type Digest, type Verdict, verify } from "./verify.ts";

/** About what the headers of a request and its answer cost. */
export const REQUEST_BYTES = 200;

/** Why a download failed for good. */
export class FetchError extends Error {
  override readonly name = "FetchError";

  constructor(
    readonly kind: "cancelled" | "corrupt" | "status" | "unreachable",
    readonly url: string,
    message: string,
  ) {
    super(message);
  }
}

export interface FetchQueueOptions {
  readonly fetch: (url: string, init: RequestInit) => Promise<Response>;
  /** Downloads at once. */
  readonly concurrency: number;
  /** SHA-256, where the environment has it. */
  readonly digest: Digest | undefined;
  /** How often one download is tried. */
  readonly attempts: number;
  /** A download from which nothing is heard for so long is tried again. */
  readonly stall_ms: number;
  /** Pause before the second try; doubles for each further one. */
  readonly backoff_ms: number;
  /** Remembers what was asked for and how it ended. */
  readonly log?: RequestLog;
}

export interface Asked {
  /** Asks the server whether a cached copy is still current. */
  readonly fresh?: boolean;
  /** Why it is wanted, for the log. */
  readonly reason?: string;
}

export const FETCH_DEFAULTS: Omit<FetchQueueOptions, "fetch" | "digest" | "log"> = {
  concurrency: 8,
  attempts: 4,
  stall_ms: 20_000,
  backoff_ms: 300,
};

/** What went over the wire so far. */
export interface FetchTally {
  /** Body bytes, content encoding removed: comparable with the sizes in the published documents. */
  bytes: number;
  requests: number;
  retries: number;
  /** Bodies that could not be compared with a hash. */
  unverified: number;
}

interface Download {
  readonly url: string;
  readonly fresh: boolean;
  readonly controller: AbortController;
  readonly promise: Promise<ArrayBuffer>;
  readonly resolve: (bytes: ArrayBuffer) => void;
  readonly reject: (error: unknown) => void;
  priority: number;
  readonly order: number;
  readonly trace: RequestTrace | undefined;
}

export class FetchQueue {
  readonly tally: FetchTally = { bytes: 0, requests: 0, retries: 0, unverified: 0 };
  private readonly waiting = new Map<string, Download>();
  private readonly running = new Map<string, Download>();
  private orders = 0;

  constructor(private readonly options: FetchQueueOptions) {}

  /** Downloads waiting or running. */
  get pending(): number {
    return this.waiting.size + this.running.size;
  }

  /**
   * Asks for the bytes of a URL; the lowest priority number goes first. Asking again joins the download and may only
   * make it more urgent.
   */
  request(url: string, priority: number, { fresh = false, reason = "" }: Asked = {}): Promise<ArrayBuffer> {
    const known = this.waiting.get(url) ?? this.running.get(url);
    if (known) {
      known.priority = Math.min(known.priority, priority);
      return known.promise;
    }
    let resolve: Download["resolve"] = () => {};
    let reject: Download["reject"] = () => {};
    const promise = new Promise<ArrayBuffer>((yes, no) => {
      resolve = yes;
      reject = no;
    });
    const controller = new AbortController();
    const trace = this.options.log?.asks(url, purposeOf(priority), reason);
    const order = this.orders++;
    this.waiting.set(url, { url, fresh, controller, promise, resolve, reject, priority, order, trace });
    this.pump();
    return promise;
  }

  /** Makes a download more urgent, when it is still under way. */
  hasten(url: string, priority: number): void {
    const download = this.waiting.get(url);
    if (download) download.priority = Math.min(download.priority, priority);
  }

  /** Compares bytes that came in pieces with the hash in the URL of the whole. */
  verdict(url: string, bytes: ArrayBuffer): Promise<Verdict> {
    return verify(url, bytes, this.options.digest);
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
    this.running.delete(url);
    download.controller.abort();
    download.trace?.ends("cancelled");
    download.reject(new FetchError("cancelled", url, `${url} is not needed any more`));
    this.pump();
  }

  private pump(): void {
    while (this.running.size < this.options.concurrency && this.waiting.size > 0) {
      let next: Download | undefined;
      for (const candidate of this.waiting.values()) {
        if (!next || candidate.priority < next.priority) next = candidate;
        else if (candidate.priority === next.priority && candidate.order < next.order) next = candidate;
      }
      if (!next) return;
      this.waiting.delete(next.url);
      this.running.set(next.url, next);
      void this.run(next);
    }
  }

  private async run(download: Download): Promise<void> {
    try {
      const bytes = await this.bytesOf(download);
      download.trace?.ends("done");
      download.resolve(bytes);
    } catch (error) {
      if (!download.controller.signal.aborted) download.trace?.ends("failed");
      download.reject(error);
    } finally {
      if (this.running.get(download.url) === download) this.running.delete(download.url);
      this.pump();
    }
  }

  private async bytesOf(download: Download): Promise<ArrayBuffer> {
    const { url, controller } = download;
    let reload = false;
    for (let attempt = 1; ; attempt += 1) {
      const last = attempt >= this.options.attempts;
      try {
        const bytes = await this.transfer(download, reload);
        const verdict = await this.verdict(url, bytes);
        if (verdict === "unverified") this.tally.unverified += 1;
        if (verdict !== "mismatch") return bytes;
        if (reload) throw new FetchError("corrupt", url, `${url} does not hold the bytes that its name promises`);
        reload = true;
      } catch (error) {
        if (controller.signal.aborted) throw new FetchError("cancelled", url, `${url} is not needed any more`);
        const final = error instanceof FetchError && error.kind !== "unreachable";
        if (final || last) throw error;
        await pause(this.options.backoff_ms * 2 ** (attempt - 1), controller.signal);
      }
      this.tally.retries += 1;
    }
  }

  /** One try. Throws `unreachable` for what may pass, `status` for what will not. */
  private async transfer(download: Download, reload: boolean): Promise<ArrayBuffer> {
    const { url, controller } = download;
    const stalled = new AbortController();
    const watch = () => setTimeout(() => stalled.abort(), this.options.stall_ms);
    let timer = watch();
    this.tally.requests += 1;
    download.trace?.starts();
    try {
      const cache: RequestCache = reload ? "reload" : download.fresh ? "no-cache" : "default";
      const signal = AbortSignal.any([controller.signal, stalled.signal]);
      const response = await this.options.fetch(url, { cache, signal });
      if (!response.ok) {
        const passes = response.status >= 500 || response.status === 429 || response.status === 408;
        throw new FetchError(passes ? "unreachable" : "status", url, `${url} was answered with ${response.status}`);
      }
      const parts: Uint8Array[] = [];
      const body = response.body?.getReader();
      for (let part = await body?.read(); body && part?.value; part = await body.read()) {
        parts.push(part.value);
        this.tally.bytes += part.value.byteLength;
        download.trace?.receives(part.value.byteLength);
        clearTimeout(timer);
        timer = watch();
      }
      return join(parts);
    } catch (error) {
      if (error instanceof FetchError) throw error;
      throw new FetchError("unreachable", url, `${url} cannot be reached (${String(error)})`);
    } finally {
      clearTimeout(timer);
    }
  }
}

/** One buffer of several. */
export function join(parts: readonly Uint8Array[]): ArrayBuffer {
  const whole = new Uint8Array(parts.reduce((total, part) => total + part.byteLength, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.byteLength;
  }
  return whole.buffer;
}

function pause(ms: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const timer = setTimeout(resolve, ms);
    signal.addEventListener("abort", () => {
      clearTimeout(timer);
      resolve();
    });
  });
}
