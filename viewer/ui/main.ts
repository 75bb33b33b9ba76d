/**
 * How does a visit begin? Reads the address, finds the scene, opens it and hands the page to a {@link Visit}. Whatever
 * stops it ends in a plain sentence and a way out.
 */
import { length } from "../core/basics/geometry.ts";
import type { SceneSummary, Viewpoint } from "../core/documents/documents.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../core/fetch/fetchqueue.ts";
import { RequestLog } from "../core/fetch/requestlog.ts";
import { Throttle } from "../core/fetch/throttle.ts";
import { isSceneName, Tree } from "../core/fetch/tree.ts";
import { webCryptoDigest } from "../core/fetch/verify.ts";
import { addressOfScene, treeBase } from "../core/movement/address.ts";
import { compartments } from "../core/shelf/compartments.ts";
import { Shelf } from "../core/shelf/shelf.ts";
import { decoderReady } from "../three/decoder.ts";
import { Stage } from "../three/stage.ts";
import { describeInto } from "./alternative.ts";
import { Announcer } from "./announcer.ts";
import { takeCommands } from "./commands.ts";
import { LiveCompany } from "./company.ts";
import { Doors } from "./doors.ts";
import { element } from "./elements.ts";
import { focusWorld, giveBackFocus, keepFocus } from "./focus.ts";
import { Hud } from "./hud.ts";
import { InSight } from "./insight.ts";
import { inspector } from "./inspect.ts";
import { keepLine } from "./inspector/line.ts";
import { Links } from "./links.ts";
import { type Opened, openScene } from "./opening.ts";
import { makePanels } from "./panels.ts";
import { unlessForbidden } from "./policy.ts";
import {
  explain,
  explainSilence,
  hideProblem,
  NO_GRAPHICS,
  NoSuchScene,
  serverAt,
  showProblem,
  showTrying,
} from "./problem.ts";
import { Recording } from "./recording.ts";
import { Reopening } from "./reopening.ts";
import { labelled } from "./scenelabels.ts";
import { scrollByKeys } from "./scrolling.ts";
import { Toast } from "./toast.ts";
import { Visit, type VisitParts } from "./visit.ts";

/** So much is kept on this device from visit to visit. */
const SHELF_BYTES = matchMedia("(pointer: coarse)").matches ? 64e6 : 256e6;
const problems: string[] = [];
let encoded_bytes = 0;

function tallyEncodedBytes(base: string): void {
  if (!PerformanceObserver.supportedEntryTypes?.includes("resource")) return;
  const observer = new PerformanceObserver((list) => {
    for (const entry of list.getEntries() as PerformanceResourceTiming[]) {
      const published = entry.name.startsWith(`${base}o/`) || entry.name.startsWith(`${base}v1/`);
      if (published) encoded_bytes += entry.encodedBodySize;
    }
  });
  observer.observe({ type: "resource", buffered: true });
}

function offerScenes(scenes: readonly SceneSummary[], current: string): void {
  if (scenes.length < 2) return;
  const select = element("scenes", HTMLSelectElement);
  select.replaceChildren(
    ...labelled(scenes).map(({ scene, label }) => new Option(label, scene, scene === current, scene === current)),
  );
  select.onchange = () => location.assign(addressOfScene(location.href, select.value));
  element("scene-choice", HTMLLabelElement).hidden = false;
  element("choices", HTMLElement).hidden = false;
}

function offerViewpoints(viewpoints: readonly Viewpoint[], goTo: (viewpoint: Viewpoint) => void): void {
  if (viewpoints.length < 2) return;
  const select = element("viewpoints", HTMLSelectElement);
  select.replaceChildren(new Option("go to …", ""), ...viewpoints.map(({ name }, i) => new Option(name, String(i))));
  select.onchange = () => {
    const viewpoint = viewpoints[Number(select.value)];
    if (select.value !== "" && viewpoint) goTo(viewpoint);
    select.value = "";
    focusWorld();
  };
  element("viewpoint-choice", HTMLLabelElement).hidden = false;
  element("choices", HTMLElement).hidden = false;
}

/** What the inspector is told by what fetches. */
interface Network {
  readonly log: RequestLog;
  readonly throttle: Throttle;
  /** Says what goes wrong with it. */
  readonly toast: Toast;
  /** Tells who listens to the page. */
  readonly announcer: Announcer;
}

/** What the page's address says of a way of drawing, if it says anything. */
function wishOf(name: string): "on" | "off" | undefined {
  const wish = new URL(location.href).searchParams.get(name);
  return wish === "on" || wish === "off" ? wish : undefined;
}

/** Whether the page's address leaves a way of drawing on. */
function isUsed(name: string): boolean {
  return wishOf(name) !== "off";
}

