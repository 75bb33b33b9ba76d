/**
 * How would this feel on a slow line? Wraps `fetch` so that all bodies together arrive no faster than a line carries
 * them, each after the line's latency. What is already in the browser's cache is slowed down too.
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
  /** The line that is simulated; none means that nothing is slowed down. */
  line: Line | undefined;
  private free_ms = 0;

  constructor(
    private readonly unthrottled: (url: string, init: RequestInit) => Promise<Response>,
    private readonly clock: Clock = REAL_TIME,
  ) {}

  readonly fetch = async (url: string, init: RequestInit): Promise<Response> => {
    const latency_ms = this.line?.latency_ms ?? 0;
    const response = await this.unthrottled(url, init);
    if (latency_ms > 0) await this.clock.pause(latency_ms);
    if (!this.line || !response.body) return response;
    const { status, statusText, headers } = response;
    return new Response(response.body.pipeThrough(this.slowly()), { status, statusText, headers });
  };

  private slowly(): TransformStream<Uint8Array, Uint8Array> {
    return new TransformStream({
      transform: async (chunk, controller) => {
        for (let at = 0; at < chunk.byteLength; at += PIECE_BYTES) {
          const piece = chunk.subarray(at, at + PIECE_BYTES);
          await this.carry(piece.byteLength);
          controller.enqueue(piece);
        }
      },
    });
  }

  /** Waits until the line has carried so many bytes after all that it was given before. */
  private async carry(bytes: number): Promise<void> {
    if (!this.line) return;
    const now_ms = this.clock.now_ms();
    this.free_ms = Math.max(this.free_ms, now_ms) + (bytes * 8000) / this.line.bits_per_s;
    await this.clock.pause(this.free_ms - now_ms);
  }
}
