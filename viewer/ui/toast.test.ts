import { expect, it, vi } from "vitest";
import { IncompleteIndexError } from "../core/atlas/objects.ts";
import { FetchError } from "../core/fetch/transfer.ts";
import { NoWebGlError } from "../three/stage.ts";
import { explain, explainSilence, ForbiddenTree, NoSuchScene, serverAt } from "./problem.ts";
import { Toast } from "./toast.ts";

const HERE = serverAt(new URL("https://host/"), "https://host");
const silent = new FetchError("unreachable", "https://host/o/1.glb", "it is silent");
const missing = new FetchError("status", "https://host/o/1.glb", "it is missing", 404);

function shown() {
  const button = () => ({ textContent: "", onclick: () => {}, hidden: false });
  const heard: string[] = [];
  const announcer = { say: (_topic: string, text: string) => void heard.push(text) };
  const line = { hidden: true };
  const parts = { announcer, gone: vi.fn(), line, text: { textContent: "" }, action: button(), close: button() };
  return { parts, heard, toast: new Toast(parts) };
}

it("goes when the server answers, if that is what it was about", () => {
  const { parts, toast } = shown();
  toast.showProblem(silent, HERE, () => {});
  expect([parts.line.hidden, parts.text.textContent]).toEqual([false, expect.stringContaining("cannot be reached")]);
  toast.answered();
  expect(parts.line.hidden).toBe(true);
  toast.showProblem(missing, HERE, () => {});
  toast.answered();
  expect(parts.line.hidden).toBe(false);
  toast.retried();
  expect(parts.line.hidden).toBe(true);
});

it("keeps what can be done, whatever goes wrong, until that is done or closed", () => {
  const { parts, toast } = shown();
  const act = vi.fn();
  toast.showProblem(missing, HERE, () => {});
  toast.show("It was published anew.", "Show it", act);
  toast.showProblem(silent, HERE, () => {});
  toast.answered();
  toast.retried();
  expect([parts.line.hidden, parts.action.textContent]).toEqual([false, "Show it"]);
  parts.action.onclick();
  expect([parts.line.hidden, act.mock.calls.length]).toEqual([true, 1]);
  toast.show("It was published anew.", "Show it", act);
  parts.close.onclick();
  toast.showProblem(silent, HERE, () => {});
  expect(parts.action.textContent).toBe("Try again");
});

it("says that something takes long until that is over, a problem comes or something can be done", () => {
  const { parts, toast } = shown();
  toast.showDelay("It takes long.");
  expect([parts.line.hidden, parts.text.textContent, parts.action.hidden]).toEqual([false, "It takes long.", true]);
  toast.showDelay(undefined);
  expect(parts.line.hidden).toBe(true);
  toast.showDelay("It takes long.");
  toast.showProblem(silent, HERE, () => {});
  toast.showDelay(undefined);
  expect([parts.line.hidden, parts.action.hidden]).toEqual([false, false]);
  toast.showDelay("It takes long.");
  expect(parts.text.textContent).toContain("cannot be reached");
  toast.answered();
  expect(parts.line.hidden).toBe(true);
});

it.each([500, 502, 503, 429])("says that a server answers which does so with %i, and what one can do", (status) => {
  const error = new FetchError("unreachable", "https://host/o/1.glb", `it was answered with ${status}`, status);
  const { text } = explain(error, HERE);
  expect(text).toContain(String(status));
  expect(text).toMatch(/asked again by itself/);
  expect(text).not.toMatch(/cannot be reached|connection/);
});

it("says that the rest is shown where part of the index is lost, and why it is lost", () => {
  const { parts, toast } = shown();
  const index = (cause: unknown) => new IncompleteIndexError("some objects cannot be shown", { cause });
  toast.showProblem(index(missing), HERE, () => {});
  expect(parts.text.textContent).toContain("Some things cannot be shown here");
  expect(parts.text.textContent).toContain("host does not have what this page asked for");
  toast.answered();
  expect(parts.line.hidden).toBe(false);
  toast.showProblem(index(silent), HERE, () => {});
  toast.answered();
  expect(parts.line.hidden).toBe(true);
});

it("names files by their first digits and their kind", () => {
  const url = `https://host/sub/o/77ac0f84${"0".repeat(56)}.glb`;
  const error = new FetchError("status", url, `${url} was answered with 404`, 404);
  expect(explain(error, HERE).text).toContain(": o/77ac0f84….glb was answered with 404.");
});

it("says to whoever runs a page that shows a world what its policy must allow, and nothing of a server that sends viewers", () => {
  const forbidden = new ForbiddenTree("https://worlds");
  expect(explain(forbidden, HERE).text).toContain("belvedere serve --base-origins https://worlds");
  const { text } = explain(forbidden, { ...HERE, isForeignPage: true });
  expect(text).toContain("can allow that: connect-src in its Content-Security-Policy");
  expect(text).not.toContain("belvedere serve");
});

it("says of another server that it must let pages read it", () => {
  const elsewhere = serverAt(new URL("http://host:8080/"), "https://host");
  expect(explain(silent, elsewhere).text).toContain("Access-Control-Allow-Origin");
  expect(explain(silent, HERE).text).not.toContain("Access-Control-Allow-Origin");
});

it("says of what is cut or damaged on the way that the server answers, and what is missing is tried again", () => {
  const broken = new FetchError("broken", "https://host/o/1.glb", "it broke off");
  const { text } = explain(broken, HERE);
  expect(text).toMatch(/answers.*damaged on the way.*missing.*again/);
  expect(text).not.toMatch(/cannot be reached|connection/);
  const { parts, toast } = shown();
  toast.showProblem(broken, HERE, () => {});
  toast.answered();
  expect(parts.line.hidden, "it passes").toBe(true);
  const silence = { url: "https://host/o/1.glb", attempt: 1, attempts: 4, waited_ms: 4000 };
  expect(explainSilence({ ...silence, how: "broken" }, HERE)).toContain("damaged on the way");
  expect(explainSilence({ ...silence, how: "quiet" }, HERE)).toContain("nothing came of something for 4 s");
});

it("says what names of scenes look like to who gives one that cannot be, and trying again is no use", () => {
  const town = { scene: "town", title: "Town", bounds: { min: [0, 0, 0], max: [1, 1, 1] } } as const;
  const { title, text } = explain(new NoSuchScene("../x", [town]), HERE);
  expect(title).toContain("“../x” cannot be the name");
  expect(text).toContain("a to z");
  expect(text).not.toMatch(/[Tt]ry again|reload/);
  expect(explain(new NoSuchScene("tower", [town]), HERE).title).toContain("There is no scene called “tower”");
});

it("says without WebGL what the error itself says, which whoever embeds a world is handed", () => {
  const error = new NoWebGlError();
  expect(explain(error, HERE).text).toBe(error.message);
  expect(error.message).not.toContain("THREE");
});

it("is heard once however often something is tried, and the focus is looked after when it goes", () => {
  const { parts, heard, toast } = shown();
  toast.showDelay("It takes long.");
  toast.showDelay("It takes long, and is tried again.");
  expect(parts.text.textContent).toBe("It takes long, and is tried again.");
  toast.showDelay(undefined);
  expect(heard).toEqual(["It takes long.", ""]);
  expect(parts.gone).toHaveBeenCalledOnce();
  toast.show("It was published anew.", "Show it", () => {});
  toast.show("Here, doors move for you alone.", "Show it", () => {});
  parts.close.onclick();
  expect(heard.slice(2)).toEqual(["It was published anew.", "Here, doors move for you alone.", ""]);
  expect(parts.gone).toHaveBeenCalledTimes(2);
});
