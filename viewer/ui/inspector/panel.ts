/** How does one look behind the picture? The inspector's panel, which is brought up to date only while it is open. */
import type { RequestLog } from "../../core/requestlog.ts";
import type { Throttle } from "../../core/throttle.ts";
import { make } from "../dom.ts";
import type { Visit } from "../visit.ts";
import { Ladder } from "./ladder.ts";
import { Layers } from "./layers.ts";
import { Loading } from "./loading.ts";
import { Memory } from "./memory.ts";
import { Requests } from "./requests.ts";
import type { Section } from "./section.ts";

export interface PanelParts {
  readonly visit: Visit;
  readonly log: RequestLog;
  readonly throttle: Throttle;
  /** Hears of opening and closing. */
  readonly toggled: (open: boolean) => void;
}

const UPDATE_EVERY_MS = 250;

export class InspectorPanel {
  readonly element = make("aside", { id: "inspector", class: "card", "aria-label": "Inspector", hidden: true });
  private readonly layers: Layers;
  private readonly ladder: Ladder;
  private readonly sections: readonly Section[];
  private timer: ReturnType<typeof setInterval> | undefined;

  constructor(private readonly parts: PanelParts) {
    const { visit, log, throttle } = parts;
    this.layers = new Layers(visit);
    this.ladder = new Ladder(visit);
    this.sections = [new Loading(visit), this.layers, this.ladder, new Memory(visit), new Requests(log, throttle)];
    const close = make("button", { type: "button", class: "close", "aria-label": "Close the inspector" }, "×");
    close.onclick = () => this.toggle(false);
    this.element.append(make("header", {}, make("h2", {}, "Inspector"), close));
    this.element.append(...this.sections.map(({ element }) => element));
  }

  get open(): boolean {
    return !this.element.hidden;
  }

  toggle(open = !this.open): void {
    if (open === this.open) return;
    this.element.hidden = !open;
    clearInterval(this.timer);
    if (open) {
      this.timer = setInterval(() => this.update(), UPDATE_EVERY_MS);
      this.update();
    } else {
      this.ladder.pick(undefined);
      this.layers.clear();
    }
    this.parts.toggled(open);
  }

  toggleFreeze(): void {
    this.toggle(true);
    this.layers.toggleFreeze();
  }

  /** Shows what the object at a point of the canvas is made of. */
  pickAt(x: number, y: number): void {
    if (this.open) this.ladder.pick(this.parts.visit.pick(x, y));
  }

  private update(): void {
    const now_ms = performance.now();
    for (const section of this.sections) section.update(now_ms);
  }
}
