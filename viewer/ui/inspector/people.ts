/** Who is told of, from how far, and how often? The two circles of the area of interest, and discs under people's feet. */
import type { Meeting } from "../../core/live/joining.ts";
import { AOI } from "../../core/live/session.ts";
import { rateColour } from "../../three/avatars.ts";
import { circle, type Ink } from "../../three/overlay.ts";
import type { LiveCompany } from "../company.ts";
import { make, write } from "../dom.ts";
import type { Visit } from "../visit.ts";
import { type Section, section, toggle } from "./section.ts";

const CIRCLE: Ink = { color: 0x74c98a, line: 0.9, fill: 0, through: true };
const OUTER: Ink = { ...CIRCLE, line: 0.4 };
/** Circles lie this much below the eye. */
const BELOW_M = 1.2;
/** How far the eye may go before they are drawn anew. */
const REDRAW_M = 0.1;

/** Why nobody is met, or heard of. */
const ALONE: Readonly<Record<Exclude<Meeting, "met"> | "seen", string>> = {
  away: "The server does not say who else is here: one is alone until it does, and it is asked again.",
  seen: "The server does not say just now who else is here: who is drawn stands where it was last heard of.",
  never: "This tree has no live sessions: one is alone.",
};

export class People implements Section {
  readonly element: HTMLElement;
  private readonly text = make("p", { class: "note", "data-testid": "people-told" });
  private shown = false;
  private drawnAt = "";

  constructor(
    private readonly visit: Visit,
    private readonly company: LiveCompany,
  ) {
    const colours = [100, 300, 1000].map(rateColour);
    this.element = section(
      "People",
      this.text,
      toggle("Area of interest; 10, 3 and 1 update a second", false, (on) => this.show(on), colours),
    );
  }

  show(on: boolean): void {
    this.shown = on;
    this.company.showRates = on;
    this.drawnAt = "";
    this.update();
  }

  update(): void {
    const { movers, meeting } = this.company;
    const rates = movers.map(({ period_ms }) => 1000 / period_ms).sort((a, b) => b - a);
    const [most, least] = [rates[0]?.toFixed(1), rates.at(-1)?.toFixed(1)];
    const often = most ? `, told of at most ${most === least ? most : `${least} to ${most}`} times a second` : "";
    const isSeen = meeting === "away" && movers.length > 0;
    write(this.text, meeting === "met" ? `${movers.length} in sight${often}.` : ALONE[isSeen ? "seen" : meeting]);
    this.draw();
  }

  private draw(): void {
    const eye = this.visit.explorer.eyeNow;
    if (!this.shown || !eye) {
      this.clear();
      return;
    }
    const [x, y, z] = eye.position;
    const place = [x, y, z].map((value) => Math.round(value / REDRAW_M)).join();
    if (place === this.drawnAt) return;
    this.drawnAt = place;
    const middle = [x, y - BELOW_M, z] as const;
    this.visit.overlay.set("interest", [...circle(middle, AOI.enter_m, CIRCLE), ...circle(middle, AOI.leave_m, OUTER)]);
    this.visit.redraw();
  }

  clear(): void {
    if (this.drawnAt === "gone") return;
    this.drawnAt = "gone";
    this.visit.overlay.set("interest", []);
    this.visit.redraw();
  }
}
