/** How does one learn what can be done here? A panel with all keys, and one line for who has just come. */
import { element } from "./elements.ts";
import { Disclosure, keepFocus } from "./focus.ts";

export class HelpPanel {
  private readonly panel = element("help", HTMLElement);
  private readonly button = element("help-toggle", HTMLButtonElement);
  private readonly intro = element("intro", HTMLParagraphElement);
  private readonly disclosure = new Disclosure(this.panel);

  /** Hears of opening and closing. */
  constructor(private readonly toggled: (open: boolean) => void) {
    this.button.onclick = () => this.toggle();
    element("help-close", HTMLButtonElement).onclick = () => this.toggle(false);
  }

  get open(): boolean {
    return this.disclosure.open;
  }

  /** Opens or closes it. Opening gives it the focus, and closing gives that back. */
  toggle(open = !this.open): void {
    if (open === this.open) return;
    this.disclosure.open = open;
    this.button.setAttribute("aria-expanded", String(open));
    this.toggled(open);
    if (open) {
      this.welcomed();
      this.panel.focus({ preventScroll: true });
    }
    keepFocus();
  }

  /** Who has found out how to move needs no first line any more. */
  welcomed(): void {
    this.intro.hidden = true;
  }
}
