/** How much of a frame does streaming take? The last few hundred frames, and what nearly all of them keep to. */
export class FrameTimes {
  private readonly taken_ms: number[] = [];
  private next = 0;

  constructor(private readonly most: number) {}

  add(ms: number): void {
    this.taken_ms[this.next] = ms;
    this.next = (this.next + 1) % this.most;
  }

  /** The time that this share of the frames does not exceed; 0 before there is any. */
  quantile_ms(share: number): number {
    const sorted = [...this.taken_ms].sort((a, b) => a - b);
    return sorted[Math.max(0, Math.ceil(share * sorted.length) - 1)] ?? 0;
  }
}
