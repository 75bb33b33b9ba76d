/**
 * What does a request cost on this line? Its headers, and the bytes that could have come while one waits for the answer to
 * begin: on a slow line next to nothing, on a fast and distant one more than many a file. Learnt from what travels.
 */

/** About what the headers of a request and its answer take; `belvedere walk` counts the same. */
export const HEADER_BYTES = 400;
/** What was seen so long ago counts half. */
const HALF_LIFE_MS = 5000;
const LATENCY_WEIGHT = 0.2;
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
  private latency_ms: number | undefined;
  /** Bytes that came, and the time in which some were awaited, fading. */
  private bytes = 0;
  private awaited_ms = 0;
  private active = 0;
  private seen_ms: number;

  /** `lanes` is how many requests go side by side and share the line. */
  constructor(
    private readonly lanes: number,
    private readonly now_ms: () => number = () => performance.now(),
  ) {
    this.seen_ms = now_ms();
  }

  get request_bytes(): number {
    if (this.latency_ms === undefined || this.awaited_ms === 0) return HEADER_BYTES;
    const missed = (this.latency_ms * this.bytes) / this.awaited_ms / this.lanes;
    return Math.min(MOST_BYTES, HEADER_BYTES + missed);
  }

  starts(): LineTrace {
    this.tick();
    this.active += 1;
    const started_ms = this.seen_ms;
    let [waiting, running] = [true, true];
    return {
      receives: (bytes) => {
        this.tick();
        this.bytes += bytes;
        if (waiting) this.answered(this.seen_ms - started_ms);
        waiting = false;
      },
      ends: () => {
        this.tick();
        if (running) this.active -= 1;
        running = false;
      },
    };
  }

  private answered(after_ms: number): void {
    const before_ms = this.latency_ms ?? after_ms;
    this.latency_ms = before_ms + LATENCY_WEIGHT * (after_ms - before_ms);
  }

  private tick(): void {
    const now_ms = this.now_ms();
    const passed_ms = now_ms - this.seen_ms;
    this.seen_ms = now_ms;
    if (this.active === 0) return;
    const left = 0.5 ** (passed_ms / HALF_LIFE_MS);
    this.bytes *= left;
    this.awaited_ms = this.awaited_ms * left + passed_ms;
  }
}
