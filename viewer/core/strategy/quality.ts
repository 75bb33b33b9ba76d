/**
 * How good was the picture over time? The download quality of Marvie & Bouatouch (A VRML97-X3D extension for massive
 * scenery management in virtual worlds, 2004, §7), the share of what is visible that is here, and beside it the share
 * that is here as finely as the eye can tell.
 */
export interface QualitySample {
  readonly t_ms: number;
  /** Shares of the visible objects, 0 to 1; `undefined` while it is not known what is visible. */
  readonly here: number | undefined;
  readonly sharp: number | undefined;
}

export class QualityHistory {
  private readonly kept: QualitySample[] = [];

  constructor(
    private readonly every_ms: number,
    private readonly span_ms: number,
  ) {}

  /** Oldest first. */
  get samples(): readonly QualitySample[] {
    return this.kept;
  }

  /** Takes a sample when the last one is old enough; `measure` is called only then. */
  sample(t_ms: number, measure: () => { here: number; sharp: number } | undefined): void {
    const last = this.kept.at(-1);
    if (last && t_ms - last.t_ms < this.every_ms) return;
    const shares = measure();
    this.kept.push({ t_ms, here: shares?.here, sharp: shares?.sharp });
    while (this.kept[0] && t_ms - this.kept[0].t_ms > this.span_ms) this.kept.shift();
  }
}
