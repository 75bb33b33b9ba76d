/**
 * What grows next? The most urgent, a few at a time: what is ordered of a worker cannot be taken back, and while one looks elsewhere
 * hundreds of models may turn out not to be needed.
 */
import type { Growing, Seedling } from "./growing.ts";

/** One that grows, and one that follows at once. */
const MOST_AT_ONCE = 2;

/** Who wants something grown. */
export interface Grower {
  /** Lower is more urgent; it may change while it waits. */
  readonly load: { readonly priority: number };
  /** Its turn has come; answers whether it is still wanted. */
  begin(): boolean;
}

interface Waiting {
  readonly grower: Grower;
  readonly go: () => void;
}

export class GrowthQueue {
  private growing_count = 0;
  private readonly waiting: Waiting[] = [];

  constructor(private readonly growing: Growing) {}

  /** A GLB; `undefined` when it was not wanted any more. */
  async grow(seedling: Seedling, grower: Grower): Promise<ArrayBuffer | undefined> {
    if (this.growing_count >= MOST_AT_ONCE) {
      await new Promise<void>((go) => this.waiting.push({ grower, go }));
    } else this.growing_count += 1;
    try {
      return grower.begin() ? await this.growing.grow(seedling) : undefined;
    } finally {
      this.next();
    }
  }

  /** Gives the turn of one that is done to the most urgent that waits. */
  private next(): void {
    const most = this.waiting.reduce<Waiting | undefined>(
      (best, one) => (best && best.grower.load.priority <= one.grower.load.priority ? best : one),
      undefined,
    );
    if (!most) {
      this.growing_count -= 1;
      return;
    }
    this.waiting.splice(this.waiting.indexOf(most), 1);
    most.go();
  }
}
