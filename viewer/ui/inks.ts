/**
 * Which colours does a canvas draw with? Forced colours change what the page's styles say and leave a canvas alone, so there it draws with
 * those of the system, as a style resolves them.
 */
import { make } from "./dom.ts";

export interface Inks {
  /** One's own place and where one points, and what keeps them apart from what is below. */
  readonly mark: string;
  readonly rim: string;
  /** Where one looks. */
  readonly gaze: string;
  readonly person: string;
  /** The cell where one is, those seen into from there, others of the storey, and others below. */
  readonly here: string;
  readonly seen: string;
  readonly storey: string;
  readonly below: string;
  readonly wall: string;
  /** Lines of a chart: its grid, how much is here, and how much is sharp. */
  readonly grid: string;
  readonly chartHere: string;
  readonly chartSharp: string;
}

const OURS: Inks = {
  mark: "#ffffff",
  rim: "#11151b",
  gaze: "rgb(255 255 255 / 30%)",
  person: "#74c98a",
  here: "rgb(232 185 106 / 75%)",
  seen: "rgb(232 185 106 / 28%)",
  storey: "rgb(200 212 228 / 16%)",
  below: "rgb(200 212 228 / 9%)",
  wall: "rgb(10 13 18 / 55%)",
  grid: "rgb(255 255 255 / 12%)",
  chartHere: "#e8b96a",
  chartSharp: "#7fb2e5",
};

/** Of the system; `resolve` makes a keyword a colour. */
export function systemInks(resolve: (keyword: string) => string): Inks {
  const [ground, ink, chosen, link] = ["Canvas", "CanvasText", "Highlight", "LinkText"].map(resolve) as [
    string,
    string,
    string,
    string,
  ];
  const faint = (colour: string, percent: number) => `color-mix(in srgb, ${colour} ${percent}%, ${ground})`;
  return {
    mark: ink,
    rim: ground,
    gaze: `color-mix(in srgb, ${ink} 45%, transparent)`,
    person: link,
    here: chosen,
    seen: faint(chosen, 30),
    storey: faint(ink, 12),
    below: faint(ink, 4),
    wall: ink,
    grid: faint(ink, 40),
    chartHere: ink,
    chartSharp: link,
  };
}

const forced = () => matchMedia("(forced-colors: active)").matches;

/** Those that count now: a person may choose others at any time. */
export function inks(): Inks {
  if (!forced()) return OURS;
  const probe = make("i", { hidden: true });
  document.body.append(probe);
  probe.style.setProperty("forced-color-adjust", "none");
  const colours = systemInks((keyword) => {
    probe.style.color = keyword;
    return getComputedStyle(probe).color;
  });
  probe.remove();
  return colours;
}
