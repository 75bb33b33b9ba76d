/** What does an element show that does not draw? Its last picture, or nothing where there was none yet. */
import { shadowOf } from "./furniture.ts";

const WAITS = "A world, which is drawn when it comes into view";

/** Fills an element with a picture. */
export function showPoster(element: HTMLElement, picture = document.createElement("canvas")): HTMLCanvasElement {
  picture.className = "poster";
  picture.setAttribute("role", "img");
  picture.setAttribute("aria-label", WAITS);
  shadowOf(element).replaceChildren(picture);
  return picture;
}
