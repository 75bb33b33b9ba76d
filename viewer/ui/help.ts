/** How does one learn what can be done here? A panel with all keys, and one line for who has just come. */
import { element } from "./elements.ts";

export class HelpPanel {
  private readonly panel = element("help", HTMLElement);
  private readonly button = element("help-toggle", HTMLButtonElement);
  private readonly intro = element("intro", HTMLParagraphElement);
  private before: Element | null = null;

  /** Hears of opening and closing. */
  constructor(private readonly toggled: (open: boolean) => void) {
    this.button.onclick = () => this.toggle();
    element("help-close", HTMLButtonElement).onclick = () => this.toggle(false);
  }

  get open(): boolean {
    return !this.panel.hidden;
  }

  /** Opens or closes it. It has the focus while it is open; then what had it before. */
  toggle(open = !this.open): void {
    if (open === this.open) return;
    if (open) this.before = document.activeElement;
    this.panel.hidden = !open;
    this.button.setAttribute("aria-expanded", String(open));
    this.toggled(open);
    if (open) {
      this.welcomed();
      this.panel.focus({ preventScroll: true });
    } else if (this.before instanceof HTMLElement) this.before.focus({ preventScroll: true });
  }

  /** Who has found out how to move needs no first line any more. */
  welcomed(): void {
    this.intro.hidden = true;
  }
}
