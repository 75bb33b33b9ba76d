/** What need not travel? What this device has kept, alone or in a stream that is here whole. */
import type { Shelf } from "../shelf/shelf.ts";
import type { Download } from "./download.ts";
import type { Rungs } from "./rungs.ts";
import { type IsSound, streamOf } from "./verify.ts";

export class Kept {
  constructor(
    private readonly shelf: Shelf | undefined,
    private readonly rungs: Rungs,
    private readonly isSound: IsSound,
  ) {}

  has(url: string): boolean {
    if (this.shelf?.has(url) || this.rungs.holds(url)) return true;
    const stream = this.shelf && streamOf(url);
    return stream !== undefined && this.shelf?.has(stream) === true;
  }

  async take({ url, within }: Download): Promise<ArrayBuffer | undefined> {
    const alone = await this.read(url);
    if (alone || !within) return alone;
    return this.rungs.copyOf(within) ?? (await this.read(within.url))?.slice(within.from, within.to);
  }

  /** Something turned out to be damaged. */
  forget(url: string): void {
    this.shelf?.forget(url);
    this.rungs.forget(url);
  }

  /** What is on the shelf, if it is that still: all pages of an origin may write there. */
  private async read(url: string): Promise<ArrayBuffer | undefined> {
    const kept = await this.shelf?.read(url);
    if (!kept || (await this.isSound(url, kept))) return kept;
    this.shelf?.forget(url);
    return undefined;
  }
}
