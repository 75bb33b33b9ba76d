/**
 * How does a visit begin? Reads the address, finds the scene, opens it and hands the page to a {@link Visit}. Whatever
 * stops it ends in a plain sentence and a way out.
 */
import { addressOfScene, readPose, readRevision, treeBase, withoutRevision, writePose } from "../core/address.ts";
import { compartments } from "../core/compartments.ts";
import type { SceneSummary, Viewpoint } from "../core/documents.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../core/fetchqueue.ts";
import { length } from "../core/geometry.ts";
import type { PlacedObject } from "../core/objects.ts";
import { RequestLog } from "../core/requestlog.ts";
import { Shelf } from "../core/shelf.ts";
import { Throttle } from "../core/throttle.ts";
import { isSceneName, Tree } from "../core/tree.ts";
import { webCryptoDigest } from "../core/verify.ts";
import { decoderReady } from "../three/decoder.ts";
import { Stage } from "../three/stage.ts";
import { describeInto } from "./alternative.ts";
import { Announcer } from "./announcer.ts";
import { ASTRAY, TO_THE_START } from "./astray.ts";
import { LiveCompany } from "./company.ts";
import { Controls } from "./controls.ts";
import { DoorHint } from "./doorhint.ts";
import { Doors } from "./doors.ts";
import { element } from "./elements.ts";
import { focusWorld, giveBackFocus, keepFocus } from "./focus.ts";
import { Fold } from "./fold.ts";
import { HelpPanel } from "./help.ts";
import { Hud } from "./hud.ts";
import { inspector } from "./inspect.ts";
import { InspectorPanel } from "./inspector/panel.ts";
import type { Command } from "./keys.ts";
import { MapPanel } from "./map.ts";
import { type Opened, openScene } from "./opening.ts";
import { Pointing } from "./pointing.ts";
import { unlessForbidden } from "./policy.ts";
import { explain, explainSilence, NO_GRAPHICS, NoSuchScene, serverAt, showProblem } from "./problem.ts";
import { Recording } from "./recording.ts";
import { labelled } from "./scenelabels.ts";
import { Toast } from "./toast.ts";
import { Visit } from "./visit.ts";

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
}

/** Whether one panel at a time is all that there is room for. */
function isSmall(): boolean {
  return matchMedia("(max-width: 640px), (max-height: 480px)").matches;
}

/** Closes these where there is no room for more. */
function makeRoom(...others: readonly { toggle(open: boolean): void }[]): void {
  if (isSmall()) for (const other of others) other.toggle(false);
}

/** Whether the page's address leaves a way of drawing on. */
function isUsed(name: string): boolean {
  return new URL(location.href).searchParams.get(name) !== "off";
}

