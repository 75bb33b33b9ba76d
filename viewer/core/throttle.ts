/**
 * How would this feel on a slow line? Wraps `fetch` so that all bodies together arrive no faster than a line carries
 * them, each after the line's latency. That holds from the moment in which a line is chosen, also for what was asked for
 * before. What is already in the browser's own cache is slowed down too.
 */

export interface Line {
  readonly name: string;
  readonly bits_per_s: number;
  readonly latency_ms: number;
}

export const LINES: readonly Line[] = [
  { name: "3G", bits_per_s: 1_600_000, latency_ms: 150 },
  { name: "128k", bits_per_s: 128_000, latency_ms: 50 },
  { name: "56k", bits_per_s: 56_000, latency_ms: 120 },
];

/** Bodies take turns in pieces of this size. */
const PIECE_BYTES = 1024;

export interface Clock {
  readonly now_ms: () => number;
  readonly pause: (ms: number) => Promise<void>;
}

const REAL_TIME: Clock = {
  now_ms: () => performance.now(),
  pause: (ms) => new Promise((resolve) => setTimeout(resolve, ms)),
};

export class Throttle {
  private chosen: Line | undefined;
  private free_ms = 0;
  /** Comes true when another line is chosen, which ends all waiting for the one before. */
  private switched: Promise<void> = Promise.resolve();
  private tellSwitched: () => void = () => {};

  constructor(
    private readonly unthrottled: (url: string, init: RequestInit) => Promise<Response>,
    private readonly clock: Clock = REAL_TIME,
  ) {
    this.expectSwitch();
  }

  /** The line that is simulated; none means that nothing is slowed down. */
  get line(): Line | undefined {
    return this.chosen;
  }

  set line(line: Line | undefined) {
    this.chosen = line;
    this.free_ms = 0;
    this.tellSwitched();
    this.expectSwitch();
  }

  readonly fetch = async (url: string, init: RequestInit): Promise<Response> => {
    const response = await this.unthrottled(url, init);
    await this.wait(this.chosen?.latency_ms ?? 0);
    if (!response.body) return response;
    const { status, statusText, headers } = response;
    return new Response(response.body.pipeThrough(this.slowly()), { status, statusText, headers });
  };

  /** Waits until the line has carried so many bytes after all that it was given before. */
  async carry(bytes: number): Promise<void> {
    if (!this.chosen) return;
    const now_ms = this.clock.now_ms();
    this.free_ms = Math.max(this.free_ms, now_ms) + (bytes * 8000) / this.chosen.bits_per_s;
    await this.wait(this.free_ms - now_ms);
  }

  private slowly(): TransformStream<Uint8Array, Uint8Array> {
    return new TransformStream({
      transform: async (chunk, controller) => {
        for (let at = 0; at < chunk.byteLength; ) {
          // While nothing is slowed down, nothing is cut up.
          const piece = chunk.subarray(at, this.chosen ? at + PIECE_BYTES : chunk.byteLength);
          await this.carry(piece.byteLength);
          controller.enqueue(piece);
          at += piece.byteLength;
        }
      },
    });
  }

  private async wait(ms: number): Promise<void> {
    if (ms > 0) await Promise.race([this.clock.pause(ms), this.switched]);
  }

  private expectSwitch(): void {
    this.switched = new Promise((resolve) => {
      this.tellSwitched = resolve;
    });
  }
}
