/** How full is the memory, what goes next, and what stays on this device when the page is left? */
import { make, write } from "../dom.ts";
import { writeBytes } from "../format.ts";
import type { Visit } from "../visit.ts";
import { type Section, section } from "./section.ts";

/** So many of those that would go are named. */
const NAMED = 3;

export class Memory implements Section {
  readonly element: HTMLElement;
  private readonly held = make("i", { style: "background:var(--gold)" });
  private readonly promised = make("i", { style: "background:#7fb2e5" });
  private readonly text = make("p", { class: "note", "data-testid": "memory" });
  private readonly next = make("p", { class: "note" });
  private readonly kept = make("p", { class: "note", "data-testid": "kept" });
  private readonly clear = make("button", { type: "button", "data-testid": "clear-kept" }, "Forget what is kept");

  constructor(private readonly visit: Visit) {
    const gauge = make("div", { class: "gauge", "aria-hidden": "true" }, this.held, this.promised);
    this.element = section("Memory", gauge, this.text, this.next, this.kept, this.clear);
    const { shelf } = visit.explorer.scene.queue;
    this.clear.hidden = shelf === undefined;
    this.clear.onclick = () => void shelf?.clear().then(() => this.tellKept());
  }

  update(): void {
    const { residency } = this.visit.explorer;
    const { bytes, promised_bytes, limit_bytes } = residency;
    const width = (share_bytes: number) => `${Math.min(100, (100 * share_bytes) / limit_bytes).toFixed(2)}%`;
    this.held.style.width = width(bytes);
    this.promised.style.width = width(promised_bytes);
    write(
      this.text,
      `${writeBytes(bytes)} held, ${writeBytes(promised_bytes)} promised, limit ${writeBytes(limit_bytes)}; ${residency.size} models`,
    );
    const leaving = residency.inOrderOfLeaving();
    const names = leaving.slice(0, NAMED).map(({ model, part, bytes }) => {
      return `${part === "detail" ? "what is finer of " : ""}m${model} (${writeBytes(bytes)})`;
    });
    const more = leaving.length > NAMED ? ` and ${leaving.length - NAMED} more` : "";
    write(
      this.next,
      leaving.length === 0 ? "Nothing could go: all of it is visible." : `Next to go: ${names.join(", ")}${more}.`,
    );
    this.tellKept();
  }

  private tellKept(): void {
    const { shelf, tally } = this.visit.explorer.scene.queue;
    if (!shelf) {
      write(this.kept, "This page keeps nothing from visit to visit: that takes https or localhost.");
      return;
    }
    const { bytes, size, limit_bytes } = shelf;
    const kept = `Kept for the next visit: ${writeBytes(bytes)} of at most ${writeBytes(limit_bytes)}, ${size} objects`;
    write(this.kept, `${kept}; ${writeBytes(tally.kept_bytes)} of them were of use in this one.`);
  }
}
