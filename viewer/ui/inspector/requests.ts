/**
 * What was asked of the network, why, and how did it end? The last requests with the time that they waited and travelled,
 * and a line that is as slow as one likes.
 */
import type { LoggedRequest, RequestLog, Result } from "../../core/fetch/requestlog.ts";
import { LINES, type Throttle } from "../../core/fetch/throttle.ts";
import type { Purpose } from "../../core/strategy/priority.ts";
import { make, write } from "../dom.ts";
import { writeBytes } from "../format.ts";
import { chooseLine } from "./line.ts";
import { type Section, section } from "./section.ts";

/** So many are listed, of all that the log keeps. */
const ROWS = 100;
/** Bars span so much time at least. */
const LEAST_SPAN_MS = 1000;
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
  /** The latest first; can be scrolled by keys, too. */
  private readonly list = make("ol", {
    class: "requests",
    "data-testid": "requests",
    "aria-label": "The last requests",
    tabindex: "0",
  });
  /** The oldest first. Each request keeps its row, so that what one reads stays where it is while more are asked for. */
  private readonly rows = new Map<LoggedRequest, Row>();

  constructor(
    private readonly log: RequestLog,
    private readonly throttle: Throttle,
  ) {
    this.element = section("Requests", this.lineChoice(), legend(), this.list, this.summary);
  }

  update(now_ms: number): void {
    const { entries } = this.log;
    for (const request of entries.slice(-ROWS)) if (!this.rows.has(request)) this.add(request);
    for (const [request, row] of this.rows) {
      if (this.rows.size <= ROWS) break;
      this.rows.delete(request);
      row.element.remove();
    }
    for (const row of this.rows.values()) row.update();
    const { scrollTop, clientHeight } = this.list;
    const inView = [...this.rows.values()].filter(({ element: { offsetTop, offsetHeight } }) => {
      return offsetTop + offsetHeight > scrollTop && offsetTop < scrollTop + clientHeight;
    });
    const span = spanOf(
      inView.map(({ request }) => request),
      now_ms,
    );
    for (const row of inView) row.drawBars(span, now_ms);
    const counts = new Map<Result, number>();
    for (const { result } of entries) counts.set(result, (counts.get(result) ?? 0) + 1);
    const parts = [...counts].map(([result, count]) => `${count} ${RESULTS[result]}`);
    write(this.summary, `Of the last ${entries.length}: ${parts.join(", ")}.`);
  }

  private add(request: LoggedRequest): void {
    const row = new Row(request);
    this.rows.set(request, row);
    this.list.prepend(row.element);
  }

  private lineChoice(): HTMLElement {
    const select = make("select", {}, new Option("as it is", ""), ...LINES.map(({ name }) => new Option(name, name)));
    select.value = this.throttle.line?.name ?? "";
    select.onchange = () => chooseLine(this.throttle, select.value);
    const choice = make("label", { class: "line" }, "Pretend that the line is ", select);
    const note = "It stays so in this tab, also in other scenes. What this device has kept does not travel.";
    return make("div", {}, choice, make("p", { class: "note" }, note));
  }
}

function legend(): HTMLElement {
  const keys = (Object.keys(COLOURS) as Purpose[]).map((purpose) =>
    make("span", {}, make("i", { class: "swatch", style: `background:${COLOURS[purpose]}` }), PURPOSES[purpose]),
  );
  return make("p", { class: "legend" }, ...keys);
}

/** From when to when, in the clock of the log. */
export interface Span {
  readonly from_ms: number;
  readonly to_ms: number;
}

/** The time that bars of these requests span: until now while one is under way, else until the last has ended. */
export function spanOf(requests: readonly LoggedRequest[], now_ms: number): Span {
  const from_ms = Math.min(now_ms - LEAST_SPAN_MS, ...requests.map(({ asked_ms }) => asked_ms));
  const ends = requests.map(({ ended_ms }) => ended_ms ?? now_ms);
  return { from_ms, to_ms: Math.max(from_ms + LEAST_SPAN_MS, ...ends) };
}

/** Why in full, and below it how much, how it ended and when. */
class Row {
  readonly element: HTMLElement;
  private readonly why = make("span", { class: "why" });
  private readonly bytes = make("span");
  private readonly result = make("span");
  private readonly waited = make("i", { class: "waited" });
  private readonly travelled: HTMLElement;

  constructor(readonly request: LoggedRequest) {
    this.travelled = make("i", { style: `background:${COLOURS[request.purpose]}` });
    this.element = make(
      "li",
      {},
      this.why,
      this.bytes,
      this.result,
      make("span", { class: "when" }, this.waited, this.travelled),
    );
    // Who points at it learns its address; who listens would have to hear out 64 digits, for each.
    this.element.onpointerenter = () => {
      this.element.title = request.url;
    };
    this.element.onpointerleave = () => this.element.removeAttribute("title");
  }

  update(): void {
    const { bytes, result, tries, reason, purpose, detour } = this.request;
    const why = reason || PURPOSES[purpose];
    write(this.why, detour ? `${why} (${detour})` : why);
    write(this.bytes, bytes > 0 ? writeBytes(bytes) : "");
    write(this.result, tries > 1 ? `${RESULTS[result]}, ${tries} tries` : RESULTS[result]);
    this.element.dataset.result = result;
  }

  drawBars({ from_ms, to_ms }: Span, now_ms: number): void {
    const { asked_ms, started_ms, ended_ms = now_ms } = this.request;
    const at = (t_ms: number) => (100 * (t_ms - from_ms)) / (to_ms - from_ms);
    place(this.waited, at(asked_ms), at(started_ms ?? ended_ms));
    place(this.travelled, at(started_ms ?? ended_ms), at(ended_ms));
  }
}

function place(bar: HTMLElement, from: number, to: number): void {
  bar.style.left = `${from.toFixed(1)}%`;
  bar.style.width = `max(2px, ${(to - from).toFixed(1)}%)`;
}
