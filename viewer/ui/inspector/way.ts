/** How does one take down which way one goes? */
import { make, write } from "../dom.ts";
import type { Recording } from "../recording.ts";
import { type Section, section } from "./section.ts";

export class Way implements Section {
  readonly element: HTMLElement;
  private readonly button = make("button", { type: "button", "data-testid": "record" });
  private readonly note = make("p", { class: "note" });

  constructor(private readonly recording: Recording) {
    this.button.onclick = () => {
      recording.toggle();
      this.update();
    };
    this.element = section("Your way", this.button, this.note);
  }

  update(): void {
    const { isRunning, told } = this.recording;
    write(this.button, isRunning ? "Stop and save" : "Record your way");
    write(this.note, isRunning ? `${told}.` : "As a file that “belvedere walk --script” reads.");
  }
}
