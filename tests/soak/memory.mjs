/** What does a process hold, and does that grow? Samples `/proc` each second. */
import { readdirSync, readFileSync } from "node:fs";

const MIB = 1 << 20;
/** The first minutes are not counted: what is made once is made there. */
const SETTLED_MIN = 2;
/** So many minutes tell whether memory grows: those, and two to compare. */
export const LEAST_MIN = SETTLED_MIN + 2;
export const MOST_GROWTH = 0.05;

export class Memory {
  samples = [];
  #begin = Date.now();

  constructor(pid) {
    this.pid = pid;
    this.#timer = setInterval(() => this.#sample(), 1000);
  }

  #timer;

  stop() {
    clearInterval(this.#timer);
  }

  #sample() {
    let status;
    try {
      status = readFileSync(`/proc/${this.pid}/status`, "utf8");
      const files = readdirSync(`/proc/${this.pid}/fd`).length;
      const number = (name) => Number(new RegExp(`^${name}:\\s+(\\d+)`, "m").exec(status)?.[1]);
      const mib = (name) => (1024 * number(name)) / MIB;
      this.samples.push({
        s: (Date.now() - this.#begin) / 1000,
        "memory, MiB": mib("VmRSS"),
        "… of its own": mib("RssAnon"),
        "… of files": mib("RssFile"),
        "open files": files,
        threads: number("Threads"),
      });
    } catch {
      // It has ended; whoever started it says so.
    }
  }

  /** The samples of each whole minute, from 0 on. */
  minutes() {
    const whole = Math.floor(((this.samples.at(-1)?.s ?? 0) + 1) / 60);
    return Array.from({ length: whole }, (_, minute) =>
      this.samples.filter(({ s }) => s >= 60 * minute && s < 60 * (minute + 1)),
    );
  }

  /** Whether there are two minutes that count. */
  settled() {
    return this.minutes().length >= LEAST_MIN;
  }

  /** Of one figure: its median of the first minute that counts, of the last, and of the worst, and how it grew. */
  account(figure) {
    const medians = this.minutes().map((samples) => median(samples.map((sample) => sample[figure])));
    const counted = medians.slice(SETTLED_MIN);
    const [first, last, worst] = [counted[0], counted.at(-1), Math.max(...counted)];
    const settled = this.samples.filter(({ s }) => s >= 60 * SETTLED_MIN);
    return {
      first,
      last,
      worst,
      most: Math.max(...settled.map((sample) => sample[figure])),
      growth: worst / first - 1,
      perHour: 3600 * slope(settled.map((sample) => [sample.s, sample[figure]])),
      medians,
    };
  }
}

function median(values) {
  const sorted = values.toSorted((a, b) => a - b);
  return sorted[sorted.length >> 1];
}

/** Least squares. */
function slope(points) {
  const mean = (i) => points.reduce((sum, point) => sum + point[i], 0) / points.length;
  const [x, y] = [mean(0), mean(1)];
  const [up, across] = points.reduce(([u, a], p) => [u + (p[0] - x) * (p[1] - y), a + (p[0] - x) ** 2], [0, 0]);
  return up / across;
}
