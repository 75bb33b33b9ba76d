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
   * Takes in what follows what was taken in of a model, up to a rung. Fails when it is damaged; then the stream is of no use
   * and should be closed.
   */
  async refine(
    model: number,
    smooth: Smooth,
    rung: number,
    next: readonly ArrayBuffer[],
    materials: string,
  ): Promise<Refined> {
    const stream = this.streams.get(model) ?? { number: this.opened++, taken: [] };
    this.streams.set(model, stream);
    stream.taken.push(...next);
    const taken_bytes = stream.taken.reduce((sum, { byteLength }) => sum + byteLength, 0);
    const told_bytes = smooth.rungs[rung]?.to;
    if (taken_bytes !== told_bytes) {
      throw new Error(`${smooth.url} has ${taken_bytes} bytes up to rung ${rung}, and not ${told_bytes}`);
    }
    const isWhole = taken_bytes === smooth.bytes;
    if (isWhole) await this.check(smooth.url, stream.taken);
    this.decoding ??= this.begin();
    const { glb, state_bytes } = await this.decoding.refine(stream.number, next, materials);
    if (isWhole) this.close(model);
    return { glb, state_bytes: isWhole ? 0 : state_bytes + taken_bytes };
  }

  private async check(url: string, parts: readonly ArrayBuffer[]): Promise<void> {
    const whole = join(parts.map((bytes) => new Uint8Array(bytes)));
    if ((await this.verify(url, whole)) === "mismatch") {
      throw new Error(`the rungs of ${url} are not the bytes that its name promises`);
    }
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
