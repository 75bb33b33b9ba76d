/** What is a part of the inspector? Something with a heading that is brought up to date a few times a second. */
import { make } from "../dom.ts";

export interface Section {
  readonly element: HTMLElement;
  update(now_ms: number): void;
}

/** A part that can be folded away. */
export function section(title: string, ...content: (Node | string)[]): HTMLElement {
  return make("details", { open: true }, make("summary", {}, make("h3", {}, title)), ...content);
}

/** A labelled switch; `changed` hears of every change. */
export function toggle(label: string, on: boolean, changed: (on: boolean) => void, swatches: readonly string[] = []) {
  const box = make("input", { type: "checkbox", checked: on });
  box.onchange = () => changed(box.checked);
  const colours = swatches.map((colour) => make("i", { class: "swatch", style: `background:${colour}` }));
  return make("label", { class: "toggle" }, box, make("span", {}, label), ...colours);
}
