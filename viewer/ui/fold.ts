/** How is a panel folded away? By its button; what the person chose is remembered on this device. */
import { recall, remember } from "./remembering.ts";

const REMEMBERED = "belvedere.unfolded.";

export class Fold {
  private readonly name: string;

  /**
   * `content` has an id. It is unfolded at first when `open` says so and the person did not choose otherwise; `toggled` hears of
   * later changes.
   */
  constructor(
    private readonly button: HTMLButtonElement,
    private readonly content: HTMLElement,
    open: boolean,
    private readonly toggled: (open: boolean) => void,
  ) {
    this.name = REMEMBERED + content.id;
    button.setAttribute("aria-controls", content.id);
    button.onclick = () => {
      this.toggle();
      remember("device", this.name, String(this.open));
    };
    const chosen = recall("device", this.name);
    this.show(chosen ? chosen === "true" : open);
  }

  get open(): boolean {
    return !this.content.hidden;
  }

  toggle(open = !this.open): void {
    if (open === this.open) return;
    this.show(open);
    this.toggled(open);
  }

  private show(open: boolean): void {
    this.content.hidden = !open;
    this.button.setAttribute("aria-expanded", String(open));
  }
}
