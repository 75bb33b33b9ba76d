/** Where do keys go? To the world, unless somebody who walks through the page by keys is elsewhere. */
import { element } from "./elements.ts";

export function focusWorld(): void {
  element("view", HTMLCanvasElement).focus({ preventScroll: true });
}

/** Gives the focus to the world when what had it is no longer shown. */
export function keepFocus(): void {
  const { activeElement } = document;
  if (!activeElement || activeElement === document.body || activeElement.getClientRects().length === 0) focusWorld();
}

/** Who clicks a button goes on walking by keys, and does not press it again with Enter. A click by a key counts no clicks. */
export function giveBackFocus(panels: HTMLElement): void {
  panels.addEventListener("click", ({ detail, target }) => {
    if (detail > 0 && target instanceof Element && target.closest("button")) focusWorld();
  });
}
