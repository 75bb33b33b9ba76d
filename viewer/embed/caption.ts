/**
 * What does the line at the bottom of the element say? How much of the first picture is here; later, that one flies. A
 * problem stays there, whatever happens after it, until all is tried again.
 */
import { write } from "../ui/dom.ts";
import { writeProgress } from "../ui/format.ts";
import type { Display, Moving, Readings } from "../ui/readings.ts";

const FLYING = "Flying: walls do not stop you. F to walk.";

export class Caption implements Display {
  private complete = false;
  private failed = false;
  /** Whether the problem passes by itself. */
  private passes = false;
  private manner = "";

  /** `ready` is called once, when the first picture is complete. */
  constructor(
    private readonly line: HTMLElement,
    private readonly ready: () => void,
  ) {}

  title(): void {}

  mode(mode: Moving): void {
    this.manner = mode === "fly" ? FLYING : "";
    this.say(this.manner);
  }

  show({ settled, progress }: Readings): void {
    if (this.complete) return;
    this.say(!settled && progress ? writeProgress(progress) : this.manner);
    if (!settled) return;
    this.complete = true;
    this.ready();
  }

  problem(text: string, passes = false): void {
    this.failed = true;
    this.passes = passes;
    this.put(text);
  }

  /** Whether there is a problem. */
  get hasFailed(): boolean {
    return this.failed;
  }

  /** Is silent about what was wrong, since it is tried again. */
  forgive(): void {
    this.failed = false;
    this.put("");
  }

  /** The server answers again. */
  answered(): void {
    if (this.failed && this.passes) this.forgive();
  }

  private say(text: string): void {
    if (!this.failed) this.put(text);
  }

  private put(text: string): void {
    this.line.hidden = text === "";
    write(this.line, text);
  }
}
