/**
 * May heavy work run now? Decoding is spread over frames: each frame grants some milliseconds, and work that comes later
 * waits for the next frame, so that the picture keeps moving while a room loads. A piece that has begun is finished, so it may take
 * longer than that by what is left of one. Where a frame takes long to draw, which keeps a graphics card busy and not the page, as much
 * is granted again after the time of a usual one, so that a slow machine still finishes loading.
 */

/** How long a frame takes on a usual screen, at most. */
const FRAME_MS = 17;

export class FrameBudget {
  private spent_ms = 0;
  private busy = false;
  /** Work that others wait for, such as documents, and after it the rest. */
  private readonly urgent: (() => void)[] = [];
  private readonly waiting: (() => void)[] = [];
  private late: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly granted_ms: number,
    private readonly now_ms: () => number,
  ) {}

  /** Starts a new frame, and lets waiting work run. */
  beginFrame(): void {
    clearTimeout(this.late);
    this.late = undefined;
    this.spent_ms = 0;
    if (!this.busy) this.next();
  }

  /** Runs one piece of work as soon as a frame has time for it; pieces run one after the other, urgent ones first, else the oldest. */
  async run<T>(work: () => T | Promise<T>, urgency: "urgent" | "usual" = "usual"): Promise<T> {
    const line = urgency === "urgent" ? this.urgent : this.waiting;
    const isAnyWaiting = this.urgent.length + this.waiting.length > 0;
    if (this.busy || isAnyWaiting || this.spent_ms >= this.granted_ms) {
      await new Promise<void>((resolve) => line.push(resolve));
    }
    this.busy = true;
    const start_ms = this.now_ms();
    try {
      return await work();
    } finally {
      this.spent_ms += this.now_ms() - start_ms;
      this.busy = false;
      if (this.spent_ms < this.granted_ms) this.next();
      else this.late ??= setTimeout(() => this.beginFrame(), FRAME_MS);
    }
  }

  /** Begins something that goes on by itself, as soon as a frame has time for that; answers when it has ended. */
  async begin<T>(work: () => Promise<T>): Promise<T> {
    const { ended } = await this.run(() => ({ ended: work() }), "urgent");
    return ended;
  }

  private next(): void {
    const go = this.urgent.shift() ?? this.waiting.shift();
    if (!go) return;
    this.busy = true;
    go();
  }
}