function start(stage: Stage, { scene, scenes, isRoofed, frame }: Opened, network: Network): void {
  const canvas = element("view", HTMLCanvasElement);
  const { toast } = network;
  const announcer = new Announcer(element("live", HTMLParagraphElement));
  const hud = new Hud(announcer);
  const server = serverAt(scene.tree.base, location.origin);
  /** The revision that links name; none while the page goes on to another one. */
  let linked: string | undefined = scene.pointer.revision;
  const showAnew = () => {
    linked = undefined;
    history.replaceState(null, "", withoutRevision(location.href));
    location.reload();
  };
  const outdated = () => toast.show("This world was published anew while you were in it.", "Show it", showAnew);
  /** What is to be said of a link that was made in another revision. */
  let ofOldLink = "";
  const dark = element("dark", HTMLParagraphElement);
  const visit = new Visit({
    scene,
    stage,
    display: hud,
    isRoofed,
    frame,
    uses: { smooth: isUsed("smooth"), impostors: isUsed("impostors"), rules: isUsed("rules") },
    posed: (pose) => history.replaceState(null, "", writePose(pose, linked)),
    problem: (error) => {
      // The same may be met again at each step.
      if (!problems.includes(String(error))) problems.push(String(error));
      toast.showProblem(error, server, () => visit.explorer.retry());
    },
    answered: () => toast.answered(),
    outdated,
    astray: (how) => toast.show(`${ofOldLink}${ASTRAY[how]}`, TO_THE_START, () => visit.start()),
    graphics: (state) => {
      dark.textContent = state === "lost" ? NO_GRAPHICS : "";
      dark.hidden = state === "here";
    },
  });
  const inspectorToggle = element("inspector-toggle", HTMLButtonElement);
  const doors = new Doors(visit);
  const company = new LiveCompany({
    doors,
    visit,
    line: network.throttle,
    counted: (people) => hud.people(people),
    outdated,
  });
  const recording = new Recording(visit, announcer);
  const panel = new InspectorPanel({
    visit,
    recording,
    company,
    announcer,
    ...network,
    toggled: (open) => {
      document.body.classList.toggle("inspecting", open);
      inspectorToggle.setAttribute("aria-pressed", String(open));
      if (open) makeRoom(help, map, ...folds);
      keepFocus();
    },
  });
  document.body.append(panel.element);
  inspectorToggle.onclick = () => panel.toggle();
  const mapToggle = element("map-toggle", HTMLButtonElement);
  const map = new MapPanel(visit, announcer, (open) => {
    mapToggle.setAttribute("aria-pressed", String(open));
    if (open) makeRoom(panel, help, ...folds);
    keepFocus();
  });
  element("middle", HTMLDivElement).append(map.element);
  mapToggle.onclick = () => map.toggle();
  map.people = () => company.movers.map(({ position }) => position);
  const help = new HelpPanel((open) => {
    if (open) makeRoom(panel, map, ...folds);
  });
  const figures = new Fold(
    element("hud-fold", HTMLButtonElement),
    element("figures", HTMLDListElement),
    !isSmall(),
    (open) => open && makeRoom(help, map, places),
  );
  const places = new Fold(
    element("choices-fold", HTMLButtonElement),
    element("places", HTMLDivElement),
    !isSmall(),
    (open) => open && makeRoom(help, map, figures),
  );
  const folds = [figures, places];
  // Both may be remembered as unfolded.
  if (places.open) makeRoom(figures);
  const use = async (object: PlacedObject) => {
    try {
      await company.use(object);
    } catch (error) {
      toast.showProblem(error, server, () => void use(object));
    }
  };
  const pointing = new Pointing({
    pick: (x, y) => visit.pick(x, y),
    canvas,
    inspector: panel,
    isLive: () => !visit.frozen,
    use: (object) => void use(object),
  });
  const hint = new DoorHint({ visit, doors, announcer, use: (door) => void use(door) });
  element("fly-toggle", HTMLButtonElement).onclick = () => visit.toggleFly();
  const commands: Record<Command, () => unknown> = {
    // The door that the page offers goes first: it says that this key opens it.
    door: () => hint.use() || pointing.inspect(),
    inspect: () => pointing.inspect(),
    fly: () => visit.toggleFly(),
    level: () => visit.level(),
    help: () => help.toggle(),
    map: () => map.toggle(),
    inspector: () => panel.toggle(),
    freeze: () => panel.toggleFreeze(),
    record: () => recording.toggle(),
    close: () => [help, map, panel].find(({ open }) => open)?.toggle(false),
  };
  const room = element("free", HTMLDivElement);
  const controls = new Controls(canvas, element("stick", HTMLDivElement), {
    keys: window,
    turn: (yaw, pitch) => visit.turn(yaw, pitch),
    command: (command) => commands[command]() !== false,
    tap: (x, y) => pointing.tap(x, y),
    room: () => room.getBoundingClientRect(),
  });
  visit.onFrame(() => {
    if (length(visit.walker.speed) > 0) help.welcomed();
    return false;
  });
  describeInto(element("picture", HTMLParagraphElement), visit);
  const pose = readPose(location.hash);
  const seen = readRevision(location.hash);
  if (seen !== undefined && seen !== scene.pointer.revision) {
    ofOldLink = "This world has changed since the link was made. ";
    toast.show(ofOldLink.trim(), "All right", () => {});
  }
  if (pose) visit.follow(pose);
  else visit.start();
  addEventListener("hashchange", () => {
    const target = readPose(location.hash);
    ofOldLink = "";
    if (target) visit.follow(target);
  });
  addEventListener("online", () => {
    toast.retried();
    visit.explorer.retry();
  });
  offerScenes(scenes, scene.pointer.scene);
  offerViewpoints(scene.manifest.viewpoints, (chosen) => visit.goTo(chosen));
  visit.begin(controls);
  void company.join();
  window.belvedere = inspector({ visit, company, recording, encodedBytes: () => encoded_bytes, problems });
  addEventListener("keydown", ({ key }) => key === "Tab" && document.body.classList.add("tabbing"));
  giveBackFocus(element("page", HTMLDivElement));
  focusWorld();
}

function makeToast(): Toast {
  return new Toast({
    line: element("toast", HTMLParagraphElement),
    text: element("toast-text", HTMLSpanElement),
    action: element("toast-retry", HTMLButtonElement),
    close: element("toast-close", HTMLButtonElement),
  });
}

async function main(): Promise<void> {
  const retry = () => location.reload();
  let base = new URL(location.href);
  try {
    const tree = new Tree(treeBase(location.href));
    base = tree.base;
    tallyEncodedBytes(tree.base.href);
    const log = new RequestLog(() => performance.now());
    const throttle = new Throttle((url, init) => fetch(url, init));
    const shelf = await Shelf.open(compartments(globalThis.caches), SHELF_BYTES);
    const toast = makeToast();
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
    const opening = Promise.all([
      unlessForbidden(tree, openScene(queue, tree, new URL(location.href))),
      decoderReady(),
    ]);
    opening.catch(() => {});
    const stage = await Stage.open(element("view", HTMLCanvasElement));
    const [opened] = await opening;
    start(stage, opened, { log, throttle, toast });
  } catch (error) {
    const others = error instanceof NoSuchScene ? (error.others ?? []) : [];
    const links = labelled(others).map(({ scene, label }) => ({ label, href: addressOfScene(location.href, scene) }));
    const isHopeless = error instanceof NoSuchScene && error.scene !== undefined && !isSceneName(error.scene);
    showProblem(explain(error, serverAt(base, location.origin)), isHopeless ? undefined : retry, links);
  }
}

void main();
