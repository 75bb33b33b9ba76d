/**
 * How would this feel on a slow line? Wraps `fetch` so that all bodies together arrive no faster than a line carries
 * them, each after the line's latency. That holds from the moment in which a line is chosen, also for what was asked for
 * before. What is already in the browser's own cache is slowed down too.
 *
 * What travels compressed is seen here unpacked alone, whose length nobody knows before its end. So a line carries no more of a
 * body than the bytes that `Content-Length` tells, which count what travels: the beginning comes slowly, and once so many were
 * carried the rest is there. That way a body ends just when it would, and no part of it comes sooner.
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

/** How many bytes of a body travel; nothing where nobody says so, as a server need not. */
function travellingBytes(headers: Headers): number | undefined {
  const told = headers.get("Content-Length");
  return told !== null && /^\d+$/.test(told) ? Number(told) : undefined;
}

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
    const slowly = this.slowly(travellingBytes(headers));
    return new Response(response.body.pipeThrough(slowly), { status, statusText, headers });
  };

  /** Waits until the line has carried so many bytes after all that it was given before. */
  async carry(bytes: number): Promise<void> {
    if (!this.chosen) return;
    const now_ms = this.clock.now_ms();
    this.free_ms = Math.max(this.free_ms, now_ms) + (bytes * 8000) / this.chosen.bits_per_s;
    await this.wait(this.free_ms - now_ms);
  }

  /** Slows down a body of which so many bytes travel, as far as that is known. */
  private slowly(travelling_bytes = Infinity): TransformStream<Uint8Array, Uint8Array> {
    let left_bytes = travelling_bytes;
    return new TransformStream({
      transform: async (chunk, controller) => {
        for (let at = 0; at < chunk.byteLength; ) {
          // While nothing is slowed down, nothing is cut up.
          const isSlow = this.chosen && left_bytes > 0;
          const piece = chunk.subarray(at, isSlow ? at + PIECE_BYTES : chunk.byteLength);
          const carried_bytes = Math.min(piece.byteLength, left_bytes);
          left_bytes -= carried_bytes;
          if (isSlow) await this.carry(carried_bytes);
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
