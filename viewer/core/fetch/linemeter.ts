/**
 * What does a request cost on this line? Its headers, and what could have come while one waits for the answer to begin.
 *
 * By Little's law a line that carries so many requests at once brings, in the time for which one only waits, the mean bytes
 * of a request times the share of its life that it waits. That counts as far as nothing else made it wait: as the same share
 * again, of the shortest wait seen. So on a slow line, where answers queue for it, requests cost next to nothing, and on a
 * fast and distant one as much as a file.
 */
import { HEADER_BYTES } from "../strategy/file.ts";
import { LineSpeed } from "../strategy/meter.ts";

/** Nothing is gained by believing more. */
const MOST_BYTES = 16 * 1024;
/** How much one request changes the means, and how slowly a shortest wait is forgotten. */
const [WEIGHT, FORGETTING] = [0.1, 1.01];

/** Tells of one request. */
export interface LineTrace {
  receives(bytes: number): void;
  ends(): void;
}

export interface Meter extends Pick<LineSpeed, "bytes_per_s" | "hasRoom"> {
  /** What one more request costs. */
  readonly request_bytes: number;
  /** A request is sent; such a share of the bytes that come of it really travels. */
  starts(left?: number): LineTrace;
}

export class LineMeter implements Meter {
  private wait_ms: number | undefined;
  private readonly speed = new LineSpeed();
  private mean: { readonly life_ms: number; readonly bytes: number } | undefined;

  constructor(private readonly now_ms: () => number = () => performance.now()) {}

  get request_bytes(): number {
    if (this.wait_ms === undefined || !this.mean || this.mean.life_ms === 0) return HEADER_BYTES;
    const share = Math.min(1, this.wait_ms / this.mean.life_ms);
    return Math.min(MOST_BYTES, HEADER_BYTES + share ** 2 * this.mean.bytes);
  }

  get bytes_per_s(): number {
    return this.speed.bytes_per_s;
  }

  hasRoom(requests: number, bytes: number): boolean {
    return this.speed.hasRoom(requests, bytes);
  }

  starts(left = 1): LineTrace {
    const started_ms = this.now_ms();
    let bytes = 0;
    return {
      receives: (more) => {
        if (bytes === 0) this.waited(this.now_ms() - started_ms);
        bytes += more;
      },
      ends: () => {
        if (bytes === 0) return;
        this.lived(this.now_ms() - started_ms, bytes);
        this.speed.came(started_ms, this.now_ms(), left * bytes);
      },
    };
  }

  private waited(wait_ms: number): void {
    this.wait_ms = Math.min(wait_ms, FORGETTING * (this.wait_ms ?? wait_ms));
  }

  private lived(life_ms: number, bytes: number): void {
    const before = this.mean ?? { life_ms, bytes };
    this.mean = {
      life_ms: before.life_ms + WEIGHT * (life_ms - before.life_ms),
      bytes: before.bytes + WEIGHT * (bytes - before.bytes),
    };
  }
}
