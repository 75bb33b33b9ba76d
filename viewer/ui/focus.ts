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

/** Shows and hides a panel. Who is in it when it goes is where they were when it came. */
export class Disclosure {
  private before: Element | null = null;

  constructor(private readonly panel: HTMLElement) {}

  get open(): boolean {
    return !this.panel.hidden;
  }

  set open(open: boolean) {
    const { activeElement } = document;
    const hadFocus = this.panel.contains(activeElement);
    if (open) this.before = activeElement;
    this.panel.hidden = !open;
    if (hadFocus && this.before instanceof HTMLElement) this.before.focus({ preventScroll: true });
  }
}

/** Who clicks a button goes on walking by keys, and does not press it again with Enter. A click by a key counts no clicks. */
export function giveBackFocus(panels: HTMLElement): void {
  panels.addEventListener("click", ({ detail, target }) => {
    if (detail > 0 && target instanceof Element && target.closest("button")) focusWorld();
  });
}
