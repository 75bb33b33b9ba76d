/**
 * What does the line at the bottom of the element say? How much of the first picture is here; later, that one flies; and before that, that
 * something takes long, or that a link leads nowhere, with a button that leads to the start. A problem stays there, whatever happens
 * after it, until all is tried again, for which there may be a button; and that nothing can be drawn, until it can.
 */
import type { Announcer } from "../ui/announcer.ts";
import { write } from "../ui/dom.ts";
import { writeProgress } from "../ui/format.ts";
import type { Display, Moving, Readings } from "../ui/readings.ts";
import { isTouched } from "../ui/touch.ts";

const FLYING = "Flying: walls do not stop you.";
const TO_WALK = " F to walk.";

/** What may be said, the most urgent first. */
const URGENCY = ["dark", "problem", "offer", "delay", "progress", "manner"] as const;

type Kind = (typeof URGENCY)[number];

/** One thing that can be done. */
interface Way {
  readonly action: string;
  readonly act: () => void;
}

export class Caption implements Display {
  private complete = false;
  /** Whether the problem passes by itself. */
  private passes = false;
  private readonly said: Record<Kind, string> = {
    dark: "",
    problem: "",
    offer: "",
    delay: "",
    progress: "",
    manner: "",
  };
  /** What can be done about some of it. */
  private readonly ways = new Map<Kind, Way>();

  /**
   * `ready` is called when a first picture is complete, and `goes` before there is nothing for `button` to do any more, which does what can
   * be done about what is said; with it goes the focus if it had that. Who listens to the page hears all of it by `announcer` but the
   * progress, which changes several times a second.
   */
  constructor(
    private readonly line: HTMLElement,
    private readonly told: { readonly ready: () => void; readonly goes: () => void },
    private readonly button?: Pick<HTMLButtonElement, "hidden" | "textContent" | "onclick">,
    private readonly announcer?: Pick<Announcer, "say">,
  ) {
    if (button) button.onclick = () => this.act();
  }

  title(): void {}

  mode(mode: Moving): void {
    this.say("manner", mode === "fly" ? FLYING + (isTouched() ? "" : TO_WALK) : "");
  }

  show({ settled, progress }: Readings): void {
    if (this.complete) return;
    this.say("progress", !settled && progress ? writeProgress(progress) : "");
    if (!settled) return;
    this.complete = true;
    this.told.ready();
  }

  /** Another first picture is to come. */
  expect(): void {
    this.complete = false;
  }

  /** Says that something is wrong; `retry` tries it again, where that may be of use. */
  problem(text: string, passes = false, retry?: () => void): void {
    this.passes = passes;
    this.say("problem", text, retry && { action: "Try again", act: retry });
  }

  /** Says that nothing can be drawn, until it is given nothing to say. */
  dark(text = ""): void {
    this.say("dark", text);
  }

  /** Says that something takes long; nothing says that this is over. */
  delay(text = ""): void {
    this.say("delay", text);
  }

  /** Says something with one thing that can be done about it. */
  offer(text: string, action: string, act: () => void): void {
    this.say("offer", text, { action, act });
  }

  /** Offers nothing any more. */
  withdraw(): void {
    if (this.said.offer !== "") this.say("offer", "");
  }

  /** Whether there is a problem. */
  get hasFailed(): boolean {
    return this.said.problem !== "";
  }

  /** Is silent about what was wrong, since it is tried again. */
  forgive(): void {
    this.say("problem", "");
  }

  /** The server answers again. */
  answered(): void {
    if (this.passes) this.forgive();
  }

  private say(kind: Kind, text: string, way?: Way): void {
    this.said[kind] = text;
    if (kind !== "progress") this.announcer?.say(kind, text);
    if (way) this.ways.set(kind, way);
    else this.ways.delete(kind);
    const { foremost } = this;
    this.line.hidden = foremost === undefined;
    write(this.line, foremost ? this.said[foremost] : "");
    if (!this.button) return;
    const shown = foremost && this.ways.get(foremost);
    if (shown) this.button.textContent = shown.action;
    // What is hidden has lost the focus already.
    else if (!this.button.hidden) this.told.goes();
    this.button.hidden = shown === undefined;
  }

  private get foremost(): Kind | undefined {
    return URGENCY.find((one) => this.said[one] !== "");
  }

  private act(): void {
    const { foremost } = this;
    const way = foremost && this.ways.get(foremost);
    if (!way) return;
    this.say(foremost, "");
    way.act();
  }
}
