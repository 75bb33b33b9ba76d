/**
 * What does the line at the bottom of the element say? How much of the first picture is here; later, that one flies; and before that, that
 * something takes long, or that a link leads nowhere, with a button that leads to the start. A problem stays there, whatever happens
 * after it, until all is tried again.
 */
import { write } from "../ui/dom.ts";
import { writeProgress } from "../ui/format.ts";
import type { Display, Moving, Readings } from "../ui/readings.ts";
import { isTouched } from "../ui/touch.ts";

const FLYING = "Flying: walls do not stop you.";
const TO_WALK = " F to walk.";

/** What may be said, the most urgent first. */
const URGENCY = ["problem", "offer", "delay", "progress", "manner"] as const;

export class Caption implements Display {
  private complete = false;
  /** Whether the problem passes by itself. */
  private passes = false;
  private readonly said: Record<(typeof URGENCY)[number], string> = {
    problem: "",
    offer: "",
    delay: "",
    progress: "",
    manner: "",
  };

  /** `ready` is called once, when the first picture is complete; `way` is the button of what is offered. */
  constructor(
    private readonly line: HTMLElement,
    private readonly ready: () => void,
    private readonly way?: Pick<HTMLButtonElement, "hidden" | "textContent" | "onclick">,
  ) {}

  title(): void {}

  mode(mode: Moving): void {
    this.say("manner", mode === "fly" ? FLYING + (isTouched() ? "" : TO_WALK) : "");
  }

  show({ settled, progress }: Readings): void {
    if (this.complete) return;
    this.say("progress", !settled && progress ? writeProgress(progress) : "");
    if (!settled) return;
    this.complete = true;
    this.ready();
  }

  problem(text: string, passes = false): void {
    this.passes = passes;
    this.say("problem", text);
  }

  /** Says that something takes long; nothing says that this is over. */
  delay(text = ""): void {
    this.say("delay", text);
  }

  /** Says something with one thing that can be done about it. */
  offer(text: string, action: string, act: () => void): void {
    if (this.way) {
      this.way.textContent = action;
      this.way.onclick = () => {
        this.withdraw();
        act();
      };
    }
    this.say("offer", text);
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

  private say(kind: (typeof URGENCY)[number], text: string): void {
    this.said[kind] = text;
    const foremost = URGENCY.find((one) => this.said[one] !== "");
    this.line.hidden = foremost === undefined;
    write(this.line, foremost ? this.said[foremost] : "");
    if (this.way) this.way.hidden = foremost !== "offer";
  }
}
