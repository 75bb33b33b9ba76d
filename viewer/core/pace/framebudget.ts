/**
 * May heavy work run now? Decoding is spread over frames: each frame grants some milliseconds, and work that comes later
 * waits for the next frame, so that the picture keeps moving while a room loads. A piece that has begun is finished, so it may take
 * longer than that by what is left of one. Where a frame takes long to draw, as much is granted again after the time of a usual one, and
 * a share of the time after one that took very long, so that a machine without a graphics card still finishes loading. What waits runs
 * in a task of its own, behind the frame's.
 */
import type { Pieces } from "./pieces.ts";

/** How long a frame takes on a usual screen, at most. */
const FRAME_MS = 17;
/** After what takes longer nobody sees a motion, so a share of that time is granted, up to what makes no task a long one. */
const [SLOW_MS, SLOW_SHARE, MOST_MS] = [150, 0.25, 40];

export class FrameBudget {
  private spent_ms = 0;
  private granted_ms: number;
  private busy = false;
  /** Work that others wait for, such as documents, and after it the rest. */
  private readonly urgent: (() => void)[] = [];
  private readonly waiting: (() => void)[] = [];
  private soon: ReturnType<typeof setTimeout> | undefined;
  private late: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly least_ms: number,
    private readonly now_ms: () => number,
  ) {
    this.granted_ms = least_ms;
  }

  /** Starts a new frame after one that took `frame_ms`, and lets waiting work run; answers how many times as much as usual it grants. */
  beginFrame(frame_ms = 0): number {
    const slow_ms = frame_ms > SLOW_MS ? Math.min(MOST_MS, SLOW_SHARE * frame_ms) : 0;
    this.granted_ms = Math.max(this.least_ms, slow_ms);
    clearTimeout(this.late);
    this.late = undefined;
    this.spent_ms = 0;
    clearTimeout(this.soon);
    this.soon = setTimeout(() => {
      if (!this.busy) this.next();
    });
    return this.granted_ms / this.least_ms;
  }

  /** What work took since the frame began. */
  get taken_ms(): number {
    return this.spent_ms;
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

  /** Does work of many pieces, of which some are done at a time; what else waits goes in between. */
  async runPieces<T>(work: Pieces<T>): Promise<T> {
    for (;;) {
      const step = await this.run(() => {
        const end_ms = this.now_ms() + this.least_ms;
        let step = work.next();
        while (!step.done && this.now_ms() < end_ms) step = work.next();
        return step;
      }, "urgent");
      if (step.done) return step.value;
    }
  }

  private next(): void {
    const go = this.urgent.shift() ?? this.waiting.shift();
    if (!go) return;
    this.busy = true;
    go();
  }
}
