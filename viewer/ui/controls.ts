/**
 * What does the person at the keyboard, mouse, touch screen or gamepad want? Turns input events into an {@link Intent} and into
 * turns of the head.
 */
import { IDLE, type Intent } from "../core/movement/walker.ts";
import { type PadMotion, readPads } from "./gamepad.ts";
import { HeldKeys } from "./heldkeys.ts";
import { type Command, commandOf, isForControl, MOTIONS } from "./keys.ts";
import { PadWatch } from "./padwatch.ts";
import { holdsPointer } from "./pointerlock.ts";

export interface ControlEvents {
  /** Whose keys count. */
  readonly keys: EventTarget;
  /** Turn by these angles in radians. */
  readonly turn: (yaw: number, pitch: number) => void;
  /** A key or a button went down that does not move anything; answers whether that is of use here. */
  readonly command: (command: Command) => boolean;
  /** A click or a tap without dragging, in CSS pixels from the corner of the canvas. */
  readonly tap: (x: number, y: number) => void;
  /** Whether gamepads count now; always unless given. They point at nothing, and keys do. */
  readonly hearsPads?: () => boolean;
  /** What the stick lies in; unless given, the window. */
  readonly over?: HTMLElement;
  /** Where on the page there is room for the stick; unless given, all over it. */
  readonly room?: () => DOMRect;
}

const RADIANS_PER_PX = 0.0032;
const TOUCH_RADIANS_PER_PX = 0.006;
const [KEY_TURN_RAD_PER_S, KEY_TILT_RAD_PER_S] = [1.7, 1.1];
const STICK_RADIUS_PX = 48;
/** A press that is shorter and moves less is a click. */
const [TAP_MS, TAP_PX] = [400, 6];

const EVERYWHERE = { left: -Infinity, top: -Infinity, right: Infinity, bottom: Infinity };

/** Where the middle of the stick goes so that all of it stays between two edges; half-way where they are too close. */
function inside(wanted: number, from: number, to: number): number {
  if (to - from < 2 * STICK_RADIUS_PX) return (from + to) / 2;
  return Math.min(to - STICK_RADIUS_PX, Math.max(from + STICK_RADIUS_PX, wanted));
}

