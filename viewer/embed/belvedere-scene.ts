/**
 * How does any page show a world with one tag? `<belvedere-scene src="https://host/?scene=museum">`: `src` is a link to a
 * viewer, with the scene and the pose that it carries. The element takes the size that it is given, hears keys only while it
 * has the focus, and frees everything when it leaves the page. Of many on one page a few draw at once, and the others show their last
 * picture (`seats.ts`).
 *
 * It dispatches `ready` when the first picture is complete, and `problem`, with the error as `detail`, when something
 * could not be loaded.
 */
import { length } from "../core/basics/geometry.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../core/fetch/fetchqueue.ts";
import { passes } from "../core/fetch/losses.ts";
import type { Silence } from "../core/fetch/silences.ts";
import { Tree } from "../core/fetch/tree.ts";
import { webCryptoDigest } from "../core/fetch/verify.ts";
import { type Pose, treeBase } from "../core/movement/address.ts";
import { decoderReady } from "../three/decoder.ts";
import { Stage } from "../three/stage.ts";
import { describeInto } from "../ui/alternative.ts";
import { ASTRAY, TO_THE_START } from "../ui/astray.ts";
import { Controls } from "../ui/controls.ts";
import { DoorHint } from "../ui/doorhint.ts";
import { Doors } from "../ui/doors.ts";
import { type Opened, openScene } from "../ui/opening.ts";
import { unlessForbidden } from "../ui/policy.ts";
import { explain, explainSilence, NO_GRAPHICS, NoSuchScene, type Server, serverAt } from "../ui/problem.ts";
import { Reopening } from "../ui/reopening.ts";
import { Visit } from "../ui/visit.ts";
import { Attention, isTyping } from "./attention.ts";
import type { Caption } from "./caption.ts";
import { type Furniture, furnish, HOW_TO_MOVE } from "./furniture.ts";
import { coverWith, showPoster } from "./poster.ts";
import { isSameWorld } from "./sameworld.ts";
import { Seats } from "./seats.ts";
import { readSrc, SrcError } from "./src.ts";
import { takeEarly } from "./upgrade.ts";

/** Of all elements on the page, those of other versions apart. */
const attention = new Attention<BelvedereScene>(() => isTyping(document.activeElement));

/** So many draw at once. */
const seats = new Seats<BelvedereScene>(matchMedia("(pointer: coarse)").matches ? 3 : 8);
const views = new IntersectionObserver((changes) => {
  for (const { target, isIntersecting } of changes) {
    const one = target as BelvedereScene;
    seats.sees(one, isIntersecting);
    one.watch();
  }
});

/** The server of a tree that is shown by a page of whoever. */
const behind = (base: URL): Server => ({ ...serverAt(base, location.origin), isForeignPage: true });

export class BelvedereScene extends HTMLElement {
  static readonly observedAttributes = ["src"];
  private visit: Visit | undefined;
  private queue: FetchQueue | undefined;
  private opening: Reopening<Opened> | undefined;
  private canvas: HTMLCanvasElement | undefined;
  private caption: Caption | undefined;
  /** Where to go as soon as a scene is open. */
  private wanted: Pose | undefined;
  /** Where one was in what a link leads to, when the element left the page: who moves it in the page stays there. */
  private kept: { readonly src: string; readonly pose: Pose } | undefined;
  /** The last picture, while something else draws, and until there is a new one. */
  private poster: HTMLCanvasElement | undefined;
  /** Which attempt to show something is the current one. */
  private attempt = 0;

  constructor() {
    super();
    for (const name of ["focusin", "focusout"]) this.addEventListener(name, () => this.watch());
  }

  connectedCallback(): void {
    addEventListener("online", this.retry);
    attention.enters(this);
    takeEarly(this, "src");
    seats.enters(this);
    views.observe(this);
    if (!seats.has(this)) this.poster = showPoster(this, this.poster);
    takeEarly(this, "pose");
  }

  disconnectedCallback(): void {
    removeEventListener("online", this.retry);
    attention.leaves(this);
    views.unobserve(this);
    seats.leaves(this);
    this.keepPlace();
    this.leave();
  }

