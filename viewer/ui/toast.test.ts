import { expect, it, vi } from "vitest";
import { FetchError } from "../core/transfer.ts";
import { explain, serverAt } from "./problem.ts";
import { Toast } from "./toast.ts";

const HERE = serverAt(new URL("https://host/"), "https://host");
const silent = new FetchError("unreachable", "https://host/o/1.glb", "it is silent");
const missing = new FetchError("status", "https://host/o/1.glb", "it is missing", 404);

function shown() {
  const button = () => ({ textContent: "", onclick: () => {} });
  const parts = { line: { hidden: true }, text: { textContent: "" }, action: button(), close: button() };
  return { parts, toast: new Toast(parts) };
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

it("says of another server that it must let pages read it", () => {
  const elsewhere = serverAt(new URL("http://host:8080/"), "https://host");
  expect(explain(silent, elsewhere).text).toContain("Access-Control-Allow-Origin");
  expect(explain(silent, HERE).text).not.toContain("Access-Control-Allow-Origin");
});