function start(stage: Stage, opened: Opened, network: Network): void {
  const { scene, scenes } = opened;
  const { toast, announcer } = network;
  const hud = new Hud(announcer);
  const links = new Links(scene.pointer.revision, toast);
  const server = serverAt(scene.tree.base, location.origin);
  const failed = (error: unknown, again: () => void) => toast.showProblem(error, server, again);
  const visit = visitOf(stage, opened, {
    announcer,
    hud,
    links,
    answered: () => toast.answered(),
    problem: (error) => {
      // The same may be met again at each step.
      if (!problems.includes(String(error))) problems.push(String(error));
      failed(error, () => visit.explorer.retry());
    },
  });
  const doors = new Doors(visit);
  const company = new LiveCompany({
    doors,
    visit,
    line: network.throttle,
    counted: (people) => hud.people(people),
    outdated: () => links.outdated(),
    movedAlone: () => links.movedAlone(),
  });
  const recording = new Recording(visit, announcer);
  const panels = makePanels({ visit, recording, company, announcer, log: network.log, throttle: network.throttle });
  const controls = takeCommands({ visit, doors, company, recording, announcer, panels, failed });
  visit.onFrame(() => {
    if (length(visit.walker.speed) > 0) panels.help.welcomed();
    return false;
  });
  const insight = new InSight(announcer);
  visit.onFrame((now_ms) => {
    insight.update(now_ms, () => company.names);
    return false;
  });
  describeInto(element("picture", HTMLParagraphElement), visit, () => company.names);
  links.follow(visit);
  addEventListener("online", () => {
    toast.retried();
    visit.explorer.retry();
  });
  offerScenes(scenes, scene.pointer.scene);
  offerViewpoints(scene.manifest.viewpoints, (chosen) => visit.goTo(chosen));
  visit.begin(controls);
  window.belvedere = inspector({ visit, company, recording, encodedBytes: () => encoded_bytes, problems });
  addEventListener("keydown", ({ key }) => key === "Tab" && document.body.classList.add("tabbing"));
  giveBackFocus(document.body);
  focusWorld();
}

/** Who hears of a visit. */
interface Told extends Pick<VisitParts, "answered" | "problem"> {
  readonly announcer: Announcer;
  readonly hud: Hud;
  readonly links: Links;
}

/** A visit that tells the page what becomes of it. */
function visitOf(stage: Stage, { scene, isRoofed, frame }: Opened, { announcer, hud, links, ...heard }: Told): Visit {
  const dark = element("dark", HTMLParagraphElement);
  const visit = new Visit({
    ...heard,
    scene,
    stage,
    display: hud,
    isRoofed,
    frame,
    uses: { smooth: isUsed("smooth"), impostors: isUsed("impostors"), rules: isUsed("rules") },
    posed: (pose) => links.posed(pose),
    outdated: () => links.outdated(),
    astray: (how) => links.astray(how, () => visit.start()),
    graphics: (state) => {
      dark.textContent = state === "lost" ? NO_GRAPHICS : "";
      announcer.say("dark", dark.textContent);
      dark.hidden = state === "here";
    },
  });
  return visit;
}

function makeToast(announcer: Announcer): Toast {
  scrollByKeys(element("toast-text", HTMLSpanElement));
  return new Toast({
    announcer,
    gone: keepFocus,
    line: element("toast", HTMLElement),
    text: element("toast-text", HTMLSpanElement),
    action: element("toast-retry", HTMLButtonElement),
    close: element("toast-close", HTMLButtonElement),
  });
}

/** Opens a scene as soon as that can be done; says meanwhile why it cannot be, and offers to try at once. */
function openWhenPossible(open: () => Promise<Opened>, base: URL): Reopening<Opened> {
  const again = () => {
    showTrying();
    reopening.now();
  };
  const reopening = new Reopening(open, (error) => showProblem(explain(error, serverAt(base, location.origin)), again));
  // Who is in a scene listens too.
  const ending = new AbortController();
  const end = () => ending.abort();
  addEventListener("online", () => reopening.now(), { signal: ending.signal });
  reopening.opened.then(end, end);
  return reopening;
}

async function main(): Promise<void> {
  const retry = () => location.reload();
  let base = new URL(location.href);
  let reopening: Reopening<Opened> | undefined;
  try {
    const tree = new Tree(treeBase(location.href));
    base = tree.base;
    tallyEncodedBytes(tree.base.href);
    const log = new RequestLog(() => performance.now());
    const throttle = new Throttle((url, init) => fetch(url, init));
    keepLine(throttle);
    const shelf = await Shelf.open(compartments(globalThis.caches), SHELF_BYTES, tree.base.origin);
    const announcer = new Announcer(element("live", HTMLParagraphElement));
    const toast = makeToast(announcer);
    const server = serverAt(base, location.origin);
    const queue = new FetchQueue({
      ...FETCH_DEFAULTS,
      fetch: throttle.fetch,
      digest: webCryptoDigest(),
      log,
      shelf,
      silent: (silence) => toast.showDelay(silence && explainSilence(silence, server)),
    });
    // The first documents travel while the renderer gets ready.
    reopening = openWhenPossible(() => unlessForbidden(tree, openScene(queue, tree, new URL(location.href))), base);
    const opening = Promise.all([reopening.opened, decoderReady()]);
    opening.catch(() => {});
    const stage = await Stage.open(element("view", HTMLCanvasElement), wishOf("shadows"));
    const [opened] = await opening;
    hideProblem();
    start(stage, opened, { log, throttle, toast, announcer });
  } catch (error) {
    reopening?.close();
    const others = error instanceof NoSuchScene ? (error.others ?? []) : [];
    const links = labelled(others).map(({ scene, label }) => ({ label, href: addressOfScene(location.href, scene) }));
    const isHopeless = error instanceof NoSuchScene && error.scene !== undefined && !isSceneName(error.scene);
    showProblem(explain(error, serverAt(base, location.origin)), isHopeless ? undefined : retry, links);
  }
}

void main();
