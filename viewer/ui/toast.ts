/**
 * What is said at the bottom of the page while the walk goes on? That something could not be had, until that comes; that something takes
 * long, until that has ended; or something that one can do, which neither pushes away.
 */
import { passes } from "../core/fetch/losses.ts";
import type { Announcer } from "./announcer.ts";
import { explain, type Server } from "./problem.ts";

export interface ToastParts {
  /** Tells who listens to the page. */
  readonly announcer: Pick<Announcer, "say">;
  /** The line has gone, with the focus if it had that. */
  readonly gone: () => void;
  readonly line: { hidden: boolean | string };
  readonly text: { textContent: string | null };
  readonly action: { textContent: string | null; onclick: unknown; hidden: boolean | string };
  readonly close: { onclick: unknown };
}

type Shown = "nothing" | "offer" | "problem" | "delay";

export class Toast {
  private shown: Shown = "nothing";
  /** What is shown, when that is a problem. */
  private problem: unknown;

  constructor(private readonly parts: ToastParts) {
    parts.close.onclick = () => this.hide();
  }

  /** Says that something is missing, unless something can be done. */
  showProblem(error: unknown, server: Server, retry: () => void): void {
    if (this.shown === "offer") return;
    this.put("problem", explain(error, server).text, { action: "Try again", act: retry });
    this.problem = error;
  }

  /** Says something, with one thing that can be done about it. */
  show(text: string, action: string, act: () => void): void {
    this.put("offer", text, { action, act });
  }

  /** Says that something takes long, unless more is to be said; nothing says that this is over. */
  showDelay(text: string | undefined): void {
    if (text === undefined) this.hide("delay");
    else if (this.shown === "nothing" || this.shown === "delay") this.put("delay", text);
  }

  /** Says no more that something cannot be reached. */
  answered(): void {
    if (passes(this.problem)) this.hide("problem");
  }

  /** Says nothing of what is tried again. */
  retried(): void {
    this.hide("problem");
  }

  private put(shown: Shown, text: string, offer?: { readonly action: string; readonly act: () => void }): void {
    const { parts } = this;
    // That something takes long is said once, and not at each try.
    if (shown !== "delay" || this.shown !== "delay") parts.announcer.say("toast", text);
    this.problem = undefined;
    this.shown = shown;
    parts.text.textContent = text;
    parts.action.hidden = offer === undefined;
    if (offer) parts.action.textContent = offer.action;
    parts.action.onclick = () => {
      this.hide();
      offer?.act();
    };
    parts.line.hidden = false;
  }

  /** Whatever is shown, or only this. */
  private hide(shown = this.shown): void {
    if (shown !== this.shown) return;
    this.problem = undefined;
    this.shown = "nothing";
    const { line, announcer, gone } = this.parts;
    line.hidden = true;
    announcer.say("toast", "");
    gone();
  }
}
