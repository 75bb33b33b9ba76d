/** How much of the picture does a panel cover? So that what one is shown is in the middle of the rest. */
import type { Covered } from "../three/stage.ts";

/** Of a picture with a panel at its right or along its bottom; the larger rest counts. */
export function coveredBy(
  panel: { readonly left: number; readonly top: number },
  picture: { readonly width: number; readonly height: number },
): Covered {
  const [left, top] = [Math.max(0, panel.left), Math.max(0, panel.top)];
  const { width, height } = picture;
  return left * height >= top * width
    ? { right_px: Math.max(0, width - left), bottom_px: 0 }
    : { right_px: 0, bottom_px: Math.max(0, height - top) };
}
