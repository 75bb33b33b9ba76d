/**
 * Which smooth LODs are being refined, and is what came for them what was published? Keeps of each what has come, hands
 * only the next rungs to the decoder, and compares the whole with its hash before the last of it is drawn. Rungs have no
 * hash of their own: until then, damage shows at most as a wrong shape.
 */
import type { Smooth } from "../documents/modeldocument.ts";
import { join } from "../fetch/transfer.ts";
import type { IsSound } from "../fetch/verify.ts";
import type { SmoothDecoding } from "./smoothdecoding.ts";
import type { Refined } from "./smoothstream.ts";

interface Stream {
  readonly smooth: Smooth;
  /** By which the decoder knows it. */
  readonly number: number;
  readonly came: ArrayBuffer[];
  /** How much of what came the decoder was given. */
  given: number;
  /** Rungs that have come. */
  rungs: number;
}

export class SmoothLods {
  /** By model. */
  private readonly streams = new Map<number, Stream>();
  private decoding: SmoothDecoding | undefined;
  private opened = 0;
  private ended = false;

  /** Starts to decode with the first stream. */
  constructor(
    private readonly start: () => SmoothDecoding,
    private readonly isSound: IsSound,
  ) {}

  /**
   * Takes in what follows what has come of a model, up to a rung. Fails when it is damaged; then the stream is of no use
   * and should be closed.
   */
  async refine(
    model: number,
    smooth: Smooth,
    rung: number,
    next: readonly ArrayBuffer[],
    materials: string,
  ): Promise<Refined> {
    const stream = this.streams.get(model) ?? this.begun(smooth, [], 0);
    this.streams.set(model, stream);
    stream.came.push(...next);
    const came_bytes = sizeOf(stream.came);
    const told_bytes = smooth.rungs[rung]?.to;
    if (came_bytes !== told_bytes) {
      throw new Error(`${smooth.url} has ${came_bytes} bytes up to rung ${rung}, and not ${told_bytes}`);
    }
    stream.rungs = rung + 1;
    const isWhole = came_bytes === smooth.bytes;
    if (isWhole) await this.check(smooth.url, stream.came);
    if (this.ended) throw new Error("nothing is decoded here any more");
    this.decoding ??= this.start();
    const news = stream.came.slice(stream.given);
    stream.given = stream.came.length;
    const { glb, state_bytes } = await this.decoding.refine(stream.number, news, materials);
    if (isWhole) this.close(model);
    return { glb, state_bytes: isWhole ? 0 : state_bytes + came_bytes };
  }

  /** How many rungs of a model have come and need not come again. */
  taken(model: number): number {
    return this.streams.get(model)?.rungs ?? 0;
  }

  /** Forgets what came of a model after so many rungs; answers the bytes that stay, none where the rungs came in one piece. */
  rewind(model: number, to: number): number {
    const stream = this.streams.get(model);
    this.close(model);
    if (!stream || to === 0) return 0;
    const { smooth, came } = stream;
    const bytes = smooth.rungs[to - 1]?.to ?? 0;
    const ends = came.map((_, i) => sizeOf(came.slice(0, i + 1)));
    const kept = ends.indexOf(bytes) + 1;
    if (kept === 0) return 0;
    this.streams.set(model, this.begun(smooth, came.slice(0, kept), to));
    return bytes;
  }

  private begun(smooth: Smooth, came: ArrayBuffer[], rungs: number): Stream {
    return { smooth, number: this.opened++, came, given: 0, rungs };
  }

  private async check(url: string, parts: readonly ArrayBuffer[]): Promise<void> {
    const whole = join(parts.map((bytes) => new Uint8Array(bytes)));
    if (!(await this.isSound(url, whole))) {
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

  /** Ends decoding for good. */
  end(): void {
    this.ended = true;
    this.streams.clear();
    this.decoding?.end();
    this.decoding = undefined;
  }
}

function sizeOf(parts: readonly ArrayBuffer[]): number {
  return parts.reduce((sum, { byteLength }) => sum + byteLength, 0);
}
