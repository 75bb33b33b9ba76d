/**
 * How do bytes come over the wire? One request and its answer, handed on piece by piece as they come; an answer from which
 * nothing is heard for too long is given up. Whoever waits is told before that.
 */
import { isWhole, mismeasured, misplaced, most_bytes, rangeOf, type Span } from "./span.ts";

/** Why a download failed for good. */
export class FetchError extends Error {
  override readonly name = "FetchError";

  constructor(
    /**
     * What is `broken` had begun to come, and broke off or could not be unpacked: the server answers. To a `range` it answers with something
     * else than that part, or more than is of use. What is `forgone` could only be had with much else, and something else is the better buy.
     */
    readonly kind: "broken" | "cancelled" | "corrupt" | "forgone" | "range" | "status" | "unreachable",
    readonly url: string,
    message: string,
    /** Of an answer that is an error. */
    readonly status?: number,
    /** Of such an answer, too. */
    readonly headers?: Headers,
  ) {
    super(message);
  }

  /** Whether the server says that there is nothing. */
  get isGone(): boolean {
    return this.status === 404 || this.status === 410;
  }

  /** Whether it was called off, which says nothing of the file. */
  get isCancelled(): boolean {
    return this.kind === "cancelled";
  }
}

/** Nothing came of a download for too long. */
export class StallError extends FetchError {
  constructor(
    url: string,
    readonly waited_ms: number,
  ) {
    super("unreachable", url, `${url} cannot be reached (nothing came of it for ${waited_ms / 1000} s)`);
  }
}

/** Whoever waits for something that is called off hears this. */
export function cancelled(url: string): FetchError {
  return new FetchError("cancelled", url, `${url} is not needed any more`);
}

export type Fetch = (url: string, init: RequestInit) => Promise<Response>;

export interface TransferOptions {
  readonly fetch: Fetch;
  readonly cache: RequestCache;
  readonly signal: AbortSignal;
  /** A transfer from which nothing is heard for so long has failed. */
  readonly stall_ms: number;
  /** When nothing is heard for so long, `quiet` is called, and `answered` when an answer begins after so long. */
  readonly quiet_ms: number;
  readonly quiet?: () => void;
  readonly answered?: (wait_ms: number) => void;
  /** Of what is at the URL, only this part is wanted. */
  readonly span?: Span | undefined;
}

/** Takes a piece of an answer: of what was asked for, or of all of a file of which a part was. */
export type Receive = (piece: Uint8Array, isAll: boolean) => void;

/** One try; answers the headers. Throws `unreachable` or `broken` for what may pass, `status` or `range` for what will not. */
export async function transfer(
  url: string,
  { fetch, cache, signal, stall_ms, quiet_ms, quiet = () => {}, answered = () => {}, span }: TransferOptions,
  receive: Receive,
): Promise<Headers> {
  // Not `AbortSignal.any`: browsers keep whoever listens to what that makes for as long as the page is there.
  const ending = new AbortController();
  let end: (reason: unknown) => void = () => {};
  // Whatever it is that does not answer need not hear of it either.
  const ended = new Promise<never>((_, reject) => {
    end = (reason) => {
      ending.abort(reason);
      reject(reason);
    };
  });
  ended.catch(() => {});
  let isStalled = false;
  const stall = () => {
    isStalled = true;
    end(new Error("nothing comes"));
  };
  const callOff = () => end(signal.reason);
  signal.addEventListener("abort", callOff);
  if (signal.aborted) callOff();
  const watch = () => [setTimeout(stall, stall_ms), setTimeout(quiet, quiet_ms)];
  let timers = watch();
  const asked_ms = performance.now();
  let body: ReadableStreamDefaultReader<Uint8Array> | undefined;
  try {
    const asked = { cache, signal: ending.signal, ...(span && { headers: { Range: rangeOf(span) } }) };
    const response = await Promise.race([fetch(url, asked), ended]);
    if (!response.ok) {
      const passes = response.status >= 500 || response.status === 429 || response.status === 408;
      const { status, headers } = response;
      throw new FetchError(
        passes ? "unreachable" : "status",
        url,
        `${url} was answered with ${status}`,
        status,
        headers,
      );
    }
    answered(performance.now() - asked_ms);
    const isAll = span !== undefined && isWhole(response);
    if (span) keepTo(url, misplaced(response, span));
    body = response.body?.getReader();
    let came = 0;
    while (body) {
      // Something was heard: at first that it is there, then what is in it.
      timers.forEach(clearTimeout);
      timers = watch();
      const { value } = await Promise.race([body.read(), ended]);
      if (!value) break;
      came += value.byteLength;
      if (span && came > most_bytes(isAll, span)) break;
      receive(value, isAll);
    }
    if (span) keepTo(url, mismeasured(came, isAll, span));
    return response.headers;
  } catch (error) {
    // What is not believed need not come to its end.
    if (error instanceof FetchError && error.kind === "range") ending.abort(error);
    if (error instanceof FetchError) throw error;
    if (ending.signal.aborted) body?.cancel().catch(() => {});
    if (isStalled) throw new StallError(url, stall_ms);
    if (body) throw new FetchError("broken", url, `${url} breaks off or is damaged on the way (${String(error)})`);
    throw new FetchError("unreachable", url, `${url} cannot be reached (${String(error)})`);
  } finally {
    timers.forEach(clearTimeout);
    signal.removeEventListener("abort", callOff);
  }
}

/** Fails where there is something wrong with a part that a server answered. */
function keepTo(url: string, wrong: string | undefined): void {
  if (wrong === undefined) return;
  throw new FetchError(
    "range",
    url,
    `a part of ${url} was answered ${wrong}, so this server is asked for no more parts`,
  );
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

/** Waits, but no longer than until it is called off. */
export function pause(ms: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const end = () => {
      clearTimeout(timer);
      signal.removeEventListener("abort", end);
      resolve();
    };
    const timer = setTimeout(end, ms);
    signal.addEventListener("abort", end);
  });
}
