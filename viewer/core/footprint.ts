/**
 * How much memory will a level take? Nobody says before it is decoded, so it is estimated from what the same kind of
 * bytes took so far, rather a little too much.
 */
import type { Level } from "./documents.ts";

/** Memory for each downloaded byte, before anything was learnt. */
const FIRST_GUESS = 4;
/** Estimates lie this much above the mean. */
const CAUTION = 1.25;

export class Footprint {
  private downloaded_bytes = 0;
  private memory_bytes = 0;

  learn(level: Level, memory_bytes: number): void {
    this.downloaded_bytes += downloadOf(level);
    this.memory_bytes += memory_bytes;
  }

  estimate_bytes(level: Level): number {
    const ratio = this.downloaded_bytes > 0 ? this.memory_bytes / this.downloaded_bytes : FIRST_GUESS;
    return Math.ceil(downloadOf(level) * Math.max(1, ratio) * CAUTION);
  }
}

function downloadOf({ bytes, textures }: Level): number {
  return bytes + textures.reduce((sum, texture) => sum + texture.bytes, 0);
}
