/**
 * What went wrong, in a plain sentence, and what can one do? A panel when there is nothing to show; where the walk can go on, a line
 * at the bottom (`toast.ts`).
 */
import { IncompleteMapError } from "../core/atlas/lostpages.ts";
import { IncompleteIndexError } from "../core/atlas/objects.ts";
import { StalePointerError } from "../core/atlas/published.ts";
import { DocumentError } from "../core/basics/json.ts";
import { reasonOf } from "../core/basics/reason.ts";
import { CellRecordError } from "../core/documents/cellrecord.ts";
import type { SceneSummary } from "../core/documents/documents.ts";
import type { Silence } from "../core/fetch/silences.ts";
import { FetchError } from "../core/fetch/transfer.ts";
import { isSceneName } from "../core/fetch/tree.ts";
import { NoWebAddressError } from "../core/movement/address.ts";
import { MemoryShortError } from "../core/strategy/residency.ts";
import { NoDecoderError } from "../three/decoder.ts";
import { NoWebGlError } from "../three/stage.ts";
import { write } from "./dom.ts";
import { element } from "./elements.ts";
import { shorten, writeSeconds } from "./format.ts";

/** The tree does not hold the scene that was asked for, or no scene at all. */
export class NoSuchScene extends Error {
  override readonly name = "NoSuchScene";

  constructor(
    readonly scene: string | undefined,
    /** Those that there are, where that is known. */
    readonly others: readonly SceneSummary[] | undefined,
  ) {
    super(`there is no scene called ${scene ?? "anything"} here`);
  }
}

/** Nothing is published where a link says that a tree is. */
export class NoSuchTree extends Error {
  override readonly name = "NoSuchTree";

  constructor(readonly base: string) {
    super(`nothing is published at ${base}`);
  }
}

/** The page's own server does not let it read from another one. */
export class ForbiddenTree extends Error {
  override readonly name = "ForbiddenTree";

  constructor(readonly origin: string) {
    super(`this page may not read from ${origin}`);
  }
}

export interface Explanation {
  readonly title: string;
  readonly text: string;
}

/** What is said while the browser has taken the graphics card from the page. */
export const NO_GRAPHICS = "The graphics card is busy or was reset. The picture comes back when it can draw again.";

/** The server that is being talked to, and whether it is another one than that of the page. */
export interface Server {
  readonly host: string;
  readonly isElsewhere: boolean;
  /** Whether the page is not the viewer's own, but one that shows a world among other things. */
  readonly isForeignPage?: boolean;
}

/** The server of an address. */
export function serverAt({ host, origin }: URL, pageOrigin: string): Server {
  return { host, isElsewhere: origin !== pageOrigin };
}

/** An error in words, for people: what is missing is named by the first digits of its name. */
export function explain(error: unknown, server: Server): Explanation {
  const { title, text } = explainInFull(error, server);
  return { title, text: shorten(text) };
}

/** That a server takes long to answer, or sends what is damaged, and what is done about it. */
export function explainSilence({ how, attempt, attempts, waited_ms }: Silence, { host }: Server): string {
  if (how === "broken") {
    return `Some of what comes from ${host} is cut or damaged on the way. It is asked for again (${attempt + 1} of ${attempts}), and what is here stays.`;
  }
  if (how === "backing off") {
    return `${host} has more to do than it can just now, and asked to wait for ${writeSeconds(waited_ms)}. Then it is asked again, and what is here stays.`;
  }
  if (how === "quiet") {
    return `${host} takes long to answer: nothing came of something for ${writeSeconds(waited_ms)}. What else can be had comes meanwhile.`;
  }
  return `${host} takes long to answer: nothing came of something for ${writeSeconds(waited_ms)}. It is asked again (${attempt + 1} of ${attempts}), and what is here stays.`;
}

