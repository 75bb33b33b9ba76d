/**
 * Which smooth LODs are being refined, and is what came for them what was published? Keeps of each what has come, hands
 * only the next rungs to the decoder, and compares the whole with its hash before the last of it is drawn. Rungs have no
 * hash of their own: until then, damage shows at most as a wrong shape.
 */
import type { Smooth } from "./documents.ts";
import type { SmoothDecoding } from "./smoothdecoding.ts";
import type { Refined } from "./smoothstream.ts";
import { join } from "./transfer.ts";
import type { Verdict } from "./verify.ts";

interface Stream {
  readonly number: number;
  readonly taken: ArrayBuffer[];
}

/** Compares the bytes of an immutable object with the hash in its URL. */
export type Verify = (url: string, bytes: ArrayBuffer) => Promise<Verdict>;

export class SmoothLods {
  /** By model. */
  private readonly streams = new Map<number, Stream>();
  private decoding: SmoothDecoding | undefined;
  private opened = 0;

  /** Starts to decode with the first stream. */
  constructor(
    private readonly begin: () => SmoothDecoding,
    private readonly verify: Verify,
  ) {}

  /**
   * Takes in the rungs that follow those that were taken in of a model. Fails when they are damaged; then the stream is
   * of no use and should be closed.
   */
  async refine(
    model: number,
    { url, rungs }: Smooth,
    next: readonly ArrayBuffer[],
    materials: string,
  ): Promise<Refined> {
    const stream = this.streams.get(model) ?? { number: this.opened++, taken: [] };
    this.streams.set(model, stream);
    for (const bytes of next) {
      const { from = 0, to = 0 } = rungs[stream.taken.length] ?? {};
      if (bytes.byteLength !== to - from) {
        throw new Error(`rung ${stream.taken.length} of ${url} has ${bytes.byteLength} bytes, and not ${to - from}`);
      }
      stream.taken.push(bytes);
    }
    const isWhole = stream.taken.length === rungs.length;
    if (isWhole) {
      const whole = join(stream.taken.map((bytes) => new Uint8Array(bytes)));
      if ((await this.verify(url, whole)) === "mismatch") {
        throw new Error(`the rungs of ${url} are not the bytes that its name promises`);
      }
    }
    this.decoding ??= this.begin();
    const { glb, state_bytes } = await this.decoding.refine(stream.number, next, materials);
    if (isWhole) {
      this.close(model);
      return { glb, state_bytes: 0 };
    }
    const kept_bytes = stream.taken.reduce((sum, { byteLength }) => sum + byteLength, 0);
    return { glb, state_bytes: state_bytes + kept_bytes };
  }

  /** Forgets what came of a model. */
  close(model: number): void {
    const stream = this.streams.get(model);
    if (!stream) return;
    this.streams.delete(model);
    this.decoding?.close(stream.number);
  }

  end(): void {
    this.streams.clear();
    this.decoding?.end();
    this.decoding = undefined;
  }
}
