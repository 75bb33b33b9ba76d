/**
 * How sharp can the picture be? A machine that draws slowly gets fewer pixels, one that draws quickly gets them back:
 * walking smoothly matters more than sharp edges.
 */

const SLOW_MS = 50;
const QUICK_MS = 20;
const GROW = 1.25;
/** Limits of one step down. */
const [SHRINK_MOST, SHRINK_LEAST] = [0.5, 0.8];
/** Frames in a row that must agree before the size changes. */
const PATIENCE = 3;

export class Resolution {
  private scale = 1;
  private slow = 0;
  private quick = 0;

  constructor(private readonly least: number) {}

  /** Takes in how long a drawn frame took; answers the share of the full width and height to draw with. */
  after(frame_ms: number): number {
    this.slow = frame_ms > SLOW_MS ? this.slow + 1 : 0;
    this.quick = frame_ms < QUICK_MS ? this.quick + 1 : 0;
    // Time goes with the number of pixels, the square of the scale.
    const fitting = Math.sqrt(SLOW_MS / Math.max(frame_ms, 1));
    if (this.slow >= PATIENCE) this.change(Math.min(SHRINK_LEAST, Math.max(SHRINK_MOST, fitting)));
    // Growing costs what shrinking saves, so be slow to grow: else the picture pumps.
    else if (this.quick >= PATIENCE * 15) this.change(GROW);
    return this.scale;
  }

  private change(factor: number): void {
    this.scale = Math.min(1, Math.max(this.least, this.scale * factor));
    this.slow = 0;
    this.quick = 0;
  }
}
