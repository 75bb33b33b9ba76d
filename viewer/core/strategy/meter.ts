/**
 * How fast is the line? Bytes by the time in which they came and nothing else did, and what may be under way on it: enough
 * that it never rests, and no more, so that what turns out to be urgent need not wait behind what is not. The same as
 * `client/src/strategy/meter.rs`.
 */

/** What each answer lets be forgotten of those before it. */
const FORGETTING = 0.2;
/** So many requests are under way at most … */
const MOST_REQUESTS = 8;
/** … and no more than what comes in this time, beside one … */
export const AHEAD_S = 0.5;
/** … or so many bytes, while nobody knows how fast it is. */
const UNKNOWN_BYTES = 64 * 1024;

/** Learns from what comes. */
export class LineSpeed {
  /** What came, the latest most … */
  private bytes = 0;
  /** … and in what time. */
  private busy_s = 0;
  private lastCame_ms = 0;

  /** So many bytes that were asked for at one time came at another, both from any beginning. */
  came(asked_ms: number, came_ms: number, bytes: number): void {
    const busy_s = (came_ms - Math.max(asked_ms, this.lastCame_ms)) / 1000;
    this.lastCame_ms = Math.max(this.lastCame_ms, came_ms);
    if (busy_s <= 0) return;
    this.bytes += bytes - FORGETTING * this.bytes;
    this.busy_s += busy_s - FORGETTING * this.busy_s;
  }

  /** Infinite while nothing is known. */
  get bytes_per_s(): number {
    return this.isKnown ? this.bytes / this.busy_s : Number.POSITIVE_INFINITY;
  }

  /** Whether one more may be under way beside so many requests, whose answers take so many bytes on the line. */
  hasRoom(requests: number, bytes: number): boolean {
    const most_bytes = this.isKnown ? AHEAD_S * this.bytes_per_s : UNKNOWN_BYTES;
    return requests < 2 || (requests < MOST_REQUESTS && bytes < most_bytes);
  }

  private get isKnown(): boolean {
    return this.busy_s > 0;
  }
}
