/**
 * What does a request cost on this line? Its headers, and what could have come while nothing came because every request under
 * way was still waiting for its answer to begin: next to nothing on a slow line, which is always busy, and on a fast and
 * distant one more than many a file. Learnt from what travels.
 */

/** About what the headers of a request and its answer take; `belvedere walk` counts the same. */
export const HEADER_BYTES = 400;
/** What was seen so long ago counts half. */
const HALF_LIFE_MS = 5000;
/** Nothing is gained by believing more. */
const MOST_BYTES = 16 * 1024;

/** Tells of one request. */
export interface LineTrace {
  receives(bytes: number): void;
  ends(): void;
}

export interface Meter {
  /** What one more request costs. */
  readonly request_bytes: number;
  starts(): LineTrace;
}

export class LineMeter implements Meter {
  /** All of these fade. */
  private bytes = 0;
  private requests = 0;
  /** Time in which answers came, and in which all that was asked for was awaited. */
  private coming_ms = 0;
  private idle_ms = 0;
  /** Requests whose answers come, and those that wait for them. */
  private coming = 0;
  private waiting = 0;
  private seen_ms: number;

  constructor(private readonly now_ms: () => number = () => performance.now()) {
    this.seen_ms = now_ms();
  }

  get request_bytes(): number {
    if (this.idle_ms === 0 || this.bytes === 0) return HEADER_BYTES;
    // Where answers come in no time, any file is cheaper than a request.
    const missed = this.coming_ms === 0 ? Number.POSITIVE_INFINITY : (this.idle_ms * this.bytes) / this.coming_ms;
    return Math.min(MOST_BYTES, HEADER_BYTES + missed / this.requests);
  }

  starts(): LineTrace {
    this.tick();
    this.requests += 1;
    this.waiting += 1;
    let state: "waiting" | "coming" | "ended" = "waiting";
    return {
      receives: (bytes) => {
        this.tick();
        this.bytes += bytes;
        if (state !== "waiting") return;
        state = "coming";
        this.waiting -= 1;
        this.coming += 1;
      },
      ends: () => {
        this.tick();
        if (state === "waiting") this.waiting -= 1;
        if (state === "coming") this.coming -= 1;
        state = "ended";
      },
    };
  }

  private tick(): void {
    const now_ms = this.now_ms();
    const passed_ms = now_ms - this.seen_ms;
    this.seen_ms = now_ms;
    if (this.waiting + this.coming === 0) return;
    const left = 0.5 ** (passed_ms / HALF_LIFE_MS);
    this.bytes *= left;
    this.requests *= left;
    this.coming_ms *= left;
    this.idle_ms *= left;
    if (this.coming > 0) this.coming_ms += passed_ms;
    else this.idle_ms += passed_ms;
  }
}
