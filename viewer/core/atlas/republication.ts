/**
 * Was the scene published anew, so that this revision is gone? What is immutable never goes while its revision stands, so where it
 * is missing the pointer is read again; not at each of them, since then many are missing.
 */
import type { PublishedScene } from "./published.ts";

const AGAIN_AFTER_MS = 10_000;

export class Republication {
  private isSuspected = false;
  private isOver = false;
  private resting: ReturnType<typeof setTimeout> | undefined;

  /** `outdated` is called once. */
  constructor(
    private readonly scene: PublishedScene,
    private readonly outdated: () => void,
  ) {}

  /** Something immutable is missing. */
  suspect(): void {
    this.isSuspected = true;
    if (this.resting === undefined) void this.look();
  }

  close(): void {
    this.isOver = true;
    clearTimeout(this.resting);
  }

  private async look(): Promise<void> {
    if (!this.isSuspected || this.isOver) return;
    this.isSuspected = false;
    this.resting = setTimeout(() => {
      this.resting = undefined;
      void this.look();
    }, AGAIN_AFTER_MS);
    const { pointer } = this.scene;
    // Nobody is told that it cannot be read: what is missing was told.
    const latest = await this.scene.latest().catch(() => pointer);
    if (this.isOver || latest.revision === pointer.revision) return;
    this.close();
    this.outdated();
  }
}
