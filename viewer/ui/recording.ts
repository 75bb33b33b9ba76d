/**
 * How does one take a walk along? Takes down which way one goes from when its key, its button in the inspector or code says
 * so, and hands that over as a file that `belvedere walk --script` reads.
 */
import { WalkRecorder } from "../core/movement/walkrecorder.ts";
import type { Announcer } from "./announcer.ts";
import { make, write } from "./dom.ts";
import { element } from "./elements.ts";
import { keepFocus } from "./focus.ts";
import { writeTime } from "./format.ts";
import type { Visit } from "./visit.ts";

export class Recording {
  private readonly button = element("recording", HTMLButtonElement);
  private readonly label = element("recording-text", HTMLSpanElement);
  private recorder: WalkRecorder | undefined;

  constructor(
    private readonly visit: Visit,
    private readonly announcer: Announcer,
  ) {
    this.button.onclick = () => this.toggle();
    visit.onFrame((now_ms) => {
      this.observe(now_ms);
      if (this.recorder) write(this.label, `${this.told}. Stop and save`);
      return false;
    });
  }

  get isRunning(): boolean {
    return this.recorder !== undefined;
  }

  /** How long it has been going on, in words. */
  get told(): string {
    return `Recording ${writeTime(this.recorder?.length_ms ?? 0)}`;
  }

  /** Begins anew, where one is now: also who ends it before the next frame has a way. */
  start(): void {
    this.recorder = new WalkRecorder();
    this.observe(performance.now());
    this.button.hidden = false;
    this.announcer.say("recording", "Your way is being recorded");
  }

  /** Ends it; answers JSON lines, nothing when none was under way. */
  stop(): string {
    const script = this.recorder?.script() ?? "";
    this.recorder = undefined;
    this.button.hidden = true;
    keepFocus();
    this.announcer.say("recording", "");
    return script;
  }

  /** Begins, or ends and hands over a file. */
  toggle(): void {
    if (!this.isRunning) this.start();
    else this.handOver(this.stop());
  }

  /** A frozen view is left by the eye alone; nobody walks there. */
  private observe(now_ms: number): void {
    if (!this.visit.frozen) this.recorder?.observe(now_ms, this.visit.walker);
  }

  private handOver(script: string): void {
    if (script === "") return;
    const href = URL.createObjectURL(new Blob([script], { type: "application/jsonl" }));
    make("a", { href, download: `${this.visit.explorer.scene.pointer.scene}-walk.jsonl` }).click();
    // The browser has begun to read by then.
    setTimeout(() => URL.revokeObjectURL(href), 10_000);
  }
}
