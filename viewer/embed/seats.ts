/**
 * Which of many elements on a page draw? Browsers give a page some 16 graphics contexts and take the oldest away without asking, and each
 * element needs one, with memory for what it shows. So a few draw at once: those in view, first come first served, and as long as there is
 * room those that were in view last. Who has been out of view for longest makes room for who comes into view.
 */

/** What may have a seat. */
export interface Seated {
  /** It may draw from now on. */
  draws(): void;
  /** Not any more; somebody else needs the room. */
  rests(): void;
}

export class Seats<T extends Seated> {
  /** All on the page: who has been out of view for longest first, and who came into view last at the end. */
  private order: T[] = [];
  private readonly inView = new Set<T>();
  private readonly drawing = new Set<T>();

  constructor(private readonly room: number) {}

  /** Comes to the page; nobody knows yet whether it is in view. */
  enters(one: T): void {
    if (!this.order.includes(one)) this.order.unshift(one);
    this.seat(one, this.drawing.size < this.room);
  }

  leaves(one: T): void {
    this.order = this.order.filter((other) => other !== one);
    this.inView.delete(one);
    if (this.drawing.delete(one)) this.fill();
  }

  /** Comes into view, or goes out of it. */
  sees(one: T, isInView: boolean): void {
    if (!this.order.includes(one) || this.inView.has(one) === isInView) return;
    if (isInView) this.inView.add(one);
    else this.inView.delete(one);
    this.order = [...this.order.filter((other) => other !== one), one];
    this.fill();
  }

  /** Whether it was in view when that was told last. */
  isInView(one: T): boolean {
    return this.inView.has(one);
  }

  /** Whether it may draw. */
  has(one: T): boolean {
    return this.drawing.has(one);
  }

  /** Who is in view draws as far as there is room, or others can make some. */
  private fill(): void {
    for (const one of this.order.filter((other) => this.inView.has(other) && !this.drawing.has(other))) {
      const idle = this.order.find((other) => this.drawing.has(other) && !this.inView.has(other));
      if (this.drawing.size >= this.room && idle) {
        this.drawing.delete(idle);
        idle.rests();
      }
      this.seat(one, this.drawing.size < this.room);
    }
  }

  private seat(one: T, mayDraw: boolean): void {
    if (!mayDraw || this.drawing.has(one)) return;
    this.drawing.add(one);
    one.draws();
  }
}
