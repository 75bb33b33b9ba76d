/** How is a piece of the page made in code? */

type Child = Node | string;

/** An element with attributes and children; `true` stands for an attribute without a value, `false` for none. */
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Readonly<Record<string, string | boolean>> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    // An attribute `style` would need a page that lets anybody's styles stand inline.
    if (name === "style") made.style.cssText = String(value);
    else if (value !== false) made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children);
  return made;
}

/** Sets a text only where it differs, so that screen readers and layout are left alone. */
export function write(target: HTMLElement, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}
