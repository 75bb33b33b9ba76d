/**
 * Which line does one pretend to have? What is chosen holds in this tab over reloads and other scenes until something else is chosen, so
 * that the first picture of a world can be watched as it comes over a slow line.
 */
import { LINES, type Throttle } from "../../core/fetch/throttle.ts";
import { recall, remember } from "../remembering.ts";

const REMEMBERED = "belvedere.line";

/** Slows down what is fetched from now on; a name of no line, such as an empty one, ends that. */
export function chooseLine(throttle: Throttle, name: string): void {
  throttle.line = LINES.find((line) => line.name === name);
  remember("tab", REMEMBERED, throttle.line?.name ?? "");
}

/** Slows down what is fetched as was chosen in this tab. */
export function keepLine(throttle: Throttle): void {
  throttle.line = LINES.find(({ name }) => name === recall("tab", REMEMBERED));
}
