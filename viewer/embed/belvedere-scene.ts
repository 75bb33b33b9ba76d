/**
 * How does any page show a world with one tag? `<belvedere-scene src="https://host/?scene=museum">`: `src` is a link to a
 * viewer, with the scene and the pose that it carries. The element takes the size that it is given, hears keys only while it
 * has the focus, and frees everything when it leaves the page.
 *
 * It dispatches `ready` when the first picture is complete, and `problem`, with the error as `detail`, when something
 * could not be loaded.
 */
import { type Pose, readPose, treeBase } from "../core/address.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../core/fetchqueue.ts";
import { length } from "../core/geometry.ts";
import { passes } from "../core/losses.ts";
import type { Silence } from "../core/silences.ts";
import { Tree } from "../core/tree.ts";
import { webCryptoDigest } from "../core/verify.ts";
import { decoderReady } from "../three/decoder.ts";
import { Stage } from "../three/stage.ts";
import { ASTRAY, TO_THE_START } from "../ui/astray.ts";
import { Controls } from "../ui/controls.ts";
import { make } from "../ui/dom.ts";
import { Doors } from "../ui/doors.ts";
import { type Opened, openScene } from "../ui/opening.ts";
import { unlessForbidden } from "../ui/policy.ts";
import { explain, explainSilence, NO_GRAPHICS, NoSuchScene, type Server, serverAt } from "../ui/problem.ts";
import { Visit } from "../ui/visit.ts";
import { Attention, isTyping } from "./attention.ts";
import { Caption } from "./caption.ts";
import { STYLE } from "./style.ts";
import { takeEarly } from "./upgrade.ts";

const HOW_TO_MOVE =
  "Move with W, A, S, D or the arrow keys; drag to look around, or press R and V; Enter opens and closes doors.";

/** Of all elements on the page, those of other versions apart. */
const attention = new Attention<BelvedereScene>(() => isTyping(document.activeElement));

/** The server of a tree that is shown by a page of whoever. */
const behind = (base: URL): Server => ({ ...serverAt(base, location.origin), isForeignPage: true });

export class BelvedereScene extends HTMLElement {
  static readonly observedAttributes = ["src"];
  private visit: Visit | undefined;
  private canvas: HTMLCanvasElement | undefined;
  private caption: Caption | undefined;
  /** Where to go as soon as a scene is open. */
  private wanted: Pose | undefined;
  /** Which attempt to show something is the current one. */
  private attempt = 0;

  connectedCallback(): void {
    addEventListener("online", this.retry);
    attention.enters(this);
    takeEarly(this, "src");
    void this.show();
    takeEarly(this, "pose");
  }

  disconnectedCallback(): void {
    removeEventListener("online", this.retry);
    attention.leaves(this);
    this.leave();
  }

  /** Whether keys go to it. */
  get hasFocus(): boolean {
    return this.matches(":focus-within");
  }

  attributeChangedCallback(_name: string, before: string | null, after: string | null): void {
    // What stands in the page's text is there before the element is connected.
    if (this.attempt > 0 && this.isConnected && before !== after) void this.show();
  }

  /** The link to a viewer that is shown. */
  get src(): string {
    return this.getAttribute("src") ?? "";
  }

  set src(src: string) {
    this.setAttribute("src", src);
  }

  override focus(options?: FocusOptions): void {
    this.canvas?.focus(options);
  }

  /** Where the eye is, once the scene is open. */
  get pose(): Pose | undefined {
    if (!this.visit) return undefined;
    const { position, yaw, pitch, mode } = this.visit.walker;
    return { position, yaw, pitch, mode };
  }

  /** Goes there, or begins there when no scene is open yet; angles that are not given are zero, and one moves as before unless that is given. */
  set pose(pose: Partial<Pose> | undefined) {
    const { position, yaw = 0, pitch = 0, mode } = pose ?? {};
    const numbers = [...(position ?? []), yaw, pitch];
    const isMode = mode === undefined || mode === "fly" || mode === "walk";
    if (position?.length !== 3 || !numbers.every(Number.isFinite) || !isMode) {
      throw new TypeError(
        'a pose is { position: [x, y, z], yaw, pitch, mode: "fly" or "walk" }, in metres and radians',
      );
    }
    if (this.visit) this.visit.teleport({ position, yaw, pitch, mode });
    else this.wanted = { position, yaw, pitch, mode };
  }

  /** Where something could not be had, it may come now. */
  private readonly retry = (): void => {
    if (!this.caption?.hasFailed) return;
    if (!this.visit) void this.show();
    else {
      this.caption.forgive();
      this.visit.explorer.retry();
    }
  };

