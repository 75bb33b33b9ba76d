/**
 * May heavy work run now? Decoding is spread over frames: each frame grants some milliseconds, and work that comes later
 * waits for the next frame, so that the picture keeps moving while a room loads. Where a frame takes long to draw,
 * decoding gets half as long, so that a slow machine still finishes loading.
 */
export class FrameBudget {
  private spent_ms = 0;
  private granted_ms: number;
  private busy = false;
  private readonly waiting: (() => void)[] = [];

  constructor(
    private readonly least_ms: number,
    private readonly now_ms: () => number,
  ) {
    this.granted_ms = least_ms;
  }

  /** Starts a new frame after one that took `frame_ms`, and lets waiting work run. */
  beginFrame(frame_ms: number): void {
    this.spent_ms = 0;
    this.granted_ms = Math.max(this.least_ms, frame_ms / 2);
    if (!this.busy) this.next();
  }

  /** Runs one piece of work as soon as a frame has time for it; pieces run one after the other, oldest first. */
  async run<T>(work: () => Promise<T>): Promise<T> {
    if (this.busy || this.waiting.length > 0 || this.spent_ms >= this.granted_ms) {
      await new Promise<void>((resolve) => this.waiting.push(resolve));
    }
    this.busy = true;
    const start_ms = this.now_ms();
    try {
      return await work();
    } finally {
      this.spent_ms += this.now_ms() - start_ms;
      this.busy = false;
      if (this.spent_ms < this.granted_ms) this.next();
    }
  }

  private next(): void {
    const go = this.waiting.shift();
    if (!go) return;
    this.busy = true;
    go();
  }
}
