/** What is a world shown with? All that stands in the element, in a shadow tree. */
import { Announcer } from "../ui/announcer.ts";
import { make } from "../ui/dom.ts";
import type { DoorHintParts } from "../ui/doorhint.ts";
import { scrollByKeys } from "../ui/scrolling.ts";
import { Caption } from "./caption.ts";
import { Discretion } from "./discretion.ts";
import { STYLE } from "./style.ts";

export const HOW_TO_MOVE =
  "Move with W, A, S, D or the arrow keys; drag to look around, or press R and V; Enter opens and closes doors.";

export interface Furniture {
  readonly canvas: HTMLCanvasElement;
  /** Lies over the canvas, with the stick in it. */
  readonly over: HTMLElement;
  readonly stick: HTMLElement;
  readonly caption: Caption;
  /** What the picture shows, in words. */
  readonly picture: HTMLElement;
  readonly announcer: Pick<Announcer, "say">;
  readonly door: Pick<DoorHintParts, "button" | "label" | "padButton">;
}

/** Fills an element with it; `ready` is called when a first picture is complete. */
export function furnish(element: HTMLElement, ready: () => void): Furniture {
  const canvas = make("canvas", {
    tabindex: "0",
    role: "application",
    "aria-label": `A world. ${HOW_TO_MOVE}`,
    "aria-describedby": "picture",
  });
  const stick = make("div", { class: "stick", hidden: true, "aria-hidden": "true" }, make("i"));
  const over = make("div", { class: "over" }, stick);
  const picture = make("div", { class: "unseen", id: "picture" });
  const live = make("div", { class: "unseen", role: "status" });
  const announcer = new Discretion(new Announcer(live), () => element.matches(":focus-within"));
  canvas.addEventListener("focus", () => announcer.comes());
  const line = make("p");
  scrollByKeys(line);
  const way = make("button", { type: "button", hidden: true });
  const root = shadowOf(element);
  const goes = () => {
    if (root.activeElement === way) canvas.focus({ preventScroll: true });
  };
  const caption = new Caption(line, { ready, goes }, way, announcer);
  const [label, padButton] = [make("span"), make("kbd", { hidden: true })];
  const button = make("button", { type: "button", "aria-keyshortcuts": "Enter", hidden: true }, padButton, " ", label);
  root.replaceChildren(canvas, over, picture, live, make("div", { class: "caption" }, button, line, way));
  return { canvas, over, stick, caption, picture, announcer, door: { button, label, padButton } };
}

/** The shadow tree of an element, with its style. */
export function shadowOf(element: HTMLElement): ShadowRoot {
  if (element.shadowRoot) return element.shadowRoot;
  const root = element.attachShadow({ mode: "open" });
  const style = new CSSStyleSheet();
  style.replaceSync(STYLE);
  root.adoptedStyleSheets = [style];
  return root;
}
