/**
 * From when on is a server silent? After a few seconds, or where answers here take longer than that, after what is longer than usual: the
 * mean of what was waited for, and some of its mean deviations (after Jacobson, *Congestion avoidance and control*, 1988). Two of them instead
 * of four: to be told of silence too early costs a message and a request, and a page that has just begun is slow by itself.
 */

const [LEAST_MS, SHORTEST_MS] = [4000, 1000];
/** How much one wait changes the mean, and the mean deviation. */
const GAIN = 1 / 4;
const DEVIATIONS = 2;

export class Patience {
  private usual: { readonly mean_ms: number; readonly deviation_ms: number } | undefined;

  constructor(private least_ms = LEAST_MS) {}

  /** Who hears nothing for so long does not wait idly any more. */
  get quiet_ms(): number {
    if (!this.usual) return this.least_ms;
    return Math.max(this.least_ms, this.usual.mean_ms + DEVIATIONS * this.usual.deviation_ms);
  }

  /** What was silent came at once when it was asked for another way: the next one is waited for less. */
  wasInVain(): void {
    this.least_ms = Math.max(Math.min(this.least_ms, SHORTEST_MS), this.least_ms / 2);
  }

  /** An answer began after so long. */
  waited(wait_ms: number): void {
    const { mean_ms, deviation_ms } = this.usual ?? { mean_ms: wait_ms, deviation_ms: wait_ms / 2 };
    const off_ms = wait_ms - mean_ms;
    this.usual = {
      mean_ms: mean_ms + GAIN * off_ms,
      deviation_ms: deviation_ms + GAIN * (Math.abs(off_ms) - deviation_ms),
    };
  }
}
