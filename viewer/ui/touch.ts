/** What do fingers do? */

/** Whether a finger is what one points with: then words speak of buttons and fingers, not of keys. */
export function isTouched(): boolean {
  return matchMedia("(pointer: coarse)").matches;
}

/** Whether somebody has enlarged the page with two fingers: then fingers move it, so that one gets about in it, and back. */
export function isEnlarged(): boolean {
  return (globalThis.visualViewport?.scale ?? 1) > 1.01;
}

/** Gives an element a class while the page is enlarged. */
export function markEnlarged(marked: HTMLElement): void {
  visualViewport?.addEventListener("resize", () => marked.classList.toggle("enlarged", isEnlarged()));
}
