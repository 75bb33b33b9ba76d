/** How does one read all of a text that is longer than its place? It can be reached by keys while it is, and scrolled by them (`keys.ts`). */

/** `text` has a largest height, in which it scrolls. */
export function scrollByKeys(text: HTMLElement): void {
  text.dataset.scrolls = "";
  const look = () => {
    // What all of can be seen is no stop on the way.
    if (text.scrollHeight > text.clientHeight) text.tabIndex = 0;
    else text.removeAttribute("tabindex");
  };
  new ResizeObserver(look).observe(text);
  // The next text may be as high as its place, too.
  new MutationObserver(() => {
    text.scrollTop = 0;
    look();
  }).observe(text, { childList: true, characterData: true, subtree: true });
}