export class Controls {
  private readonly ending = new AbortController();
  private readonly held = new HeldKeys();
  private readonly watch: PadWatch;
  /** What counts in this frame. */
  private keys: ReadonlySet<string> = new Set();
  private pads: PadMotion = readPads([]);
  private fast = false;
  private stickPointer: { id: number; x: number; y: number } | undefined;
  private stickOffset = { x: 0, y: 0 };
  private pressed: { x: number; y: number; t_ms: number } | undefined;
  private lookPointer: { id: number; x: number; y: number } | undefined;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly stick: HTMLElement,
    private readonly events: ControlEvents,
  ) {
    const { signal } = this.ending;
    this.watch = new PadWatch(
      // Who looks at another page presses for that.
      () => (document.hidden || events.hearsPads?.() === false ? [] : (navigator.getGamepads?.() ?? [])),
      (command) => events.command(command),
    );
    addEventListener("gamepadconnected", () => this.watch.look(), { signal });
    events.keys.addEventListener("keydown", (event) => this.press(event as KeyboardEvent), { signal });
    events.keys.addEventListener("keyup", (event) => this.release(event as KeyboardEvent), { signal });
    addEventListener("blur", () => this.letGo(), { signal });
    canvas.addEventListener("blur", () => this.letGo());
    // The focus may leave from something else in it, and keys go elsewhere then.
    if (events.keys !== window) events.keys.addEventListener("focusout", () => this.letGo(), { signal });
    canvas.addEventListener("pointerdown", (event) => this.pointerDown(event));
    canvas.addEventListener("pointermove", (event) => this.pointerMove(event));
    for (const name of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(name, (event) => this.pointerUp(event));
    }
    canvas.addEventListener("dblclick", (event) => this.lockPointer(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  /** Hears no keys any more, and looks at no gamepad. */
  close(): void {
    this.ending.abort();
    this.watch.close();
  }

  /** What is wanted in this frame, after {@link turnByKeys}. */
  intent(): Intent {
    const sum = { forward: 0, right: 0, up: 0 };
    for (const code of this.keys) {
      const key = MOTIONS[code];
      sum.forward += key?.forward ?? 0;
      sum.right += key?.right ?? 0;
      sum.up += key?.up ?? 0;
    }
    const pads = this.pads.intent;
    const clamp = (value: number) => Math.min(1, Math.max(-1, value));
    const forward = clamp(sum.forward - this.stickOffset.y + pads.forward);
    const right = clamp(sum.right + this.stickOffset.x + pads.right);
    const up = clamp(sum.up + pads.up);
    if (forward === 0 && right === 0 && up === 0) return IDLE;
    return { forward, right, up, fast: this.fast || pads.fast };
  }

  /** Takes what is held, and what was pressed since the last frame, and turns by it; call it once in a frame. */
  turnByKeys(seconds: number): void {
    this.pads = this.watch.take();
    this.keys = this.held.take();
    let [yaw, pitch] = [this.pads.yaw, this.pads.pitch];
    for (const code of this.keys) {
      yaw += (MOTIONS[code]?.turn ?? 0) * KEY_TURN_RAD_PER_S;
      pitch += (MOTIONS[code]?.tilt ?? 0) * KEY_TILT_RAD_PER_S;
    }
    if (yaw !== 0 || pitch !== 0) this.events.turn(yaw * seconds, pitch * seconds);
  }

  private press(event: KeyboardEvent): void {
    this.fast = event.shiftKey;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    // Who listens outside of a shadow tree is told of its host alone.
    const [target] = event.composedPath();
    if (target instanceof Element && isForControl(target, event.code)) return;
    const command = commandOf(event);
    if (MOTIONS[event.code]) {
      this.held.press(event.code);
      event.preventDefault();
    } else if (command && !event.repeat && this.events.command(command)) event.preventDefault();
  }

  private release(event: KeyboardEvent): void {
    this.fast = event.shiftKey;
    this.held.release(event.code);
  }

  /** Nothing is held any more: nobody will say that it was let go. */
  letGo(): void {
    this.held.clear();
    this.fast = false;
  }

  private lockPointer(event: MouseEvent): void {
    if ((event as PointerEvent).pointerType === "touch" || !this.canvas.requestPointerLock) return;
    // Browsers refuse a second lock shortly after the first was left; dragging works all the same.
    Promise.resolve(this.canvas.requestPointerLock()).catch(() => {});
  }

  private pointerDown(event: PointerEvent): void {
    this.canvas.focus({ preventScroll: true });
    if (event.button !== 0) return;
    this.pressed = { x: event.clientX, y: event.clientY, t_ms: event.timeStamp };
    this.canvas.setPointerCapture(event.pointerId);
    const start = { id: event.pointerId, x: event.clientX, y: event.clientY };
    if (event.pointerType === "touch" && this.isLeftHalf(event) && !this.stickPointer) {
      this.stickPointer = start;
      this.showStick();
    } else if (!this.lookPointer) this.lookPointer = start;
  }

  private pointerMove(event: PointerEvent): void {
    if (holdsPointer(this.canvas)) {
      this.events.turn(-event.movementX * RADIANS_PER_PX, -event.movementY * RADIANS_PER_PX);
    } else if (this.stickPointer?.id === event.pointerId) {
      const [x, y] = [event.clientX - this.stickPointer.x, event.clientY - this.stickPointer.y];
      const size = Math.max(STICK_RADIUS_PX, Math.hypot(x, y));
      this.stickOffset = { x: x / size, y: y / size };
      this.showStick();
    } else if (this.lookPointer?.id === event.pointerId) {
      const rate = event.pointerType === "touch" ? TOUCH_RADIANS_PER_PX : RADIANS_PER_PX;
      this.events.turn((event.clientX - this.lookPointer.x) * rate, (event.clientY - this.lookPointer.y) * rate);
      this.lookPointer = { id: event.pointerId, x: event.clientX, y: event.clientY };
    }
  }

  private pointerUp(event: PointerEvent): void {
    if (event.type === "pointerup") this.maybeTap(event);
    if (this.lookPointer?.id === event.pointerId) this.lookPointer = undefined;
    if (this.stickPointer?.id !== event.pointerId) return;
    this.stickPointer = undefined;
    this.stickOffset = { x: 0, y: 0 };
    this.showStick();
  }

  private isLeftHalf({ clientX }: PointerEvent): boolean {
    const { left, width } = this.canvas.getBoundingClientRect();
    return clientX < left + width / 2;
  }

  private maybeTap(event: PointerEvent): void {
    const { pressed } = this;
    this.pressed = undefined;
    if (!pressed || event.timeStamp - pressed.t_ms > TAP_MS) return;
    if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > TAP_PX) return;
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const locked = holdsPointer(this.canvas);
    this.events.tap(locked ? width / 2 : event.clientX - left, locked ? height / 2 : event.clientY - top);
  }

  private showStick(): void {
    this.stick.hidden = this.stickPointer === undefined;
    if (!this.stickPointer) return;
    const { left, top, right, bottom } = this.events.room?.() ?? EVERYWHERE;
    const [x_px, y_px] = this.within(
      inside(this.stickPointer.x, left, right),
      inside(this.stickPointer.y, top, bottom),
    );
    this.stick.style.left = `${x_px}px`;
    this.stick.style.top = `${y_px}px`;
    const knob = this.stick.firstElementChild as HTMLElement | null;
    const { x, y } = this.stickOffset;
    if (knob) knob.style.transform = `translate(${x * STICK_RADIUS_PX}px, ${y * STICK_RADIUS_PX}px)`;
  }

  /** A point of the window as the stick's own element counts, which a page may have turned smaller or larger. */
  private within(x: number, y: number): readonly [number, number] {
    const { over } = this.events;
    if (!over) return [x, y];
    const { left, top, width } = over.getBoundingClientRect();
    const scale = width > 0 ? over.offsetWidth / width : 1;
    return [(x - left) * scale, (y - top) * scale];
  }
}
