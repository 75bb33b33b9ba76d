/**
 * What comes of pointing at an object? While the inspector is open it shows what the object is made of; else a door opens or closes.
 * Who has no pointer points at the middle of the view.
 */
import type { PlacedObject } from "../core/documents/placedobject.ts";

export interface PointingParts {
  /** The object at a point of the canvas, in CSS pixels. */
  readonly pick: (x: number, y: number) => PlacedObject | undefined;
  readonly canvas: { readonly clientWidth: number; readonly clientHeight: number };
  readonly inspector: { readonly open: boolean; show(object: PlacedObject | undefined): void };
  /** Whether what is shown may be used, and does not just stand there to be looked at. */
  readonly isLive: () => boolean;
  readonly use: (object: PlacedObject) => void;
}

export class Pointing {
  constructor(private readonly parts: PointingParts) {}

  /** A click or a tap. */
  tap(x: number, y: number): void {
    const { pick, inspector, isLive, use } = this.parts;
    const object = pick(x, y);
    if (inspector.open) inspector.show(object);
    else if (object && isLive()) use(object);
  }

  /** A key: looks behind what is in the middle of the view; answers whether the inspector is open for that. */
  inspect(): boolean {
    const { canvas, inspector } = this.parts;
    if (inspector.open) this.tap(canvas.clientWidth / 2, canvas.clientHeight / 2);
    return inspector.open;
  }
}
