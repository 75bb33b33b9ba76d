/**
 * What does a walker want to know at a glance? The cell, how much of the scene is visible from it, bytes fetched against
 * the whole scene, and exactly how much of this cell is still to come.
 */
import { shareOf } from "../core/strategy/progress.ts";
import type { Announcer } from "./announcer.ts";
import { write } from "./dom.ts";
import { element } from "./elements.ts";
import { writeProgress, writeShare, writeVisible } from "./format.ts";
import type { Display, Moving, Readings } from "./readings.ts";
import { isTouched } from "./touch.ts";

/** With keys and a mouse, and with fingers. */
const MODES: Readonly<Record<Moving, readonly [keys: string, touch: string]>> = {
  walk: ["Walking: walls stop you.", "Walking: walls stop you."],
  fly: [
    "Flying: walls do not stop you. F or the button: walk.",
    "Flying: walls do not stop you. The button with the arrow: walk.",
  ],
  frozen: [
    "Frozen: what is shown stays as it is. G or the inspector: go on.",
    "Frozen: what is shown stays as it is. The inspector: go on.",
  ],
};

export class Hud implements Display {
  private readonly cell = element("cell", HTMLSpanElement);
  private readonly whereabouts = element("whereabouts", HTMLSpanElement);
  private readonly visible = element("visible", HTMLElement);
  private readonly bytes = element("bytes", HTMLElement);
  private readonly loading = element("loading", HTMLDivElement);
  private readonly progress = element("progress", HTMLProgressElement);
  private readonly progressText = element("progress-text", HTMLSpanElement);

  constructor(private readonly announcer: Announcer) {}

  title(text: string): void {
    element("title", HTMLHeadingElement).textContent = text;
    element("view", HTMLCanvasElement).setAttribute("aria-label", text);
    document.title = `${text} · Belvedere`;
  }

  show(readings: Readings): void {
    const cell = readings.cell === undefined ? "–" : `c${readings.cell}`;
    const visible = writeVisible(readings.visible, readings.objects);
    write(this.cell, cell);
    write(this.whereabouts, readings.cell === undefined || readings.inside ? "" : "is nearest");
    write(this.visible, visible);
    write(this.bytes, writeShare(readings.fetched_bytes, readings.whole_bytes));
    const { progress } = readings;
    this.loading.classList.toggle("done", readings.settled);
    this.progress.value = shareOf(progress);
    write(this.progressText, progress ? writeProgress(progress) : "looking around");
    if (readings.settled) this.announcer.say("cell", `Cell ${cell}, ${visible}`);
  }

  /** How many other people are in sight. */
  people(count: number): void {
    element("people-row", HTMLDivElement).hidden = count === 0;
    write(element("people", HTMLElement), count === 1 ? "one other person" : `${count} other people`);
  }

  mode(mode: Moving): void {
    // What is frozen is flown around in.
    const isFlying = mode !== "walk";
    const note = element("mode", HTMLParagraphElement);
    note.hidden = !isFlying;
    const text = MODES[mode][isTouched() ? 1 : 0];
    write(note, text);
    this.announcer.say("mode", text);
    for (const words of document.querySelectorAll<HTMLElement>("[data-mode]")) {
      words.hidden = (words.dataset.mode === "fly") !== isFlying;
    }
    const toggle = element("fly-toggle", HTMLButtonElement);
    toggle.setAttribute("aria-pressed", String(isFlying));
    toggle.disabled = mode === "frozen";
  }
}
