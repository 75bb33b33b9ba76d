/**
 * What was asked of the network, why, and how did it end? The last requests with the time that they waited and travelled,
 * and a line that is as slow as one likes.
 */
import type { LoggedRequest, Purpose, RequestLog, Result } from "../../core/requestlog.ts";
import { LINES, type Throttle } from "../../core/throttle.ts";
import { make, write } from "../dom.ts";
import { writeBytes } from "../format.ts";
import { type Section, section } from "./section.ts";

const ROWS = 18;
const COLOURS: Record<Purpose, string> = {
  document: "#c9d1da",
  coarsest: "#e8b96a",
  finer: "#7fb2e5",
  prefetch: "#74c98a",
};
const PURPOSES: Record<Purpose, string> = {
  document: "what there is",
  coarsest: "first picture",
  finer: "sharper",
  prefetch: "ahead",
};
const RESULTS: Record<Result, string> = {
  waiting: "waits",
  running: "under way",
  done: "here",
  kept: "was here",
  cancelled: "cancelled",
  failed: "failed",
};

export class Requests implements Section {
  readonly element: HTMLElement;
  private readonly summary = make("p", { class: "note" });
  private readonly body = make("tbody");
  private readonly rows = Array.from({ length: ROWS }, () => new Row());

  constructor(
    private readonly log: RequestLog,
    private readonly throttle: Throttle,
  ) {
    const table = make(
      "table",
      { class: "requests", "data-testid": "requests" },
      make(
        "thead",
        {},
        make("tr", {}, ...["why", "bytes", "ended", "when"].map((name) => make("th", { scope: "col" }, name))),
      ),
      this.body,
    );
    this.body.append(...this.rows.map(({ element }) => element));
    this.element = section("Requests", this.lineChoice(), legend(), table, this.summary);
  }

  update(now_ms: number): void {
    const { entries } = this.log;
    const latest = entries.slice(-ROWS).reverse();
    const from_ms = Math.min(now_ms - 1000, ...latest.map(({ asked_ms }) => asked_ms));
    const ended = latest.every(({ ended_ms }) => ended_ms !== undefined);
    const to_ms = ended ? Math.max(from_ms + 1000, ...latest.map(({ ended_ms }) => ended_ms ?? 0)) : now_ms;
    this.rows.forEach((row, i) => {
      row.show(latest[i], from_ms, to_ms, now_ms);
    });
    const counts = new Map<Result, number>();
    for (const { result } of entries) counts.set(result, (counts.get(result) ?? 0) + 1);
    const parts = [...counts].map(([result, count]) => `${count} ${RESULTS[result]}`);
    write(this.summary, `Of the last ${entries.length}: ${parts.join(", ")}.`);
  }

  private lineChoice(): HTMLElement {
    const select = make("select", {}, new Option("as it is", ""), ...LINES.map(({ name }) => new Option(name, name)));
    select.onchange = () => {
      this.throttle.line = LINES.find(({ name }) => name === select.value);
    };
    const choice = make("label", { class: "line" }, "Pretend that the line is ", select);
    return make("div", {}, choice, make("p", { class: "note" }, "What this device has kept does not travel."));
  }
}

function legend(): HTMLElement {
  const keys = (Object.keys(COLOURS) as Purpose[]).map((purpose) =>
    make("span", {}, make("i", { class: "swatch", style: `background:${COLOURS[purpose]}` }), PURPOSES[purpose]),
  );
  return make("p", { class: "legend" }, ...keys);
}

class Row {
  readonly element = make("tr", { hidden: true });
  private readonly why = make("td");
  private readonly bytes = make("td");
  private readonly result = make("td");
  private readonly waited = make("i", { class: "waited" });
  private readonly travelled = make("i");

  constructor() {
    this.element.append(this.why, this.bytes, this.result, make("td", { class: "when" }, this.waited, this.travelled));
  }

  show(request: LoggedRequest | undefined, from_ms: number, to_ms: number, now_ms: number): void {
    this.element.hidden = request === undefined;
    if (!request) return;
    const { reason, purpose, asked_ms, started_ms, ended_ms, result, tries } = request;
    const why = reason || PURPOSES[purpose];
    write(this.why, why);
    this.why.title = `${why}\n${request.url}`;
    write(this.bytes, request.bytes > 0 ? writeBytes(request.bytes) : "");
    write(this.result, tries > 1 ? `${RESULTS[result]}, ${tries} tries` : RESULTS[result]);
    this.element.dataset.result = result;
    const at = (t_ms: number) => (100 * (t_ms - from_ms)) / (to_ms - from_ms);
    const end_ms = ended_ms ?? now_ms;
    place(this.waited, at(asked_ms), at(started_ms ?? end_ms));
    place(this.travelled, at(started_ms ?? end_ms), at(end_ms));
    this.travelled.style.background = COLOURS[purpose];
  }
}

function place(bar: HTMLElement, from: number, to: number): void {
  bar.style.left = `${from.toFixed(1)}%`;
  bar.style.width = `max(2px, ${(to - from).toFixed(1)}%)`;
}
