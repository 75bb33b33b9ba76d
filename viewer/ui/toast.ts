/**
 * What is said at the bottom of the page while the walk goes on? That something could not be had, until that comes; or something that
 * one can do, which a problem does not push away.
 */
import { passes } from "../core/losses.ts";
import { explain, type Server } from "./problem.ts";

export interface ToastParts {
  readonly line: { hidden: boolean | string };
  readonly text: { textContent: string | null };
  readonly action: { textContent: string | null; onclick: unknown };
  readonly close: { onclick: unknown };
}

export class Toast {
  /** What is shown, when that is a problem. */
  private problem: unknown;

  constructor(private readonly parts: ToastParts) {
    parts.close.onclick = () => this.hide();
  }

  /** Says that something is missing, unless something can be done. */
  showProblem(error: unknown, server: Server, retry: () => void): void {
    if (!this.parts.line.hidden && this.problem === undefined) return;
    this.show(explain(error, server).text, "Try again", retry);
    this.problem = error;
  }

  /** Says something, with one thing that can be done about it. */
  show(text: string, action: string, act: () => void): void {
    const { parts } = this;
    this.problem = undefined;
    parts.text.textContent = text;
    parts.action.textContent = action;
    parts.action.onclick = () => {
      this.hide();
      act();
    };
    parts.line.hidden = false;
  }

  /** Says no more that something cannot be reached. */
  answered(): void {
    if (passes(this.problem)) this.hide();
  }

  /** Says nothing of what is tried again. */
  retried(): void {
    if (this.problem !== undefined) this.hide();
  }

  private hide(): void {
    this.problem = undefined;
    this.parts.line.hidden = true;
  }
}
