/**
 * When is there another frame? One comes after the other while somebody may see them, else until nothing happens any more, and again when
 * something does: browsers keep back only those of a page that is hidden, not those of what is out of view.
 */

/** Nothing has happened for so long: what came is drawn by then, with all its pixels, and was told. */
const REST_AFTER_MS = 1000;

export class Frames {
  private isWatched = true;
  private isComing = false;
  private isOver = false;
  /** When something happened last; nothing until the frame after one was woken. */
  private busy_ms: number | undefined;

  /** `frame` answers whether anything happens. */
  constructor(private readonly frame: (now_ms: number) => boolean) {}

  /** Whether somebody may see them; so it is until told otherwise. */
  watch(isWatched: boolean): void {
    this.isWatched = isWatched;
    if (isWatched) this.wake();
  }

  /** Something happens that frames are for. */
  wake(): void {
    this.busy_ms = undefined;
    if (!this.isComing) this.ask();
  }

  /** There are no more. */
  close(): void {
    this.isOver = true;
  }

  private ask(): void {
    this.isComing = true;
    requestAnimationFrame((now_ms) => this.run(now_ms));
  }

  private run(now_ms: number): void {
    this.isComing = false;
    this.busy_ms ??= now_ms;
    const isAtRest = !this.isWatched && now_ms - this.busy_ms > REST_AFTER_MS;
    if (this.isOver || isAtRest) return;
    // First, so that a frame that fails is not the last.
    this.ask();
    if (this.frame(now_ms)) this.busy_ms = now_ms;
  }
}