  private leave(): void {
    this.attempt += 1;
    this.visit?.close();
    this.visit = undefined;
  }

  private async show(): Promise<void> {
    this.leave();
    const { attempt } = this;
    const canvas = make("canvas", { tabindex: "0", role: "application", "aria-label": `A world. ${HOW_TO_MOVE}` });
    const stick = make("div", { class: "stick", hidden: true, "aria-hidden": "true" }, make("i"));
    const line = make("p", { role: "status" });
    const way = make("button", { type: "button", hidden: true });
    const caption = new Caption(line, () => this.dispatchEvent(new Event("ready")), way);
    for (const name of ["pointerdown", "focus"]) canvas.addEventListener(name, () => attention.uses(this));
    [this.canvas, this.caption] = [canvas, caption];
    const root = this.shadowRoot ?? this.attachShadow({ mode: "open" });
    const style = new CSSStyleSheet();
    style.replaceSync(STYLE);
    root.adoptedStyleSheets = [style];
    root.replaceChildren(canvas, stick, make("div", { class: "caption" }, line, way));
    let server = behind(new URL(location.href));
    try {
      const src = new URL(this.getAttribute("src") ?? ".", document.baseURI);
      server = behind(new URL(treeBase(src.href)));
      const silent = (silence?: Silence) => caption.delay(silence && explainSilence(silence, server));
      const [opened] = await Promise.all([open(src, silent), decoderReady()]);
      if (attempt !== this.attempt) return;
      const stage = await Stage.open(canvas);
      if (attempt !== this.attempt) {
        stage.close();
        return;
      }
      this.visit = this.begin(stage, opened, { canvas, stick, caption }, readPose(src.hash));
    } catch (error) {
      if (attempt === this.attempt) this.fail(error, server, caption);
    }
  }

  private begin(
    stage: Stage,
    { scene, isRoofed, frame }: Opened,
    { canvas, stick, caption }: { canvas: HTMLCanvasElement; stick: HTMLElement; caption: Caption },
    pose: Pose | undefined,
  ): Visit {
    canvas.setAttribute("aria-label", `${scene.manifest.title}. ${HOW_TO_MOVE}`);
    const server = behind(scene.tree.base);
    const visit = new Visit({
      scene,
      stage,
      display: caption,
      isRoofed,
      frame,
      problem: (error) => this.fail(error, server, caption),
      answered: () => caption.answered(),
      outdated: () => this.showAnew(),
      astray: (how) => caption.offer(ASTRAY[how], TO_THE_START, () => visit.start()),
      graphics: (state) => {
        if (state === "lost") caption.problem(NO_GRAPHICS, true);
        else caption.answered();
      },
    });
    const { wanted } = this;
    this.wanted = undefined;
    if (wanted) visit.teleport(wanted);
    else if (pose) visit.follow(pose);
    else visit.start();
    const doors = new Doors(visit);
    const controls = new Controls(canvas, stick, {
      keys: this,
      hearsPads: () => attention.has(this),
      turn: (yaw, pitch) => visit.turn(yaw, pitch),
      command: (command) => {
        if (command === "fly") visit.toggleFly();
        else if (command === "level") visit.level();
        else if (command === "door") return doors.useInReach();
        else return false;
        return true;
      },
      tap: (x, y) => {
        const entry = visit.pick(x, y)?.entry;
        if (entry?.door) doors.use(entry.object);
      },
    });
    visit.onFrame(() => {
      if (length(visit.walker.speed) > 0) caption.withdraw();
      return false;
    });
    visit.begin(controls);
    return visit;
  }

  /** Shows the world as it was published anew, from where one is. */
  private showAnew(): void {
    this.wanted = this.pose;
    void this.show();
  }

  private fail(error: unknown, server: Server, caption: Caption): void {
    const { title, text } = explain(error, server);
    const others = error instanceof NoSuchScene ? (error.others ?? []).map(({ scene }) => scene).join(", ") : "";
    caption.problem(`${title}. ${text}${others && ` ${others}.`}`, passes(error));
    this.dispatchEvent(new CustomEvent("problem", { detail: error }));
  }
}

function open(src: URL, silent: (silence?: Silence) => void): Promise<Opened> {
  const tree = new Tree(treeBase(src.href));
  const queue = new FetchQueue({
    ...FETCH_DEFAULTS,
    fetch: (url, init) => fetch(url, init),
    digest: webCryptoDigest(),
    silent,
  });
  return unlessForbidden(tree, openScene(queue, tree, src));
}

if (!customElements.get("belvedere-scene")) customElements.define("belvedere-scene", BelvedereScene);
