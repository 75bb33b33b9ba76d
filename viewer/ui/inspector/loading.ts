/** How much of what one can see is here, now and over the last minute? */
import { type Progress, shareOf } from "../../core/strategy/progress.ts";
import type { QualitySample } from "../../core/strategy/quality.ts";
import { make, write } from "../dom.ts";
import { writeProgress, writeQuality, writeStandIns } from "../format.ts";
import { inks } from "../inks.ts";
import type { Visit } from "../visit.ts";
import { type Section, section } from "./section.ts";

const [WIDTH, HEIGHT] = [320, 64];
const SPAN_MS = 60_000;

export class Loading implements Section {
  readonly element: HTMLElement;
  private readonly first = bar("First picture");
  private readonly sharp = bar("As sharp as from here");
  private readonly standIns = make("p", { class: "note", hidden: true });
  private readonly chart = make("canvas", { width: String(2 * WIDTH), height: String(2 * HEIGHT), role: "img" });
  private readonly share = make("p", { class: "note" });

  constructor(private readonly visit: Visit) {
    this.element = section(
      "What you can see",
      this.first.element,
      this.sharp.element,
      this.standIns,
      make("p", { class: "caption" }, "Quality over the last minute: ", key("here"), " and ", key("sharp")),
      this.chart,
      this.share,
    );
  }

  update(now_ms: number): void {
    const { explorer, quality } = this.visit;
    const [first, sharp] = [explorer.progress(), explorer.sharpProgress()];
    this.first.show(first);
    this.sharp.show(sharp);
    const why = writeStandIns(first, sharp);
    write(this.standIns, why);
    this.standIns.hidden = why === "";
    const text = writeQuality(explorer.quality(), explorer.visibleCount);
    const work_ms = this.visit.work.quantile_ms(0.95).toFixed(1);
    write(this.share, `${text}; 95 of 100 frames take at most ${work_ms} ms besides drawing and decoding`);
    this.chart.setAttribute("aria-label", `Quality: ${text}`);
    this.draw(quality.samples, now_ms);
  }

  private draw(samples: readonly QualitySample[], now_ms: number): void {
    const pen = this.chart.getContext("2d");
    if (!pen) return;
    pen.setTransform(2, 0, 0, 2, 0, 0);
    pen.clearRect(0, 0, WIDTH, HEIGHT);
    const { grid, chartHere, chartSharp } = inks();
    pen.lineWidth = 1;
    pen.strokeStyle = grid;
    for (const share of [0, 0.5, 1]) line(pen, [0, yOf(share)], [WIDTH, yOf(share)]);
    for (const [of, colour] of [
      ["sharp", chartSharp],
      ["here", chartHere],
    ] as const) {
      pen.strokeStyle = colour;
      pen.lineWidth = 1.5;
      pen.beginPath();
      let drawing = false;
      for (const sample of samples) {
        const share = sample[of];
        const x = WIDTH * (1 - (now_ms - sample.t_ms) / SPAN_MS);
        if (share !== undefined && x >= 0) drawing ? pen.lineTo(x, yOf(share)) : pen.moveTo(x, yOf(share));
        drawing = share !== undefined && x >= 0;
      }
      pen.stroke();
    }
  }
}

const yOf = (share: number) => 3 + (HEIGHT - 6) * (1 - share);

function line(pen: CanvasRenderingContext2D, from: [number, number], to: [number, number]): void {
  pen.beginPath();
  pen.moveTo(...from);
  pen.lineTo(...to);
  pen.stroke();
}

/** As in the chart. */
function key(of: "here" | "sharp"): HTMLElement {
  return make("b", { class: `key ${of}` }, of);
}

function bar(label: string) {
  const progress = make("progress", { max: "1", value: "0", "aria-label": label });
  const text = make("span", { class: "figure" });
  const element = make("div", { class: "bar" }, make("span", {}, label), text, progress);
  const show = (now: Progress | undefined) => {
    progress.value = shareOf(now);
    write(text, now ? writeProgress(now) : "looking around");
  };
  return { element, show };
}