function explainInFull(error: unknown, server: Server): Explanation {
  const { host, isElsewhere, isForeignPage } = server;
  if (error instanceof NoWebGlError) {
    return {
      title: "3-D graphics are not available",
      text: error.message,
    };
  }
  if (error instanceof NoDecoderError) {
    return error.isForbidden
      ? {
          title: "This page may not decode 3-D models",
          text: "Its Content Security Policy keeps WebAssembly from running. Whoever runs the page can allow that: add 'wasm-unsafe-eval' to script-src in its Content-Security-Policy.",
        }
      : {
          title: "3-D models cannot be decoded",
          text: "This browser has no WebAssembly, or it is switched off, as in Apple's Lockdown Mode. Allow it for this page, or open it in another browser.",
        };
  }
  if (error instanceof NoSuchScene && error.scene && !isSceneName(error.scene)) {
    const rule =
      "Names of scenes have 1 to 64 small letters a to z, digits, “-” and “_”, begin with a letter or digit, and are not “index”.";
    const others = !error.others
      ? ""
      : error.others.length > 0
        ? "These can be visited:"
        : `No scene is published on ${host}.`;
    return {
      title: `“${error.scene}” cannot be the name of a scene`,
      text: `${rule} Correct “scene=” in this link. ${others}`.trim(),
    };
  }
  if (error instanceof NoSuchScene) {
    return {
      title: error.scene ? `There is no scene called “${error.scene}”` : "There is nothing to see yet",
      text: !error.others
        ? `It may have been renamed or taken down. Which others there are on ${host} cannot be told just now.`
        : error.others.length > 0
          ? "It may have been renamed or taken down. These can be visited:"
          : `No scene is published on ${host}. The command “belvedere bake FILE --scene NAME” publishes one.`,
    };
  }
  if (error instanceof NoSuchTree || error instanceof NoWebAddressError) {
    return {
      title: "There is no world at the address in this link",
      text: `“base=${error.base}” in this link should be the address of a folder in which worlds are published, such as https://host/worlds/. Correct it, or leave it out.`,
    };
  }
  if (error instanceof ForbiddenTree) {
    const serve = isForeignPage ? "" : `“belvedere serve --base-origins ${error.origin}”, or with another web server, `;
    return {
      title: "This page may not show worlds of another server",
      text: `Its Content Security Policy keeps it from reading ${error.origin}. Whoever runs the page can allow that: ${serve}connect-src in its Content-Security-Policy. The world may also have a page of its own: open ${error.origin}.`,
    };
  }
  if (error instanceof FetchError && error.kind === "unreachable" && error.status !== undefined) {
    return explainOutOfOrder(error.status, host);
  }
  if (error instanceof FetchError && error.kind === "unreachable") {
    const text = `${host} cannot be reached just now. Check your connection and that the server is running, then try again.`;
    const reading = " It must also let pages of other servers read it, with the header Access-Control-Allow-Origin.";
    return { title: "The server does not answer", text: isElsewhere ? text + reading : text };
  }
  if (error instanceof FetchError && error.kind === "broken") {
    const text = `${host} answers, but some of what comes from there is cut or damaged on the way, and is missing here. It is asked for again now and then; if that goes on, something between this page and the server spoils what it sends.`;
    return { title: "Something arrives damaged", text };
  }
  if (error instanceof StalePointerError) {
    const text = `On ${host}, ${error.message}. Try again in a while; if that goes on, whoever runs the server can publish the scene again.`;
    return { title: "Part of what was published is missing", text };
  }
  if (error instanceof FetchError && error.kind === "status") {
    return { title: "Something is missing", text: `${host} does not have what this page asked for: ${error.message}.` };
  }
  if (error instanceof MemoryShortError) {
    return { title: "Memory is full", text: `Some things are left out: ${error.message}.` };
  }
  if (error instanceof IncompleteMapError) {
    return {
      title: "Part of the map of this world is missing",
      text: "Part of the map of this world cannot be had. The walk goes on: in that part walls do not hold, and what is shown there may be incomplete.",
    };
  }
  if (error instanceof IncompleteIndexError) {
    return {
      title: "Part of this world is missing",
      text: `Some things cannot be shown here, and the walk goes on without them. ${explainInFull(error.cause, server).text}`,
    };
  }
  const damaged = error instanceof DocumentError || error instanceof CellRecordError || error instanceof FetchError;
  if (damaged) {
    return {
      title: "Part of this scene is damaged",
      text: `The server sent something that cannot be right: ${reasonOf(error)}. Trying again may help; if not, publish the scene again.`,
    };
  }
  return { title: "This did not work", text: `${reasonOf(error)}. Try again, or reload the page.` };
}

/** A server that answers, and says that it cannot do so just now. */
function explainOutOfOrder(status: number, host: string): Explanation {
  if (status === 429) {
    const text = `${host} has more to do than it can just now, and answers with 429. It is asked again by itself after a while.`;
    return { title: "The server is busy", text };
  }
  const text = `${host} answers with an error (${status}). It is asked again by itself after a while; if that goes on, whoever runs the server finds the reason in its log.`;
  return { title: "The server is out of order", text };
}

/** Fills the page with a problem; its button runs `retry`, and is not there where that is of no use. */
export function showProblem(
  explanation: Explanation,
  retry: (() => void) | undefined,
  links: readonly { label: string; href: string }[] = [],
): void {
  const isNew = element("problem", HTMLDivElement).hidden;
  write(element("problem-title", HTMLHeadingElement), explanation.title);
  write(element("problem-text", HTMLParagraphElement), explanation.text);
  element("problem-links", HTMLUListElement).replaceChildren(
    ...links.map(({ label, href }) => {
      const [item, link] = [document.createElement("li"), document.createElement("a")];
      link.href = href;
      link.textContent = label;
      item.append(link);
      return item;
    }),
  );
  const button = element("problem-retry", HTMLButtonElement);
  button.hidden = retry === undefined;
  button.onclick = retry ?? null;
  setProblem(true);
  // Who has been told of a problem may be elsewhere in it when another try fails.
  if (retry && !isNew) return;
  const way = retry ? button : element("problem-links", HTMLUListElement).querySelector("a");
  // Also where there is no way out, so that who listens hears of it.
  (way ?? element("problem-card", HTMLDivElement)).focus();
}

/** Says that it is tried again. */
export function showTrying(): void {
  write(element("problem-text", HTMLParagraphElement), "Trying again …");
}

/** Gives the page back to whoever it was kept from. */
export function hideProblem(): void {
  setProblem(false);
}

function setProblem(isThere: boolean): void {
  element("problem", HTMLDivElement).hidden = !isThere;
  // Nothing behind it can be reached.
  for (const behind of [element("view", HTMLCanvasElement), element("page", HTMLDivElement)]) behind.inert = isThere;
}