  /** There is room for it to draw. */
  draws(): void {
    void this.show();
  }

  /** Others need the room. */
  rests(): void {
    this.keepPlace();
    const picture = this.visit?.copy() ?? this.poster;
    const { hasFocus } = this;
    this.leave();
    this.poster = showPoster(this, picture);
    if (hasFocus) this.focus({ preventScroll: true });
  }

  /** Whether anybody may see it: it is in view, or keys go to it. */
  private get isWatched(): boolean {
    return seats.isInView(this) || this.hasFocus;
  }

  /** Has frames drawn for whoever watches it. */
  watch(): void {
    this.visit?.watch(this.isWatched);
  }

  private dropPoster(): void {
    this.poster?.remove();
    this.poster = undefined;
  }

  private keepPlace(): void {
    const { src, pose } = this;
    // Who is moved twice may not have come anywhere in between.
    if (this.visit && pose) this.kept = { src, pose };
  }

  /** Whether keys go to it. */
  get hasFocus(): boolean {
    return this.matches(":focus-within");
  }

  attributeChangedCallback(_name: string, before: string | null, after: string | null): void {
    // What stands in the page's text is there before the element is connected.
    if (before === after) return;
    const isSame = after !== null && isSameWorld(before, after, document.baseURI);
    if (!isSame) this.dropPoster();
    if (!seats.has(this)) {
      if (this.isConnected && this.attempt > 0) this.poster = showPoster(this, this.poster);
      return;
    }
    if (this.visit && isSame) this.goOn(this.visit, after);
    else void this.show();
  }

  /** The link to a viewer that is shown. */
  get src(): string {
    return this.getAttribute("src") ?? "";
  }

  set src(src: string) {
    this.setAttribute("src", src);
  }

  override focus(options?: FocusOptions): void {
    (this.canvas ?? this.poster)?.focus(options);
  }

  /** Where the eye is, once the scene is open; while others draw, where it was and will be. */
  get pose(): Pose | undefined {
    if (!this.visit)
      return this.isConnected && !seats.has(this) && this.kept?.src === this.src ? this.kept.pose : undefined;
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
    else {
      this.wanted = { position, yaw, pitch, mode };
      if (this.kept?.src === this.src) {
        const pose = { position, yaw, pitch, mode: mode ?? this.kept.pose.mode };
        this.kept = { src: this.src, pose };
      }
    }
  }

  /** Where something could not be had, it may come now. */
  private readonly retry = (): void => {
    if (this.caption?.hasFailed) this.tryAgain();
  };

  private tryAgain(): void {
    if (this.visit) {
      this.caption?.forgive();
      this.visit.explorer.retry();
    } else if (!this.opening?.now()) void this.show();
  }

  /** Goes to the place in the world that is shown which a link names, or where one begins; what was wrong may be well by now. */
  private goOn(visit: Visit, link: string): void {
    this.caption?.withdraw();
    if (this.caption?.hasFailed) this.tryAgain();
    if (!visit.followLink(new URL(link, document.baseURI).hash)) visit.start();
    this.caption?.expect();
  }

  private leave(): void {
    this.attempt += 1;
    this.opening?.close();
    this.opening = undefined;
    this.visit?.close();
    this.visit = undefined;
    this.queue?.close();
    this.queue = undefined;
    // A page may keep the element, but not what it drew with.
    this.shadowRoot?.replaceChildren();
    this.canvas = undefined;
    this.caption = undefined;
  }

