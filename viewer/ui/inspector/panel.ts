/** How does one look behind the picture? The inspector's panel, which is brought up to date only while it is open. */
import type { PlacedObject } from "../../core/documents/placedobject.ts";
import type { RequestLog } from "../../core/fetch/requestlog.ts";
import type { Throttle } from "../../core/fetch/throttle.ts";
import type { Announcer } from "../announcer.ts";
import { coveredBy } from "../beside.ts";
import type { LiveCompany } from "../company.ts";
import { make } from "../dom.ts";
import { Disclosure } from "../focus.ts";
import type { Recording } from "../recording.ts";
import type { Visit } from "../visit.ts";
import { Ladder } from "./ladder.ts";
import { Layers } from "./layers.ts";
import { Loading } from "./loading.ts";
import { Memory } from "./memory.ts";
import { People } from "./people.ts";
import { Requests } from "./requests.ts";
import type { Section } from "./section.ts";
import { Way } from "./way.ts";

export interface PanelParts {
  readonly visit: Visit;
  readonly company: LiveCompany;
  readonly recording: Recording;
  /** Tells a screen reader what was picked. */
  readonly announcer: Announcer;
  readonly log: RequestLog;
  readonly throttle: Throttle;
  /** Hears of opening and closing. */
  readonly toggled: (open: boolean) => void;
}

const UPDATE_EVERY_MS = 250;

export class InspectorPanel {
  readonly element = make("aside", {
    id: "inspector",
    class: "card",
    "aria-label": "Inspector",
    "data-scrolls": true,
    hidden: true,
  });
  private readonly disclosure = new Disclosure(this.element);
  private readonly layers: Layers;
  private readonly ladder: Ladder;
  private readonly people: People;
  private readonly sections: readonly Section[];
  private timer: ReturnType<typeof setInterval> | undefined;

  constructor(private readonly parts: PanelParts) {
    const { visit, company, recording, announcer, log, throttle } = parts;
    this.layers = new Layers(visit, () =>
      coveredBy(this.element.getBoundingClientRect(), document.documentElement.getBoundingClientRect()),
    );
    this.ladder = new Ladder(visit, announcer);
    this.people = new People(visit, company);
    this.sections = [
      new Loading(visit),
      this.layers,
      this.ladder,
      this.people,
      new Memory(visit),
      new Way(recording),
      new Requests(log, throttle),
    ];
    const close = make("button", { type: "button", class: "close", "aria-label": "Close the inspector" }, "×");
    close.onclick = () => this.toggle(false);
    this.element.append(make("header", {}, make("h2", {}, "Inspector"), close));
    this.element.append(...this.sections.map(({ element }) => element));
  }

  get open(): boolean {
    return this.disclosure.open;
  }

  toggle(open = !this.open): void {
    if (open === this.open) return;
    this.disclosure.open = open;
    clearInterval(this.timer);
    if (open) {
      this.timer = setInterval(() => this.update(), UPDATE_EVERY_MS);
      this.update();
    } else {
      this.ladder.pick(undefined);
      this.layers.clear();
      this.people.clear();
    }
    this.parts.toggled(open);
  }

  toggleFreeze(): void {
    this.toggle(true);
    this.layers.toggleFreeze();
  }

  /** Shows what an object is made of. */
  show(object: PlacedObject | undefined): void {
    if (!this.open) return;
    this.ladder.pick(object);
    this.ladder.announce();
  }

  private update(): void {
    const now_ms = performance.now();
    for (const section of this.sections) section.update(now_ms);
  }
}
