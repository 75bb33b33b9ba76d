/**
 * What does an element show that does not draw? Its last picture, or nothing where there was none yet. Keys reach that too: with the focus it
 * comes into view, and draws.
 */
import { shadowOf } from "./furniture.ts";

const WAITS = "A world, which is drawn when it comes into view";

/** Fills an element with a picture. */
export function showPoster(element: HTMLElement, picture = document.createElement("canvas")): HTMLCanvasElement {
  picture.className = "poster";
  picture.setAttribute("role", "img");
  picture.setAttribute("aria-label", WAITS);
  picture.removeAttribute("aria-hidden");
  picture.tabIndex = 0;
  shadowOf(element).replaceChildren(picture);
  return picture;
}

/** Leaves a picture in sight above a canvas that is not drawn on yet, and to which keys and screen readers go. */
export function coverWith(canvas: HTMLCanvasElement, picture: HTMLCanvasElement): void {
  picture.setAttribute("aria-hidden", "true");
  picture.removeAttribute("tabindex");
  canvas.after(picture);
}