  private async show(): Promise<void> {
    const { hasFocus } = this;
    this.leave();
    const { attempt } = this;
    const furniture = furnish(this, () => {
      this.dropPoster();
      this.dispatchEvent(new Event("ready"));
    });
    const { canvas, caption } = furniture;
    if (this.poster) coverWith(canvas, this.poster);
    for (const name of ["pointerdown", "focus"]) canvas.addEventListener(name, () => attention.uses(this));
    [this.canvas, this.caption] = [canvas, caption];
    // What had it has gone.
    if (hasFocus) this.focus({ preventScroll: true });
    let server = behind(new URL(location.href));
    try {
      const src = readSrc(this.getAttribute("src"), document.baseURI);
      server = behind(new URL(treeBase(src.href)));
      const silent = (silence?: Silence) => caption.delay(silence && explainSilence(silence, server));
      const queue = queueFor(silent);
      this.queue = queue;
      const opening = new Reopening(
        () => open(src, queue),
        (error) => this.fail(error, server, caption),
      );
      this.opening = opening;
      const [opened] = await Promise.all([opening.opened, decoderReady()]);
      if (attempt !== this.attempt) return;
      caption.forgive();
      const stage = await Stage.open(canvas);
      if (attempt !== this.attempt) {
        stage.close();
        return;
      }
      this.visit = this.begin(stage, opened, furniture, src.hash);
    } catch (error) {
      // Who makes an element may say at once what it is to show.
      if (error instanceof SrcError) await undefined;
      if (attempt !== this.attempt) return;
      this.opening?.close();
      this.fail(error, server, caption);
    }
  }

  private begin(
    stage: Stage,
    { scene, isRoofed, frame }: Opened,
    { canvas, over, stick, caption, picture, announcer, door }: Furniture,
    hash: string,
  ): Visit {
    const { attempt } = this;
    canvas.setAttribute("aria-label", `${scene.manifest.title}. ${HOW_TO_MOVE}`);
    const server = behind(scene.tree.base);
    const visit = new Visit({
      scene,
      stage,
      display: caption,
      isRoofed,
      frame,
      problem: (error) => {
        // What is given up when one leaves is missed by nobody.
        if (attempt === this.attempt) this.fail(error, server, caption);
      },
      answered: () => caption.answered(),
      outdated: () => this.showAnew(),
      astray: (how) => caption.offer(ASTRAY[how], TO_THE_START, () => visit.start()),
      graphics: (state) => {
        caption.dark(state === "lost" ? NO_GRAPHICS : "");
      },
    });
    const wanted = this.wanted ?? (this.kept?.src === this.src ? this.kept.pose : undefined);
    this.wanted = undefined;
    this.kept = undefined;
    if (wanted) visit.teleport(wanted);
    else if (!visit.followLink(hash)) visit.start();
    const doors = new Doors(visit);
    describeInto(picture, visit);
    const hint = new DoorHint({
      visit,
      doors,
      announcer,
      ...door,
      goes: () => {
        if (this.shadowRoot?.activeElement === door.button) this.focus({ preventScroll: true });
      },
      use: ({ entry }) => doors.use(entry.object),
    });
    const controls = new Controls(canvas, stick, {
      keys: this,
      over,
      hearsPads: () => this.isWatched && attention.has(this),
      turn: (yaw, pitch) => visit.turn(yaw, pitch),
      command: (command) => {
        if (command === "fly") visit.toggleFly();
        else if (command === "level") visit.level();
        else if (command === "door") return hint.use();
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
    visit.watch(this.isWatched);
    return visit;
  }

  /** Shows the world as it was published anew, from where one is. */
  private showAnew(): void {
    this.wanted = this.pose;
    void this.show();
  }

  private fail(error: unknown, server: Server, caption: Caption): void {
    const { title, text } = error instanceof SrcError ? error : explain(error, server);
    const others = error instanceof NoSuchScene ? (error.others ?? []).map(({ scene }) => scene).join(", ") : "";
    const mayHelp = this.visit !== undefined || passes(error);
    caption.problem(
      `${title}. ${text}${others && ` ${others}.`}`,
      passes(error),
      mayHelp ? () => this.tryAgain() : undefined,
    );
    this.dispatchEvent(new CustomEvent("problem", { detail: error }));
  }
}

function queueFor(silent: (silence?: Silence) => void): FetchQueue {
  return new FetchQueue({
    ...FETCH_DEFAULTS,
    fetch: (url, init) => fetch(url, init),
    digest: webCryptoDigest(),
    silent,
  });
}

function open(src: URL, queue: FetchQueue): Promise<Opened> {
  const tree = new Tree(treeBase(src.href));
  return unlessForbidden(tree, openScene(queue, tree, src));
}

if (!customElements.get("belvedere-scene")) customElements.define("belvedere-scene", BelvedereScene);
